mod learning;
mod seeds;
#[cfg(feature = "serde")]
mod traces;
mod warming;

use super::load_tracker::LoadTracker;
use super::*;
use crate::scene::{Scenario, Scene};
use crate::tuning::{AlgorithmCost, CostCurve, CostTerm, Term};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

fn tuning(costs: &[(&str, f64, f64)]) -> Tuning {
    tuning_of([Term::Call, Term::Objects], costs)
}

fn tuning_of(terms: [Term; 2], costs: &[(&str, f64, f64)]) -> Tuning {
    let costs = costs.iter().map(|&(id, first, second)| AlgorithmCost {
        algorithm: id.parse().unwrap(),
        revision: revision(id),
        curve: CostCurve::new(
            terms.into_iter().zip([first, second]).map(|(term, unit_ns)| CostTerm { term, unit_ns }).collect(),
        ),
        spread_ln: 0.0,
    });
    let loads: Vec<Load> = (0..16).map(|k| Load { objects: 1 << k, ..Load::default() }).collect();
    Tuning::from_costs(Source::Measured, "uniform", costs.collect(), &loads)
}

/// Returns a choice by made-up costs, which the times of frames do not correct.
fn fixed(tuning: Tuning) -> Adaptive {
    fixed_of(tuning, &Registry::with_cores(1))
}

fn fixed_of(tuning: Tuning, registry: &Registry) -> Adaptive {
    let mut adaptive = Adaptive::new(tuning, registry).unwrap();
    adaptive.set_learning(false);
    adaptive
}

/// Returns a tuning of hand-written steps.
pub(crate) fn tuning_of_steps(steps: &[(u32, &str)]) -> Tuning {
    Tuning::from_steps(steps.iter().map(|&(from, id)| Step::new(from, id.parse().unwrap())).collect()).unwrap()
}

/// Returns the revision of a built-in method on the CPU; 1 for any other.
fn revision(id: &str) -> u32 {
    let registry = Registry::with_cores(1);
    registry.entries().iter().find(|e| id.starts_with(&format!("{}@cpu", e.id.method()))).map_or(1, |e| e.revision)
}

fn row(count: usize) -> Vec<Aabb> {
    (0..count).map(|k| Aabb::cube([k as f32; 3], 0.5)).collect()
}

fn chosen(adaptive: &mut Adaptive, objects: usize) -> (String, Reason) {
    adaptive.find_pairs(&row(objects), &mut Pairs::new()).unwrap();
    let decision = adaptive.last_decision().unwrap();
    (decision.algorithm.to_string(), decision.reason)
}

#[test]
fn it_switches_at_the_border_and_not_within_the_hysteresis() {
    // 10 n = 1000 + 5 n at n = 200.
    let tuning = tuning(&[("brute@cpu1", 0.0, 10.0), ("grid-sap@cpu1", 1000.0, 5.0)]);
    let mut adaptive = fixed(tuning);
    let (brute, strips) = ("brute@cpu1".to_owned(), "grid-sap@cpu1".to_owned());
    assert_eq!(chosen(&mut adaptive, 100), (brute.clone(), Reason::First));
    assert_eq!(chosen(&mut adaptive, 150), (brute.clone(), Reason::Stayed));
    assert_eq!(chosen(&mut adaptive, 202), (brute.clone(), Reason::Hysteresis));
    assert_eq!(chosen(&mut adaptive, 300), (strips.clone(), Reason::Switched));
    assert_eq!(chosen(&mut adaptive, 198), (strips.clone(), Reason::Hysteresis));
    assert_eq!(chosen(&mut adaptive, 50), (brute, Reason::Switched));
    let decision = adaptive.last_decision().unwrap();
    assert!((decision.predicted_ns.unwrap() / 500.0 - 1.0).abs() < 1e-3);
    assert!((decision.runner_up.unwrap().1 / 1250.0 - 1.0).abs() < 1e-3);
    assert_eq!(decision.source, Source::Measured);
}

