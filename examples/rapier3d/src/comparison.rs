//! Sapwise beside rapier's own broad phase.

use rapier3d::prelude::*;
use sapwise::{Aabb, Adaptive, BroadPhase, Decision, Error, Filter, Membership, Pairs, Registry, Tuning};
use std::collections::{HashMap, HashSet};
use std::fmt;

/// What rapier adds to every side of a box that left the one it keeps, as a share of its unit of length.
///
/// `BroadPhaseBvh::CHANGE_DETECTION_FACTOR` of rapier 0.36, which is private. Another release may have another: then
/// the boxes that it keeps are others, and [`Comparison::after_step`] names the first pair that tells.
const MARGIN: f32 = 0.04;

/// Both broad phases in one step of a simulation.
///
/// # What is compared
/// Rapier keeps a box for each collider: the collider's own box, grown by half the prediction distance (1 cm for a
/// unit of length of 1 m). Where a later box leaves the one that is kept, it is kept anew, grown by another 4 cm. The
/// kept boxes that overlap, touching ones included, are rapier's pairs; but two of which none moves are no pair, nor
/// are two whose collision groups don't let each other through, nor two colliders of one body. A contact pair is
/// handed to the narrow phase for each pair, and for no other, whether its bodies sleep or not.
///
/// Sapwise leaves out the first two kinds by a [`Filter`], before they are written. Of bodies it knows nothing: the
/// third kind is left out afterwards.
///
/// In every step two things hold, or there is a [`Mismatch`]:
///
/// 1. The boxes as rapier keeps them, in an [`Adaptive`] of their own, give rapier's pairs, all of them and no other.
/// 2. The colliders' own boxes, in another [`Adaptive`], give those of rapier's pairs whose own boxes overlap, all of
///    them and no other. These are the boxes that an engine without margins hands over, and the ones that are
///    recorded.
pub struct Comparison {
    own: Side,
    kept: Side,
    /// The collider at each place of both lists of boxes.
    colliders: Vec<ColliderHandle>,
    /// The box that rapier keeps for each collider.
    margins: HashMap<ColliderHandle, Aabb>,
    step: u64,
}

struct Side {
    broad_phase: Adaptive,
    boxes: Vec<Aabb>,
    pairs: Pairs,
}

/// What one step had.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Colliders, and boxes.
    pub boxes: usize,
    /// Pairs whose own boxes overlap, whether they may interact or not.
    pub overlapping: u64,
    /// Those of them that the filter lets through.
    pub wanted: usize,
    /// Those of them that belong to different bodies: the ones that may interact.
    pub own: usize,
    /// Rapier's pairs.
    pub rapier: usize,
}

/// A pair that one broad phase has and the other lacks.
#[derive(Debug, Clone, PartialEq)]
pub struct Mismatch {
    /// Step in which they differ, from 0.
    pub step: u64,
    /// Places of both boxes in the list of that step.
    pub pair: (usize, usize),
    /// Whether it is Sapwise that has it.
    pub only_ours: bool,
    /// Whether the boxes were compared as rapier keeps them.
    pub kept: bool,
    /// Both boxes.
    pub boxes: [Aabb; 2],
}

impl Side {
    fn new(registry: &Registry) -> Result<Self, Error> {
        let broad_phase = Adaptive::new(Tuning::usual(registry), registry)?;
        let mut pairs = Pairs::new();
        pairs.set_filter(Some(Filter::default()));
        Ok(Self { broad_phase, boxes: Vec::new(), pairs })
    }

    fn clear(&mut self) {
        self.boxes.clear();
        self.memberships().clear();
    }

    fn push(&mut self, b: Aabb, membership: Membership) {
        self.boxes.push(b);
        self.memberships().push(membership);
    }

    fn memberships(&mut self) -> &mut Vec<Membership> {
        &mut self.pairs.filter_mut().expect("every side begins with a filter").memberships
    }

