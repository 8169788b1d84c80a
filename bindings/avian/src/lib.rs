//! A broad phase for the physics engine [avian3d](https://docs.rs/avian3d): a [`Space`] of Sapwise in the place of
//! avian's own.
//!
//! ```
//! use avian3d::prelude::*;
//! use bevy::prelude::*;
//! use sapwise_avian::SapwiseBroadPhasePlugin;
//!
//! let broad_phase = SapwiseBroadPhasePlugin::<()>::default();
//! let physics = PhysicsPlugins::default().build().disable::<BvhBroadPhasePlugin>().add(broad_phase);
//! App::new().add_plugins((MinimalPlugins, TransformPlugin, physics));
//! ```
//!
//! It finds the pairs that avian's own broad phase finds, in the same steps: by layers, sensors, [`CollisionHooks`],
//! joints without collisions, disabled bodies and colliders, and colliders without a body. Tests compare both in every
//! step.
//!
//! With hooks `H`, it replaces the plugin that has them:
//!
//! ```
//! # use avian3d::prelude::*;
//! # use bevy::{app::PluginGroupBuilder, ecs::system::SystemParamItem, prelude::PluginGroup};
//! # use sapwise_avian::SapwiseBroadPhasePlugin;
//! # fn physics<H: CollisionHooks + 'static>() -> PluginGroupBuilder
//! # where
//! #     for<'w, 's> SystemParamItem<'w, 's, H>: CollisionHooks,
//! # {
//! let physics = PhysicsPlugins::default().with_collision_hooks::<H>().build();
//! physics.disable::<BvhBroadPhasePlugin<H>>().add(SapwiseBroadPhasePlugin::<H>::default())
//! # }
//! ```
//!
//! **Cost.** A step sets the colliders that avian's trees list as moved: those that left their enlarged box. Static and
//! sleeping bodies cost nothing. avian keeps its trees for spatial queries; their time is in `ColliderTreeDiagnostics`,
//! and that of the broad phase in [`CollisionDiagnostics::broad_phase`].
//!
//! **Precision.** The feature `f32` is on by default. For `f64`, turn the default features off and `f64` on. Boxes are
//! `f32` in both, as in avian's trees.
//!
//! **Versions.** avian3d 0.8 and Bevy 0.20, which asks for Rust 1.97.1.

mod mirror;
#[cfg(test)]
mod tests;

use avian3d::collider_tree::{
    ColliderTreeProxy, ColliderTreeProxyFlags, ColliderTreeProxyKey, ColliderTrees, MovedProxies,
};
use avian3d::collision::CollisionDiagnostics;
use avian3d::collision::contact_types::ContactEdgeFlags;
use avian3d::dynamics::joints::joint_graph::JointGraph;
use avian3d::prelude::*;
use bevy::ecs::system::{StaticSystemParam, SystemParamItem};
use bevy::prelude::*;
use mirror::{Bodies, Mirror};
use sapwise::{Handle, Space};
use std::marker::PhantomData;
use std::time::Instant;

/// Finds the pairs of colliders, in the place of avian's [`BvhBroadPhasePlugin`] with the same hooks.
pub struct SapwiseBroadPhasePlugin<H: CollisionHooks = ()> {
    space: fn() -> Space,
    hooks: PhantomData<H>,
}

impl<H: CollisionHooks> SapwiseBroadPhasePlugin<H> {
    /// Makes the plugin with the empty space that `space` returns, for one that searches by a tuning of this machine:
    /// see [`Space::with`].
    pub fn with(space: fn() -> Space) -> Self {
        Self { space, hooks: PhantomData }
    }
}

impl<H: CollisionHooks> Default for SapwiseBroadPhasePlugin<H> {
    fn default() -> Self {
        Self::with(Space::new)
    }
}

impl<H: CollisionHooks + 'static> Plugin for SapwiseBroadPhasePlugin<H>
where
    for<'w, 's> SystemParamItem<'w, 's, H>: CollisionHooks,
{
    fn build(&self, app: &mut App) {
        app.insert_resource(BroadPhase::new((self.space)()))
            .add_observer(note)
            .add_systems(PhysicsSchedule, collect::<H>.in_set(BroadPhaseSystems::CollectCollisions));
    }
}

/// What is known from earlier steps.
#[derive(Resource)]
struct BroadPhase {
    mirror: Mirror,
    /// Colliders that got layers since the last step.
    layered: Vec<Entity>,
    /// The pairs of the space that the contact graph lacks, ascending. avian asks for a pair again whenever one of its
    /// colliders moves: a hook or a joint may allow it then.
    refused: Vec<(Handle, Handle)>,
    /// Edges that the contact graph has at the next step unless someone else removes one.
    edges: usize,
}

impl BroadPhase {
    fn new(space: Space) -> Self {
        Self { mirror: Mirror::new(space), layered: Vec::new(), refused: Vec::new(), edges: 0 }
    }
}