#[test]
fn hand_written_thresholds_decide_by_count() {
    let tuning = tuning_of_steps(&[(0, "brute@cpu1"), (64, "sap@cpu1"), (1000, "grid-sap@cpu1")]);
    let mut adaptive = Adaptive::new(tuning, &Registry::with_cores(1)).unwrap();
    assert_eq!(chosen(&mut adaptive, 10).0, "brute@cpu1");
    assert_eq!(chosen(&mut adaptive, 65), ("brute@cpu1".to_owned(), Reason::Hysteresis));
    assert_eq!(chosen(&mut adaptive, 90), ("sap@cpu1".to_owned(), Reason::Switched));
    assert_eq!(chosen(&mut adaptive, 10), ("brute@cpu1".to_owned(), Reason::Switched));
    // Near a border, but not one of brute force's.
    assert_eq!(chosen(&mut adaptive, 1000), ("grid-sap@cpu1".to_owned(), Reason::Switched));
}

#[test]
fn steps_whose_algorithm_has_no_cost_are_passed_over() {
    let [brute, octree, pair_cache] = ["brute@cpu1", "octree@cpu1", "pair-cache@cpu1"];
    let costs = tuning(&[(brute, 0.0, 10.0), (pair_cache, 1000.0, 5.0)]);
    for (steps, few, many) in
        [([brute, octree, pair_cache], brute, pair_cache), ([octree, pair_cache, brute], pair_cache, brute)]
    {
        let steps = tuning_of_steps(&[(0, steps[0]), (60, steps[1]), (200, steps[2])]).steps;
        let tuning = Tuning { steps, ..costs.clone() };
        for (objects, expected) in [(10, few), (100, few), (500, many)] {
            assert_eq!(chosen(&mut fixed(tuning.clone()), objects).0, expected, "{objects} objects");
        }
    }
}

/// An algorithm that finds no pair. It calls the first function in each frame, the second to get ready.
pub(crate) struct MadeUp<F, P>(pub(crate) F, pub(crate) P);

impl<F: FnMut() -> Result<(), Error> + Send + Sync, P: Fn() + Send + Sync> BroadPhase for MadeUp<F, P> {
    fn find_pairs(&mut self, _: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        self.0()?;
        pairs.finish()
    }

    fn prepare(&mut self, _: usize) {
        self.1();
    }
}

/// Makes an algorithm that runs for some frames, then fails like a lost GPU.
fn fragile(mut frames: u32) -> Result<Box<dyn BroadPhase>, Error> {
    let lost = || Error::Unavailable { algorithm: "fragile@gpu0".parse().unwrap(), reason: "lost".into() };
    let frame = move || {
        frames = frames.checked_sub(1).ok_or_else(lost)?;
        Ok(())
    };
    Ok(Box::new(MadeUp(frame, || {})))
}

/// Returns a frame that takes `ns` nanoseconds of the counted clock.
fn spends(ns: f64) -> impl FnMut() -> Result<(), Error> {
    move || {
        clock::counted::spend(ns);
        Ok(())
    }
}

#[test]
fn a_lost_algorithm_is_replaced_within_the_frame() {
    let mut registry = Registry::with_cores(1);
    registry.add("fragile@gpu0".parse().unwrap(), 1, || fragile(2));
    let tuning = tuning(&[("fragile@gpu0", 1.0, 0.0), ("brute@cpu1", 2.0, 1.0)]);
    let mut adaptive = Adaptive::new(tuning, &registry).unwrap();
    assert_eq!(chosen(&mut adaptive, 30).0, "fragile@gpu0");
    assert_eq!(chosen(&mut adaptive, 30).0, "fragile@gpu0");
    let mut pairs = Pairs::new();
    adaptive.find_pairs(&row(30), &mut pairs).unwrap();
    assert_eq!(pairs.len(), 29);
    assert_eq!(adaptive.last_decision().unwrap().reason, Reason::FellBack);
    assert_eq!(chosen(&mut adaptive, 30), ("brute@cpu1".to_owned(), Reason::Stayed));
}

/// Adds up the missed frames that were reported to it.
struct Told(Arc<AtomicU64>);