    fn find(&mut self) -> Result<(), Error> {
        self.broad_phase.find_pairs(&self.boxes, &mut self.pairs)
    }
}

impl Comparison {
    /// Both adaptive broad phases, over all cores of the machine.
    ///
    /// # Errors
    /// As [`Adaptive::new`].
    pub fn new(registry: &Registry) -> Result<Self, Error> {
        Ok(Self {
            own: Side::new(registry)?,
            kept: Side::new(registry)?,
            colliders: Vec::new(),
            margins: HashMap::new(),
            step: 0,
        })
    }

    /// The colliders' own boxes in this step, in the order of rapier's set of colliders.
    #[must_use]
    pub fn boxes(&self) -> &[Aabb] {
        &self.own.boxes
    }

    /// What was decided for the colliders' own boxes.
    #[must_use]
    pub fn last_decision(&self) -> Option<Decision<'_>> {
        self.own.broad_phase.last_decision()
    }

    /// Takes the boxes of all colliders and finds their pairs. Rapier finds its own from the same boxes at the
    /// beginning of the step that comes next, so nothing may be moved, added or removed before that.
    ///
    /// # Errors
    /// As [`BroadPhase::find_pairs`].
    pub fn before_step(&mut self, physics: &PhysicsWorld) -> Result<(), Error> {
        let params = &physics.integration_parameters;
        let margin = Vector::splat(MARGIN * params.length_unit);
        self.own.clear();
        self.kept.clear();
        self.colliders.clear();
        self.margins.retain(|&collider, _| physics.colliders.contains(collider));
        for (handle, collider) in physics.colliders.iter() {
            let grown = collider.compute_broad_phase_aabb(params, &physics.bodies);
            let kept = self.margins.entry(handle).or_insert_with(|| corners(grown.mins, grown.maxs));
            if !contains(kept, &grown) {
                *kept = corners(grown.mins - margin, grown.maxs + margin);
            }
            let own = collider.compute_aabb();
            let membership = membership(physics, collider);
            self.colliders.push(handle);
            self.own.push(corners(own.mins, own.maxs), membership);
            self.kept.push(*kept, membership);
        }
        self.own.find()?;
        self.kept.find()
    }

    /// Holds the pairs that were found before the step against those that rapier found in it.
    ///
    /// # Errors
    /// The first pair that one of them lacks.
    pub fn after_step(&mut self, physics: &PhysicsWorld) -> Result<Counts, Mismatch> {
        let place: HashMap<ColliderHandle, usize> = self.colliders.iter().enumerate().map(|(k, &c)| (c, k)).collect();
        let rapier: HashSet<(usize, usize)> = physics
            .narrow_phase
            .contact_pairs()
            .filter_map(|p| Some((*place.get(&p.collider1)?, *place.get(&p.collider2)?)))
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        let body = |place: usize| physics.colliders.get(self.colliders[place]).and_then(Collider::parent);
        let ours = |side: &Side| -> HashSet<(usize, usize)> {
            let places = side.pairs.iter().map(|&(i, j)| (i as usize, j as usize));
            places.filter(|&(i, j)| body(i) != body(j)).collect()
        };
        let (own, kept) = (ours(&self.own), ours(&self.kept));
        let overlapping: HashSet<(usize, usize)> =
            rapier.iter().copied().filter(|&(i, j)| self.own.boxes[i].overlaps(&self.own.boxes[j])).collect();
        self.differ(&kept, &rapier, true)?;
        self.differ(&own, &overlapping, false)?;
        self.step += 1;
        let boxes = self.colliders.len();
        let found = &self.own.pairs;
        Ok(Counts {
            boxes,
            overlapping: found.overlapping(),
            wanted: found.len(),
            own: own.len(),
            rapier: rapier.len(),
        })
    }

    fn differ(
        &self,
        ours: &HashSet<(usize, usize)>,
        theirs: &HashSet<(usize, usize)>,
        kept: bool,
    ) -> Result<(), Mismatch> {
        // The first in the order of the boxes, so that the same fault is told by the same words.
        let Some(&pair) = ours.symmetric_difference(theirs).min() else { return Ok(()) };
        let boxes = if kept { &self.kept.boxes } else { &self.own.boxes };
        let only_ours = ours.contains(&pair);
        Err(Mismatch { step: self.step, pair, only_ours, kept, boxes: [boxes[pair.0], boxes[pair.1]] })
    }
}

