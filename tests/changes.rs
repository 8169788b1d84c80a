//! Pairs followed from frame to frame by ids, against sets; and the chain from boxes to changes, bit for bit.

mod common;

use common::Random;
use proptest::prelude::*;
use sapwise::internals::Pair;
use sapwise::tuning::Step;
use sapwise::{
    Aabb, Adaptive, AlgorithmId, BroadPhase, Changes, Error, Filter, Membership, PairOrder, Pairs, Registry, Tuning,
};
use std::collections::BTreeSet;

/// Boxes with ids. Some are added, some removed, and all move.
struct World {
    random: Random,
    boxes: Vec<Aabb>,
    ids: Vec<u64>,
    memberships: Vec<Membership>,
    /// Number of ids given out.
    given: u64,
}

impl World {
    fn new(seed: u64) -> Self {
        Self { random: Random(seed), boxes: Vec::new(), ids: Vec::new(), memberships: Vec::new(), given: 0 }
    }

    fn frame(&mut self, come: usize, go: usize) {
        for b in &mut self.boxes {
            let by = (self.random.next() - 0.5) * 0.1;
            *b = Aabb::new(b.min.map(|v| v + by), b.max.map(|v| v + by));
        }
        for _ in 0..go.min(self.boxes.len()) {
            let at = (self.random.next() * self.boxes.len() as f32) as usize;
            self.boxes.swap_remove(at);
            self.ids.swap_remove(at);
            self.memberships.swap_remove(at);
        }
        for _ in 0..come {
            self.given += 1;
            // Not ascending, and never repeated, because the factor is odd.
            self.ids.push(self.given.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            self.boxes.extend(self.random.cubes(1, [9.0; 3], 0.7));
            self.memberships.push(self.random.membership());
        }
    }
}

fn by_ids(pairs: &[Pair], ids: &[u64]) -> BTreeSet<(u64, u64)> {
    let named = pairs.iter().map(|&(i, j)| (ids[i as usize], ids[j as usize]));
    named.map(|(a, b)| (a.min(b), a.max(b))).filter(|&(a, b)| a != b).collect()
}

fn assert_changes(changes: &Changes<u64>, now: &BTreeSet<(u64, u64)>, before: &BTreeSet<(u64, u64)>, what: &str) {
    assert!(changes.begun().iter().eq(now.difference(before)), "{what}: what began");
    assert!(changes.ended().iter().eq(before.difference(now)), "{what}: what ended");
    assert!(changes.pairs().iter().eq(now), "{what}: all pairs");
    assert_eq!(changes.lasting(), now.intersection(before).count(), "{what}: how many last");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any lists of pairs, with ids that repeat, come, go and change places.
    #[test]
    fn changes_are_the_differences_of_sets(
        frames in prop::collection::vec(
            prop::collection::vec(0_u64..40, 2..60).prop_flat_map(|ids| {
                let count = ids.len() as u32;
                (Just(ids), prop::collection::vec((0..count, 0..count), 0..120))
            }),
            1..8,
        ),
    ) {
        let mut changes = Changes::new();
        let mut before = BTreeSet::new();
        let mut pairs = Pairs::new();
        for (frame, (ids, members)) in frames.iter().enumerate() {
            pairs.clear();
            members.iter().filter(|(a, b)| a != b).for_each(|&(a, b)| pairs.push(a, b));
            changes.update(&pairs, ids).unwrap();
            let now = by_ids(pairs.as_slice(), ids);
            assert_changes(&changes, &now, &before, &format!("frame {frame}"));
            before = now;
        }
    }

    #[test]
    fn missing_ids_are_an_error_and_change_nothing(short in 0_usize..50, seed in 1_u64..u64::MAX) {
        let mut world = World::new(seed);
        world.frame(50, 0);
        let mut pairs = Pairs::new();
        // Each box is in a pair.
        (0..49).for_each(|k| pairs.push(k + 1, k));
        let mut changes = Changes::new();
        changes.update(&pairs, &world.ids).unwrap();
        let all = changes.pairs().to_vec();
        let error = changes.update(&pairs, &world.ids[..short]).unwrap_err();
        let Error::MissingId { position, ids } = error else { panic!("{error}") };
        prop_assert!(position as usize >= short && position < 50 && ids == short, "{}", error);
        prop_assert!(changes.begun().is_empty() && changes.ended().is_empty() && changes.pairs() == all);
        changes.update(&pairs, &world.ids).unwrap();
        prop_assert!(changes.begun().is_empty() && changes.ended().is_empty() && changes.lasting() == 49);
    }
}

/// The output of a frame.
#[derive(Debug, Default, PartialEq)]
struct Output {
    pairs: Vec<Pair>,
    begun: Vec<(u64, u64)>,
    ended: Vec<(u64, u64)>,
    all: Vec<(u64, u64)>,
}

/// Returns the output of every frame of one world, and the algorithms that ran, with `steps` as tuning.
fn run(order: PairOrder, steps: &[(u32, &str)]) -> (Vec<Output>, BTreeSet<AlgorithmId>) {
    let step = |&(from_objects, id): &(u32, &str)| Step { from_objects, algorithm: id.parse().unwrap() };
    let tuning = Tuning::from_steps(steps.iter().map(step).collect()).unwrap();
    let mut adaptive = Adaptive::new(tuning, &Registry::with_cores(2)).unwrap();
    let mut world = World::new(0x10c4);
    let mut pairs = Pairs::with_order(order);
    pairs.set_filter(Some(Filter::default()));
    let mut changes = Changes::new();
    let (mut outputs, mut ran) = (Vec::new(), BTreeSet::new());
    for frame in 0..120 {
        // Up to about 900 boxes and down again, through every step.
        if frame < 60 {
            world.frame(20, 5);
        } else {
            world.frame(3, 18);
        }
        pairs.filter_mut().unwrap().memberships.clone_from(&world.memberships);
        adaptive.find_pairs(&world.boxes, &mut pairs).unwrap();
        ran.insert(adaptive.last_decision().unwrap().algorithm.clone());
        changes.update(&pairs, &world.ids).unwrap();
        outputs.push(Output {
            pairs: pairs.as_slice().to_vec(),
            begun: changes.begun().to_vec(),
            ended: changes.ended().to_vec(),
            all: changes.pairs().to_vec(),
        });
    }
    (outputs, ran)
}

#[test]
fn output_is_the_same_whatever_ran() {
    let parallel = if cfg!(feature = "parallel") { "grid-sap@cpu2" } else { "grid-sap@cpu1" };
    let courses: [&[(u32, &str)]; 3] = [
        &[(0, "brute@cpu1"), (150, "sap@cpu1")],
        &[(0, "pair-cache@cpu1")],
        &[(0, "grid-sap@cpu1"), (400, parallel), (700, "pair-cache@cpu1")],
    ];
    let first = run(PairOrder::Canonical, courses[0]);
    assert!(first.0.iter().filter(|o| !o.begun.is_empty() && !o.ended.is_empty()).count() > 80, "much begins and ends");
    assert!(first.0.iter().any(|o| o.pairs.len() > 300) && first.1.len() == 2, "{:?}", first.1);
    for course in &courses[1..] {
        let other = run(PairOrder::Canonical, course);
        assert!(first.1.is_disjoint(&other.1), "{:?} and {:?}", first.1, other.1);
        for (frame, (a, b)) in first.0.iter().zip(&other.0).enumerate() {
            assert!(a == b, "{course:?}, frame {frame}");
        }
    }
    // Without canonical order the pairs may come in another order, but not the lists of ids.
    for (frame, (a, b)) in first.0.iter().zip(run(PairOrder::Any, courses[2]).0).enumerate() {
        assert!((&a.begun, &a.ended, &a.all) == (&b.begun, &b.ended, &b.all), "in any order, frame {frame}");
    }
}
