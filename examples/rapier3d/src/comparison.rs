//! Sapwise beside rapier's own broad phase.

use rapier3d::prelude::*;
use sapwise::{Aabb, Adaptive, Body, Decision, Error, Handle, Registry, Space, Tuning};
use std::collections::{HashMap, HashSet};
use std::fmt;

/// Margin that rapier adds to every side of a fat AABB, as a share of its unit of length.
///
/// `BroadPhaseBvh::CHANGE_DETECTION_FACTOR` of rapier 0.36, which is private. If another release has another value,
/// [`Comparison::after_step`] reports a pair that differs.
const MARGIN: f32 = 0.04;

/// Both broad phases in one step of a simulation.
///
/// # What is compared
/// Rapier keeps a fat AABB for each collider: the collider's own box, grown by half the prediction distance (1 cm if
/// the unit of length is 1 m). If a later box leaves the fat AABB, rapier replaces it by that box, grown by another
/// 4 cm. Rapier's pairs are the fat AABBs that overlap or touch, except those of two bodies that can't move, those that
/// the collision groups exclude, and those of two colliders of one body. Rapier passes these pairs to the narrow phase
/// as contact pairs, also those of bodies that sleep.
///
/// A [`Space`] excludes the first two kinds itself. The comparison drops the pairs within one body.
///
/// In every step two things hold, or there is a [`Mismatch`]:
///
/// 1. The pairs of a space of the fat AABBs are exactly rapier's pairs.
/// 2. The pairs of a space of the colliders' own boxes are exactly those of rapier's pairs whose own boxes overlap.
///    An engine without margins passes these boxes, and these are recorded.
pub struct Comparison {
    own: Side,
    fat: Side,
    step: u64,
}

/// A space with a body for each collider.
struct Side {
    space: Space,
    bodies: HashMap<ColliderHandle, Handle>,
}

/// Counts of one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Number of colliders, and of boxes.
    pub boxes: usize,
    /// Number of pairs of the space of own boxes.
    pub found: usize,
    /// Number of pairs in `found` whose colliders belong to different bodies: those that may interact.
    pub own: usize,
    /// Number of pairs in `found` that began in this step.
    pub begun: usize,
    /// Pairs of the previous step that ended in this one.
    pub ended: usize,
    /// Number of rapier's pairs.
    pub rapier: usize,
}

/// A pair that one broad phase has and the other lacks.
#[derive(Debug, Clone, PartialEq)]
pub struct Mismatch {
    /// Step in which they differ, from 0.
    pub step: u64,
    /// Both colliders.
    pub pair: [ColliderHandle; 2],
    /// Whether Sapwise has the pair and rapier lacks it.
    pub only_ours: bool,
    /// Whether the pair is one of fat AABBs.
    pub fat: bool,
    /// Both boxes.
    pub boxes: [Aabb; 2],
}

impl Side {
    fn new(registry: &Registry) -> Result<Self, Error> {
        let search = Adaptive::new(Tuning::usual(registry), registry)?;
        Ok(Self { space: Space::with(search), bodies: HashMap::new() })
    }

    /// Returns the box of a collider, if it has a body here.
    fn aabb(&self, collider: ColliderHandle) -> Option<&Aabb> {
        let (aabb, _) = self.space.get(*self.bodies.get(&collider)?)?;
        Some(aabb)
    }

    /// Inserts the body of a collider, or sets what has changed of it.
    fn put(&mut self, collider: ColliderHandle, aabb: Aabb, body: Body) -> Result<(), Error> {
        let known = self.bodies.get(&collider).copied();
        let Some((handle, (was, had))) = known.and_then(|handle| Some((handle, self.space.get(handle)?))) else {
            self.bodies.insert(collider, self.space.insert(aabb, body)?);
            return Ok(());
        };
        let (moved, changed) = (*was != aabb, *had != body);
        // A body that sleeps is not set, so that it comes to rest in the space too.
        if moved {
            self.space.set(handle, aabb)?;
        }
        if changed {
            self.space.set_body(handle, body)?;
        }
        Ok(())
    }

    /// Removes the bodies of colliders that rapier no longer has.
    fn remove_gone(&mut self, physics: &PhysicsWorld) -> Result<(), Error> {
        let gone = |&handle: &Handle| !physics.colliders.contains(self.collider(handle));
        let gone: Vec<Handle> = self.space.handles().filter(gone).collect();
        self.bodies.retain(|&collider, _| physics.colliders.contains(collider));
        self.space.remove_all(&gone)
    }

    /// Returns the collider of a body.
    fn collider(&self, handle: Handle) -> ColliderHandle {
        let (_, body) = self.space.get(handle).expect("a body stays until the collider is gone");
        let data = body.get_user_data();
        ColliderHandle::from_raw_parts((data >> 32) as u32, data as u32)
    }

