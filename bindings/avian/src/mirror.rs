//! The colliders of avian's trees, as bodies of a space.

use avian3d::collider_tree::{ColliderTreeProxy, ColliderTreeProxyKey, ColliderTreeType, ColliderTrees, ProxyId};
use avian3d::prelude::RigidBodyColliders;
use bevy::ecs::entity_disabling::Disabled;
use bevy::prelude::{Allow, Entity, Query};
use sapwise::{Aabb, Body, Error, Handle, Space};

/// The owner of all colliders without a rigid body: avian pairs no two of these.
const STANDALONE: u32 = u32::MAX;

/// The colliders of the bodies.
pub(crate) type Bodies<'w, 's> = Query<'w, 's, &'static RigidBodyColliders, Allow<Disabled>>;

/// The collider in the place of a proxy, and its body in the space.
#[derive(Debug, Clone, Copy)]
struct Placed {
    collider: Entity,
    body: Option<Entity>,
    /// `None` if the box is invalid.
    handle: Option<Handle>,
}

/// See the module.
#[derive(Debug)]
pub(crate) struct Mirror {
    pub(crate) space: Space,
    /// By type of tree, then by proxy.
    places: [Vec<Option<Placed>>; 4],
    /// Places that are taken, by type of tree.
    taken: [usize; 4],
}

impl Mirror {
    pub(crate) fn new(space: Space) -> Self {
        Self { space, places: Default::default(), taken: [0; 4] }
    }

    /// Takes over these proxies from the trees, and those that came or went. Returns whether there was any; then the
    /// space is updated.
    pub(crate) fn follow(
        &mut self,
        trees: &ColliderTrees,
        bodies: &Bodies,
        changed: impl Iterator<Item = ColliderTreeProxyKey>,
    ) -> Result<bool, Error> {
        let mut any = false;
        for key in changed {
            any = true;
            self.set(trees, bodies, key)?;
        }
        for of in ColliderTreeType::ALL {
            if self.taken[of as usize] != trees.tree_for_type(of).proxies.len() {
                any = true;
                self.sweep(trees, bodies, of)?;
            }
        }
        if any {
            self.space.update()?;
        }
        Ok(any)
    }

    /// Removes the bodies of proxies that went, and inserts those of proxies that nobody has named.
    fn sweep(&mut self, trees: &ColliderTrees, bodies: &Bodies, of: ColliderTreeType) -> Result<(), Error> {
        let tree = trees.tree_for_type(of);
        for (id, place) in (0..).zip(&mut self.places[of as usize]) {
            let collider = tree.get_proxy(ProxyId::new(id)).map(|proxy| proxy.collider);
            if let Some(gone) = place.take_if(|placed| collider != Some(placed.collider)) {
                self.taken[of as usize] -= 1;
                gone.handle.map_or(Ok(()), |handle| self.space.remove(handle))?;
            }
        }
        for (id, _) in tree.proxies.iter() {
            if self.places[of as usize].get(id).is_none_or(Option::is_none) {
                self.set(trees, bodies, ColliderTreeProxyKey::new(ProxyId::new(id as u32), of))?;
            }
        }
        Ok(())
    }

    /// Sets the body of a proxy to what the tree has.
    fn set(&mut self, trees: &ColliderTrees, bodies: &Bodies, key: ColliderTreeProxyKey) -> Result<(), Error> {
        let tree = trees.tree_for_type(key.tree_type());
        let (Some(proxy), Some(bounds)) = (tree.get_proxy(key.id()), tree.get_proxy_aabb(key.id())) else {
            return Ok(());
        };
        let places = &mut self.places[key.tree_type() as usize];
        places.resize(places.len().max(key.id().index() + 1), None);
        let place = &mut places[key.id().index()];
        self.taken[key.tree_type() as usize] += usize::from(place.is_none());
        // As in the tree, a box that is NaN or inverted meets nothing.
        let aabb = Some(Aabb::new(bounds.min.to_array(), bounds.max.to_array())).filter(|b| b.defect().is_none());
        let is_same = place.is_some_and(|placed| (placed.collider, placed.body) == (proxy.collider, proxy.body));
        let known = place.and_then(|placed| placed.handle);
        let body = body(proxy, key);
        let handle = match (known, aabb) {
            (Some(handle), Some(aabb)) if is_same => {
                let is_other = |(_, known): (&Aabb, &Body)| *known != body.owner(known.membership().owner);
                if let Some((_, known)) = self.space.get(handle).filter(|known| is_other(*known)) {
                    self.space.set_body(handle, body.owner(known.membership().owner))?;
                }
                self.space.set(handle, aabb)?;
                Some(handle)
            }
            (known, aabb) => {
                known.map_or(Ok(()), |handle| self.space.remove(handle))?;
                aabb.map(|aabb| self.space.insert(aabb, body.owner(owner(proxy, bodies)))).transpose()?
            }
        };
        *place = Some(Placed { collider: proxy.collider, body: proxy.body, handle });
        Ok(())
    }

    /// Returns the proxy of a body, `None` for a stale handle.
    pub(crate) fn key(&self, handle: Handle) -> Option<ColliderTreeProxyKey> {
        let data = self.space.get(handle)?.1.get_user_data();
        Some(ColliderTreeProxyKey::new(ProxyId::new((data >> 2) as u32), ColliderTreeType::ALL[(data & 3) as usize]))
    }
}

/// Returns what a proxy may meet, owners aside. Sleeping bodies are like others: a body that is not set costs nothing.
fn body(proxy: &ColliderTreeProxy, key: ColliderTreeProxyKey) -> Body {
    // A static sensor meets static colliders.
    let is_fixed = key.is_static() && !proxy.is_sensor();
    let body = if is_fixed { Body::fixed() } else { Body::default() };
    body.groups(proxy.layers.memberships.0)
        .masks(proxy.layers.filters.0)
        .user_data(u64::from(key.id().id()) << 2 | key.tree_type() as u64)
}

/// Returns the owner of a collider. A search has less to test without owners, so a body that seems to have one
/// collider is none. [`collect`](crate::collect) drops the pairs that are left.
fn owner(proxy: &ColliderTreeProxy, bodies: &Bodies) -> u32 {
    let of = |body| bodies.get(body).is_ok_and(|own| own.iter().len() > 1).then(|| Entity::index_u32(body) + 1);
    proxy.body.map_or(STANDALONE, |body| of(body).unwrap_or(0))
}