/// Notes that a collider has other layers. avian sees those of a collider that does not move, too.
fn note(event: On<Insert<CollisionLayers>>, mut broad_phase: ResMut<BroadPhase>) {
    broad_phase.layered.push(event.entity);
}

/// Adds the pairs that began to the contact graph. The narrow phase removes those that ended.
fn collect<H: CollisionHooks>(
    (trees, moved, joints): (Res<ColliderTrees>, Res<MovedProxies>, Res<JointGraph>),
    (keys, bodies): (Query<&ColliderTreeProxyKey>, Bodies),
    hooks: StaticSystemParam<H>,
    mut commands: Commands,
    mut broad_phase: ResMut<BroadPhase>,
    mut graph: ResMut<ContactGraph>,
    mut diagnostics: ResMut<CollisionDiagnostics>,
) -> Result
where
    for<'w, 's> SystemParamItem<'w, 's, H>: CollisionHooks,
{
    let start = Instant::now();
    let BroadPhase { mirror, layered, refused, edges } = &mut *broad_phase;
    let layered = layered.drain(..).filter_map(|collider| keys.get(collider).ok());
    if mirror.follow(&trees, &bodies, moved.proxies().iter().chain(layered).copied())? {
        let space = &mirror.space;
        // The narrow phase removes those of colliders that are still there after this step; avian has removed the
        // others.
        let ended = space.ended().iter().filter(|pair| refused.binary_search(pair).is_err());
        let gone = ended.clone().filter(|(a, b)| !space.contains(*a) || !space.contains(*b)).count();
        let apart = ended.count() - gone;
        let all_there = graph.edges.edge_count() + gone == *edges;
        let candidates: Vec<_> = if all_there {
            refused.retain(|pair| space.ended().binary_search(pair).is_err());
            refused.drain(..).chain(space.begun().iter().copied()).collect()
        } else {
            refused.clear();
            space.pairs().to_vec()
        };
        let hooks = hooks.into_inner();
        for pair in candidates {
            let (Some(a), Some(b)) = (mirror.key(pair.0), mirror.key(pair.1)) else { continue };
            let (Some(of_a), Some(of_b)) = (trees.get_proxy(a), trees.get_proxy(b)) else { continue };
            if graph.contains(of_a.collider, of_b.collider) {
                continue;
            }
            // avian asks for each collider that moved, in this order, and not for static ones among static ones.
            let asks = |key: ColliderTreeProxyKey, proxy: &ColliderTreeProxy| {
                moved.contains(key) && (!(a.is_static() && b.is_static()) || proxy.is_sensor())
            };
            let rank = |key: ColliderTreeProxyKey| (key.tree_type() as u8, key.id());
            let (by_a, by_b) = (asks(a, of_a), asks(b, of_b));
            let (one, other) = if by_b && (!by_a || rank(b) < rank(a)) { (of_b, of_a) } else { (of_a, of_b) };
            let flags = one.flags.union(other.flags);
            let meet = (by_a || by_b)
                && one.body != other.body
                && !is_disabled(&joints, one, other)
                && (!flags.contains(ColliderTreeProxyFlags::CUSTOM_FILTER)
                    || hooks.filter_pairs(one.collider, other.collider, &mut commands));
            if meet {
                add(&mut graph, one, other, flags);
            } else {
                refused.push(pair);
            }
        }
        refused.sort_unstable();
        *edges = graph.edges.edge_count().wrapping_sub(apart);
    }
    diagnostics.broad_phase += start.elapsed();
    Ok(())
}

/// Returns whether a joint lets the bodies of two colliders pass through each other.
fn is_disabled(joints: &JointGraph, one: &ColliderTreeProxy, other: &ColliderTreeProxy) -> bool {
    let bodies = one.body.zip(other.body);
    bodies.is_some_and(|(one, other)| joints.joints_between(one, other).any(|joint| joint.collision_disabled))
}

/// Adds a pair to the contact graph, as avian's broad phase does.
fn add(graph: &mut ContactGraph, one: &ColliderTreeProxy, other: &ColliderTreeProxy, flags: ColliderTreeProxyFlags) {
    let mut edge = ContactEdge::new(one.collider, other.collider);
    (edge.body1, edge.body2) = (one.body, other.body);
    edge.flags.set(ContactEdgeFlags::CONTACT_EVENTS, flags.contains(ColliderTreeProxyFlags::CONTACT_EVENTS));
    graph.add_edge_with(edge, |pair| {
        (pair.body1, pair.body2) = (one.body, other.body);
        pair.flags.set(ContactPairFlags::MODIFY_CONTACTS, flags.contains(ColliderTreeProxyFlags::MODIFY_CONTACTS));
        let without = ColliderTreeProxyFlags::BODY_DISABLED.union(ColliderTreeProxyFlags::SENSOR);
        pair.flags.set(ContactPairFlags::GENERATE_CONSTRAINTS, !flags.intersects(without));
    });
}