    /// Returns the pairs whose colliders belong to different bodies of rapier.
    fn pairs(&self, physics: &PhysicsWorld) -> HashSet<[ColliderHandle; 2]> {
        let body = |collider| physics.colliders.get(collider).and_then(Collider::parent);
        let pairs = self.space.pairs().iter().map(|&(a, b)| ordered([self.collider(a), self.collider(b)]));
        pairs.filter(|&[a, b]| body(a) != body(b)).collect()
    }
}

impl Comparison {
    /// Makes two spaces, each with the algorithms of `registry`.
    ///
    /// # Errors
    /// As [`Adaptive::new`].
    pub fn new(registry: &Registry) -> Result<Self, Error> {
        Ok(Self { own: Side::new(registry)?, fat: Side::new(registry)?, step: 0 })
    }

    /// Returns the colliders' own boxes in this step, in the order of rapier's set of colliders.
    pub fn boxes(&self, physics: &PhysicsWorld) -> Vec<Aabb> {
        physics.colliders.iter().filter_map(|(collider, _)| self.own.aabb(collider).copied()).collect()
    }

    /// Returns what was decided for the space of own boxes.
    pub fn last_decision(&self) -> Option<Decision<'_>> {
        self.own.space.search().last_decision()
    }

    /// Takes the boxes of all colliders and finds their pairs. Rapier finds its own from the same boxes at the
    /// beginning of the next step: move, add and remove nothing before that.
    ///
    /// # Errors
    /// Those of [`Space`].
    pub fn before_step(&mut self, physics: &PhysicsWorld) -> Result<(), Error> {
        let params = &physics.integration_parameters;
        let margin = Vector::splat(MARGIN * params.length_unit);
        self.own.remove_gone(physics)?;
        self.fat.remove_gone(physics)?;
        for (handle, collider) in physics.colliders.iter() {
            let body = body(physics, handle, collider);
            let own = collider.compute_aabb();
            self.own.put(handle, corners(own.mins, own.maxs), body)?;
            let grown = collider.compute_broad_phase_aabb(params, &physics.bodies);
            let fat = match self.fat.aabb(handle) {
                None => corners(grown.mins, grown.maxs),
                Some(fat) if contains(fat, &grown) => *fat,
                Some(_) => corners(grown.mins - margin, grown.maxs + margin),
            };
            self.fat.put(handle, fat, body)?;
        }
        self.own.space.update()?;
        self.fat.space.update()
    }

    /// Compares the pairs that were found before the step with those that rapier found in it.
    ///
    /// # Errors
    /// The first pair that one of them lacks.
    pub fn after_step(&mut self, physics: &PhysicsWorld) -> Result<Counts, Mismatch> {
        let contacts = physics.narrow_phase.contact_pairs();
        let rapier: HashSet<_> = contacts.map(|p| ordered([p.collider1, p.collider2])).collect();
        let overlap =
            |[a, b]: &[ColliderHandle; 2]| self.own.aabb(*a).zip(self.own.aabb(*b)).is_some_and(|(a, b)| a.overlaps(b));
        let overlapping: HashSet<_> = rapier.iter().copied().filter(overlap).collect();
        let (own, fat) = (self.own.pairs(physics), self.fat.pairs(physics));
        self.differ(&fat, &rapier, true)?;
        self.differ(&own, &overlapping, false)?;
        self.step += 1;
        let space = &self.own.space;
        Ok(Counts {
            boxes: space.len(),
            found: space.pairs().len(),
            own: own.len(),
            begun: space.begun().len(),
            ended: space.ended().len(),
            rapier: rapier.len(),
        })
    }

    fn differ(
        &self,
        ours: &HashSet<[ColliderHandle; 2]>,
        theirs: &HashSet<[ColliderHandle; 2]>,
        fat: bool,
    ) -> Result<(), Mismatch> {
        // The first in the order of the colliders, so that the same fault gives the same message.
        let Some(&pair) = ours.symmetric_difference(theirs).min_by_key(|pair| pair.map(number)) else { return Ok(()) };
        let side = if fat { &self.fat } else { &self.own };
        let boxes = pair.map(|collider| side.aabb(collider).copied().unwrap_or_default());
        Err(Mismatch { step: self.step, pair, only_ours: ours.contains(&pair), fat, boxes })
    }
}

/// Returns the 64 bits of a collider's handle: index, then generation.
fn number(collider: ColliderHandle) -> u64 {
    let (index, generation) = collider.into_raw_parts();
    u64::from(index) << 32 | u64::from(generation)
}

fn ordered(mut pair: [ColliderHandle; 2]) -> [ColliderHandle; 2] {
    pair.sort_by_key(|&collider| number(collider));
    pair
}

