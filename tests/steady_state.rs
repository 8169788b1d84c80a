//! In a steady state nothing allocates: no algorithm, no choice between them, no filter that changes, no `Changes`.
//!
//! One test only, because the counter sees every thread of the process.

mod common;
#[path = "common/counting.rs"]
mod counting;

use common::tuning;
use counting::{ALLOCATIONS, LARGE};
use sapwise::{Aabb, Adaptive, BroadPhase, Changes, Error, Filter, Membership, PairOrder, Pairs, Registry};
use sapwise_scenes::Scenario;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Returns the number of allocations, and of large ones, of `run` in `frames` frames of a scene, after `rounds` of the
/// same frames: `pair-cache` settles its margin in seven of them, and its memory depends on the margin.
///
/// `extras` adds canonical order, a filter that changes in each frame, and `Changes` by ids of which two are swapped.
fn allocations(
    scenario: Scenario,
    objects: usize,
    frames: usize,
    rounds: usize,
    run: &mut dyn BroadPhase,
    extras: bool,
) -> (usize, usize) {
    let mut pairs = Pairs::with_order(if extras { PairOrder::Canonical } else { PairOrder::Any });
    let membership = |k: usize| Membership {
        groups: 1 << (k % 5),
        mask: !(1 << (k % 7)),
        fixed: k.is_multiple_of(11),
        owner: (k % 3) as u32,
    };
    let mut changes = Changes::new();
    let (mut counted, mut large) = (0, 0);
    for round in 0..=rounds {
        let mut scene = scenario.start(objects, 1);
        pairs.set_filter(extras.then(|| Filter::new((0..objects).map(membership).collect())));
        let mut ids: Vec<u64> = (0..objects as u64).map(|k| k * 37 % 4096).collect();
        for _ in 0..frames {
            scene.advance();
            let before = (ALLOCATIONS.load(Relaxed), LARGE.load(Relaxed));
            if let Some(filter) = pairs.filter_mut() {
                filter.memberships.rotate_left(1);
                ids.swap(scene.frame() as usize, objects - 1);
            }
            run.find_pairs(scene.boxes(), &mut pairs).unwrap();
            if extras {
                changes.update(&pairs, &ids).unwrap();
            }
            if round == rounds {
                counted += ALLOCATIONS.load(Relaxed) - before.0;
                large += LARGE.load(Relaxed) - before.1;
            }
        }
    }
    (counted, large)
}

#[test]
fn steady_state_allocates_nothing() {
    const FRAMES: usize = 40;
    let mut registry = Registry::with_cores(4);
    // By the clock an algorithm may take another way through a frame late in the run, and grows its memory then.
    registry.ignore_clock();
    for id in registry.available().into_iter().map(|e| e.id) {
        let mut algorithm = registry.create(&id).unwrap();
        let rounds = if id.method() == "pair-cache" { 7 } else { 2 };
        for scenario in [Scenario::Uniform, Scenario::Mixed, Scenario::Gravity, Scenario::Fragmentation] {
            // Each algorithm runs with and without extras.
            let extras = matches!(scenario, Scenario::Mixed | Scenario::Gravity);
            // Fewer would not keep four threads busy.
            let objects = if id.threads() > 2 { 4096 } else { 3000 };
            let (counted, large) = allocations(scenario, objects, FRAMES, rounds, algorithm.as_mut(), extras);
            // rayon allocates a job of about 100 bytes for each helper in each phase, and sometimes a block of its
            // queue.
            let phases = match id.method() {
                "brute" => 4,
                "grid-sap" => 3,
                "sap" => 6,
                _ => 12,
            };
            // Sorting many pairs takes four more phases.
            let phases = if extras { phases + 4 } else { phases };
            let jobs = FRAMES * (id.threads() as usize - 1) * phases;
            assert!(counted <= jobs + jobs / 32, "{id} on {scenario}: {counted} allocations in {FRAMES} frames");
            assert_eq!(large, 0, "{id} on {scenario}");
        }
    }
    for extras in [false, true] {
        // With learning, measured times could select an algorithm that has not run so large a frame yet.
        // `fragmentation` passes its crossovers: 60 n = 5000 + 30 n at 167, 5000 + 30 n = 30 000 + 10 n at 1250.
        let costs = [("brute@cpu1", 0.0, 60.0), ("sap@cpu1", 5_000.0, 30.0), ("grid-sap@cpu1", 30_000.0, 10.0)];
        let mut adaptive = Adaptive::new(tuning(registry.entries(), 0.0, &costs), &registry).unwrap();
        adaptive.set_learning(false);
        // The clock decides when to switch, so the first frame of an algorithm may be its largest.
        adaptive.prepare(3000);
        let (counted, _) = allocations(Scenario::Fragmentation, 3000, 600, 7, &mut adaptive, extras);
        assert_eq!(counted, 0, "adaptive, switches included, extras: {extras}");
    }
    let (mut adaptive, switched) = idle_candidates();
    let (counted, _) = allocations(Scenario::Fragmentation, 300, 600, 7, &mut adaptive, false);
    assert_eq!(counted, 0, "learning, switching and exploring");
    assert!(switched.load(Relaxed) > 10, "they took {} turns", switched.load(Relaxed));
}

/// Returns an `Adaptive` that learns, over algorithms that allocate nothing and whose speed changes, and the number of
/// switches.
fn idle_candidates() -> (Adaptive, Arc<AtomicUsize>) {
    struct Idle(usize, Arc<[AtomicUsize; 2]>, Arc<AtomicUsize>, u64);
    impl BroadPhase for Idle {
        fn find_pairs(&mut self, _: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
            self.2.fetch_add(usize::from(self.1[0].swap(self.0, Relaxed) != self.0), Relaxed);
            // Each is slow for a while in turn.
            let frame = self.1[1].fetch_add(1, Relaxed);
            for k in 0..if frame / 100 % 4 == self.0 { 40_000 } else { 10_000 } {
                self.3 = std::hint::black_box(self.3.wrapping_mul(k | 1));
            }
            pairs.clear();
            pairs.finish()
        }
    }
    let mut registry = Registry::with_cores(1);
    let (shared, turns) = (Arc::new([const { AtomicUsize::new(0) }; 2]), Arc::new(AtomicUsize::new(0)));
    let ids = ["idle-0@cpu1", "idle-1@cpu1", "idle-2@cpu1", "idle-3@cpu1"];
    for (k, id) in ids.iter().enumerate() {
        let (shared, turns) = (Arc::clone(&shared), Arc::clone(&turns));
        registry.add(id.parse().unwrap(), 1, move || Ok(Box::new(Idle(k, Arc::clone(&shared), Arc::clone(&turns), 3))));
    }
    let tuning = tuning(registry.entries(), 0.1, &ids.map(|id| (id, 10_000.0, 0.0)));
    (Adaptive::new(tuning, &registry).unwrap(), turns)
}