impl BroadPhase for Told {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        Aabb::check(boxes, 0)?;
        pairs.finish()
    }

    fn is_incremental(&self) -> bool {
        true
    }

    fn missed_frames(&mut self, frames: u64) {
        assert!(frames > 0);
        self.0.fetch_add(frames, Ordering::Relaxed);
    }
}

#[test]
fn frames_below_four_ticks_teach_nothing() {
    let learned = |ns: f64| {
        let mut registry = Registry::with_cores(1);
        registry.add("spends@cpu1".parse().unwrap(), 1, move || Ok(Box::new(MadeUp(spends(ns), || {}))));
        let mut adaptive = Adaptive::new(tuning(&[("spends@cpu1", 2e5, 0.0)]), &registry).unwrap();
        clock::counted::set_tick(Duration::from_micros(100));
        clock::counted::run(|| (0..50).for_each(|_| _ = chosen(&mut adaptive, 30)));
        clock::counted::set_tick(Duration::ZERO);
        (adaptive.last_decision().unwrap().measured_ns, adaptive.learned() != *adaptive.tuning())
    };
    assert_eq!(learned(399_000.0), (None, false));
    assert_eq!(learned(401_000.0), (Some(401_000.0), true));
}

#[test]
fn one_that_keeps_work_is_told_how_many_frames_it_missed() {
    let told = Arc::new(AtomicU64::new(0));
    let mut registry = Registry::with_cores(1);
    let shared = Arc::clone(&told);
    registry.add("told@cpu1".parse().unwrap(), 1, move || Ok(Box::new(Told(Arc::clone(&shared)))));
    let mut adaptive = fixed_of(tuning(&[("told@cpu1", 1000.0, 0.0), ("brute@cpu1", 0.0, 10.0)]), &registry);
    // In the first 50 frames it has not run yet, and has missed none.
    for objects in [10, 1000, 10, 1000, 1000, 10, 1000] {
        (0..50).for_each(|_| _ = chosen(&mut adaptive, objects));
    }
    assert_eq!(told.load(Ordering::Relaxed), 100);
    // Missed frames are reported before a frame that fails, and not again before the next one.
    (0..50).for_each(|_| _ = chosen(&mut adaptive, 10));
    let mut boxes = row(1000);
    boxes[999].min[0] = f32::NAN;
    for _ in 0..3 {
        let error = adaptive.find_pairs(&boxes, &mut Pairs::new()).unwrap_err();
        assert!(matches!(error, Error::InvalidBox { index: 999, .. }), "{error}");
        assert_eq!(told.load(Ordering::Relaxed), 150);
    }
    assert_eq!(chosen(&mut adaptive, 1000).0, "told@cpu1");
    assert_eq!(told.load(Ordering::Relaxed), 150);
}

#[test]
fn unknown_algorithms_are_skipped_and_none_at_all_is_an_error() {
    let registry = Registry::with_cores(1);
    let mixed = tuning(&[("octree@cpu1", 0.0, 0.1), ("brute@cpu1", 0.0, 1.0)]);
    assert_eq!(chosen(&mut Adaptive::new(mixed, &registry).unwrap(), 20).0, "brute@cpu1");
    assert!(Adaptive::new(tuning(&[("octree@cpu1", 0.0, 0.1)]), &registry).is_err());
}

/// Returns the algorithm and the estimate of `moved` in each frame of a scene.
fn course(adaptive: &mut Adaptive, scenario: Scenario, frames: usize) -> Vec<(String, f64)> {
    let mut scene = Scene::start(scenario, 2000, 1);
    let mut pairs = Pairs::new();
    let frame = |_| {
        adaptive.find_pairs(scene.boxes(), &mut pairs).unwrap();
        scene.advance();
        let decision = adaptive.last_decision().unwrap();
        (decision.algorithm.to_string(), decision.load.moved)
    };
    (0..frames).map(frame).collect()
}

/// Returns a choice between costs of 40 n and 15 n + 100 n moved.
fn grid_sap_or_pair_cache() -> Adaptive {
    let tuning =
        tuning_of([Term::Objects, Term::Moved], &[("grid-sap@cpu1", 40.0, 0.0), ("pair-cache@cpu1", 15.0, 100.0)]);
    fixed(tuning)
}