/// Returns what a collider may meet, and its handle as user data.
fn body(physics: &PhysicsWorld, handle: ColliderHandle, collider: &Collider) -> Body {
    let groups = collider.collision_groups();
    let body = match collider.parent().and_then(|body| physics.bodies.get(body)) {
        Some(body) if body.is_dynamic() => Body::default(),
        Some(body) if body.is_kinematic() => Body::kinematic(),
        _ => Body::fixed(),
    };
    body.groups(groups.memberships.bits()).masks(groups.filter.bits()).user_data(number(handle))
}

fn corners(min: Vector, max: Vector) -> Aabb {
    Aabb::new(min.to_array(), max.to_array())
}

fn contains(fat: &Aabb, grown: &rapier3d::geometry::Aabb) -> bool {
    (0..3).all(|a| fat.min[a] <= grown.mins[a] && fat.max[a] >= grown.maxs[a])
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (has, lacks) = if self.only_ours { ("Sapwise", "rapier") } else { ("rapier", "Sapwise") };
        let which = if self.fat { "fat AABBs" } else { "own boxes" };
        let [i, j] = self.pair.map(|collider| collider.into_raw_parts().0);
        let (step, [a, b]) = (self.step, self.boxes);
        write!(f, "step {step}, {which}: {has} has the pair of colliders {i} and {j}, {lacks} lacks it: {a:?}, {b:?}")
    }
}

impl std::error::Error for Mismatch {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Settings, World};
    use std::cell::Cell;

    /// Returns the outcome of step 99 if `spoil` runs between finding the pairs and rapier's step, and the outcome
    /// without it.
    fn outcomes(spoil: impl Fn(&mut Comparison, &PhysicsWorld)) -> [Result<Counts, Mismatch>; 2] {
        [true, false].map(|spoiled| {
            let mut world = World::new(Settings { bodies: 100, seed: 4 });
            let mut comparison = Comparison::new(&Registry::with_cores(1)).unwrap();
            for step in 0..100 {
                world.prepare_step();
                comparison.before_step(world.physics()).unwrap();
                if spoiled && step == 99 {
                    spoil(&mut comparison, world.physics());
                }
                world.step();
                let outcome = comparison.after_step(world.physics());
                if step == 99 {
                    return outcome;
                }
                outcome.unwrap();
            }
            unreachable!("step 99 returns");
        })
    }

    /// Lets one body, in a pair of two bodies of rapier, meet nothing. Returns its collider.
    fn lose_pairs(side: &mut Side, physics: &PhysicsWorld) -> ColliderHandle {
        let [collider, _] = *side.pairs(physics).iter().next().unwrap();
        let lost = side.bodies[&collider];
        let body = side.space.get(lost).unwrap().1.masks(0);
        side.space.set_body(lost, body).unwrap();
        side.space.update().unwrap();
        collider
    }

    #[test]
    fn lost_pair_of_either_side_is_reported() {
        for (fat, which) in [(true, "fat AABBs"), (false, "own boxes")] {
            let lost = Cell::new(None);
            let [spoiled, sound] = outcomes(|c, physics| {
                lost.set(Some(lose_pairs(if fat { &mut c.fat } else { &mut c.own }, physics)));
            });
            let mismatch = spoiled.unwrap_err();
            assert_eq!((mismatch.step, mismatch.only_ours, mismatch.fat), (99, false, fat));
            assert!(mismatch.pair.contains(&lost.get().unwrap()), "{mismatch:?}");
            let [i, j] = mismatch.pair.map(|collider| collider.into_raw_parts().0);
            let told = mismatch.to_string();
            let pair = format!("step 99, {which}: rapier has the pair of colliders {i} and {j}, Sapwise lacks it: ");
            assert!(told.starts_with(&pair), "{told}");
            assert!(sound.is_ok());
        }
    }

    #[test]
    fn groups_that_only_rapier_knows_are_reported() {
        let [spoiled, sound] = outcomes(|c, physics| {
            for (collider, &handle) in &c.own.bodies {
                c.own.space.set_body(handle, Body::default().user_data(number(*collider))).unwrap();
            }
            assert_eq!(c.own.bodies.len(), physics.colliders.len());
            c.own.space.update().unwrap();
        });
        assert!(spoiled.unwrap_err().only_ours);
        let counts = sound.unwrap();
        assert!(counts.found > counts.own, "{counts:?}");
    }

    #[test]
    fn boxes_without_margins_are_reported() {
        let [spoiled, sound] = outcomes(|c, _| {
            for (collider, &handle) in &c.fat.bodies {
                c.fat.space.set(handle, *c.own.aabb(*collider).unwrap()).unwrap();
            }
            c.fat.space.update().unwrap();
        });
        assert!(!spoiled.unwrap_err().only_ours);
        assert!(sound.is_ok());
    }
}