/// What rapier asks of two colliders whose boxes overlap, in Sapwise's words.
fn membership(physics: &PhysicsWorld, collider: &Collider) -> Membership {
    let groups = collider.collision_groups();
    let body = collider.parent().and_then(|b| physics.bodies.get(b));
    Membership {
        groups: groups.memberships.bits(),
        mask: groups.filter.bits(),
        fixed: !body.is_some_and(RigidBody::is_dynamic),
        owner: 0,
    }
}

fn corners(min: Vector, max: Vector) -> Aabb {
    Aabb::new(min.to_array(), max.to_array())
}

fn contains(kept: &Aabb, grown: &rapier3d::geometry::Aabb) -> bool {
    (0..3).all(|a| kept.min[a] <= grown.mins[a] && kept.max[a] >= grown.maxs[a])
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (has, lacks) = if self.only_ours { ("Sapwise", "rapier") } else { ("rapier", "Sapwise") };
        let which = if self.kept { "the boxes that rapier keeps" } else { "the colliders' own boxes" };
        let (step, (i, j), [a, b]) = (self.step, self.pair, self.boxes);
        write!(f, "step {step}: of {which} {has} has the pair ({i}, {j}) and {lacks} has not: {a:?}, {b:?}")
    }
}

impl std::error::Error for Mismatch {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Settings, World};

    /// The outcome of step 100 where `spoil` was at work between finding the pairs and rapier's step, and the outcome
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

    /// Lets one box, in a pair of two bodies, collide with nothing.
    fn lose_pairs(side: &mut Side, body: impl Fn(usize) -> Option<RigidBodyHandle>) {
        let of_two = |&&(i, j): &&(u32, u32)| body(i as usize) != body(j as usize);
        let (_, lost) = *side.pairs.iter().find(of_two).unwrap();
        side.memberships()[lost as usize].mask = 0;
        side.find().unwrap();
    }

    #[test]
    fn a_lost_pair_is_told_whichever_boxes_it_is_of() {
        for kept in [true, false] {
            let [spoiled, sound] = outcomes(|c, physics| {
                let colliders = c.colliders.clone();
                let side = if kept { &mut c.kept } else { &mut c.own };
                lose_pairs(side, |place| physics.colliders.get(colliders[place]).and_then(Collider::parent));
            });
            let mismatch = spoiled.unwrap_err();
            assert_eq!((mismatch.step, mismatch.only_ours, mismatch.kept), (99, false, kept));
            assert!(sound.is_ok());
        }
    }

    #[test]
    fn pairs_that_rapiers_groups_leave_out_are_told_where_ours_let_them_through() {
        let [spoiled, sound] = outcomes(|c, _| {
            c.own.memberships().fill(Membership::ALL);
            c.own.find().unwrap();
        });
        assert!(spoiled.unwrap_err().only_ours);
        let counts = sound.unwrap();
        assert!(counts.overlapping > counts.wanted as u64 && counts.wanted > counts.own, "{counts:?}");
    }

    #[test]
    fn boxes_without_rapiers_margins_are_not_rapiers() {
        let [spoiled, sound] = outcomes(|c, _| {
            c.kept.boxes.clone_from(&c.own.boxes);
            c.kept.find().unwrap();
        });
        assert!(!spoiled.unwrap_err().only_ours);
        assert!(sound.is_ok());
    }
}