#[test]
fn from_the_second_frame_on_it_knows_how_far_boxes_move() {
    // Each look watches 64 other boxes, and how many looks there are depends on the clock.
    for (scenario, algorithm, least, most) in [
        (Scenario::Uniform, "pair-cache@cpu1", 0.025, 0.055),
        (Scenario::Resting, "pair-cache@cpu1", 0.0, 0.01),
        (Scenario::Fast, "grid-sap@cpu1", 0.8, 1.0),
    ] {
        let course = course(&mut grid_sap_or_pair_cache(), scenario, 70);
        assert_eq!(course[0].1, 1.0, "{scenario}");
        for (k, (chosen, moved)) in course.iter().enumerate().skip(1) {
            assert!((least..=most).contains(moved), "{scenario}: {moved}");
            // The first frame of `pair-cache` has paid for itself by then.
            assert!(k < 3 || chosen == algorithm, "{scenario}, frame {k}: {chosen}");
        }
    }
}

/// Returns the number of samples until an algorithm runs. The number of frames between two samples depends on the
/// clock.
fn samples_until(adaptive: &mut Adaptive, scene: &mut Scene, algorithm: &str) -> u32 {
    let mut pairs = Pairs::new();
    let mut samples = 0;
    // An interrupted sample delays the next ones. The limit ends the loop if the algorithm is never chosen.
    for _ in 0..1_000_000 {
        adaptive.find_pairs(scene.boxes(), &mut pairs).unwrap();
        scene.advance();
        samples += u32::from(adaptive.runner.tracker.age == 1);
        if adaptive.last_decision().unwrap().algorithm.to_string() == algorithm {
            return samples;
        }
    }
    panic!("{algorithm} was not chosen after {samples} samples");
}

#[test]
fn a_change_of_how_far_boxes_move_is_seen_within_two_samples() {
    let mut adaptive = grid_sap_or_pair_cache();
    assert_eq!(course(&mut adaptive, Scenario::Uniform, 50)[49].0, "pair-cache@cpu1");
    assert!(samples_until(&mut adaptive, &mut Scene::start(Scenario::Fast, 2000, 1), "grid-sap@cpu1") <= 2);
    // Another number of boxes is sampled soon, and the motion is known one frame later.
    assert!(samples_until(&mut adaptive, &mut Scene::start(Scenario::Resting, 500, 1), "pair-cache@cpu1") <= 2);
    assert!(adaptive.last_decision().unwrap().load.moved <= 0.01);
}

/// Returns a row of boxes, shifted by `by` along each axis.
fn shifted(by: f32) -> Vec<Aabb> {
    row(500).iter().map(|b| Aabb::new(b.min.map(|x| x + by), b.max.map(|x| x + by))).collect()
}

#[test]
fn a_frame_that_stands_out_is_compared_with_the_one_before_it() {
    let at = |k: u32| shifted(0.25 * k as f32);
    let mut tracker = LoadTracker::default();
    tracker.update(&at(0));
    tracker.ran(&at(0), 100);
    // A frame without a decision.
    tracker.ran(&at(1), 100);
    tracker.update(&at(2));
    let moved = tracker.motion.unwrap().moved;
    assert!((moved - 0.25).abs() < 0.01, "{moved}");
}

#[test]
fn deciding_before_a_frame_does_not_make_it_look_at_rest() {
    let mut adaptive = grid_sap_or_pair_cache();
    let mut scene = Scene::start(Scenario::Fast, 2000, 1);
    for _ in 0..70 {
        adaptive.decide(scene.boxes());
        adaptive.find_pairs(scene.boxes(), &mut Pairs::new()).unwrap();
        assert!(adaptive.last_decision().unwrap().load.moved > 0.8);
        scene.advance();
    }
}

#[test]
fn it_is_incremental_when_any_of_its_algorithms_is() {
    assert!(grid_sap_or_pair_cache().is_incremental());
    let without = tuning(&[("grid-sap@cpu1", 1.0, 1.0), ("brute@cpu1", 1.0, 2.0)]);
    assert!(!Adaptive::new(without, &Registry::with_cores(1)).unwrap().is_incremental());
}
