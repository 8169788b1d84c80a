//! A user's algorithm: chosen by its cost, and corrected if the cost was wrong.

mod common;
#[path = "../examples/custom.rs"]
mod custom;

use common::naive;
use custom::{ID, cost, registry, tuning};
use sapwise::tuning::Term;
use sapwise::{Aabb, Adaptive, Body, BroadPhase, Error, PairOrder, Pairs, Reason, Registry, Space};
use sapwise_scenes::Scenario;
use std::time::Duration;

/// Boxes that rest after the first frame.
fn resting(count: usize) -> Vec<Aabb> {
    common::Random(9).cubes(count, [20.0; 3], 0.5)
}

fn run(adaptive: &mut Adaptive, boxes: &[Aabb]) -> (String, Reason) {
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    adaptive.find_pairs(boxes, &mut pairs).unwrap();
    assert!(pairs.as_slice() == naive(boxes));
    let decision = adaptive.last_decision().unwrap();
    (decision.algorithm.to_string(), decision.reason)
}

#[test]
fn users_algorithm_runs_when_cheapest() {
    let registry = registry("brute@cpu1");
    let costs = vec![
        cost(&registry, "brute@cpu1", &[(Term::Objects, 60.0)]),
        cost(&registry, ID, &[(Term::Objects, 2.0), (Term::Moved, 1e6)]),
    ];
    let mut adaptive = Adaptive::new(tuning(costs), &registry).unwrap();
    adaptive.set_learning(false);
    let mut scene = Scenario::Uniform.start(300, 1);
    for phase in 0..6 {
        let rests = phase % 2 == 1;
        let expected = if rests { ID } else { "brute@cpu1" };
        // The clock decides when `Adaptive` samples the boxes again.
        let seen = (0..100_000).any(|_| {
            if !rests {
                scene.advance();
            }
            run(&mut adaptive, scene.boxes()).0 == expected
        });
        assert!(seen, "phase {phase}");
    }
}

/// Brute force after a sleep. Two milliseconds are far more than 40 boxes take, so that noise can't reverse the order.
struct Sleeper(Box<dyn BroadPhase>, Duration);

impl BroadPhase for Sleeper {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        std::thread::sleep(self.1);
        self.0.find_pairs(boxes, pairs)
    }
}

/// Returns a registry with `slow@cpu1`, which sleeps, and `quick@cpu1`, which does not.
fn with_sleepers() -> Registry {
    let mut registry = Registry::with_cores(1);
    for (id, ms) in [("slow@cpu1", 2), ("quick@cpu1", 0)] {
        let brute = "brute@cpu1".parse().unwrap();
        let make = move || {
            let sleeper = Sleeper(Registry::with_cores(1).create(&brute)?, Duration::from_millis(ms));
            Ok(Box::new(sleeper) as Box<dyn BroadPhase>)
        };
        registry.add(id.parse().unwrap(), 1, make);
    }
    registry
}

fn calls(registry: &Registry, costs: &[(&str, f64)]) -> Adaptive {
    let costs = costs.iter().map(|&(id, ns)| cost(registry, id, &[(Term::Call, ns)])).collect();
    Adaptive::new(tuning(costs), registry).unwrap()
}

#[test]
fn algorithm_with_a_cost_far_too_low_is_left() {
    let registry = with_sleepers();
    let mut adaptive = calls(&registry, &[("quick@cpu1", 50_000.0), ("slow@cpu1", 10_000.0)]);
    let boxes = resting(40);
    let ran: Vec<String> = (0..300).map(|_| run(&mut adaptive, &boxes).0).collect();
    assert_eq!(ran[0], "slow@cpu1");
    let slow = |frames: &[String]| frames.iter().filter(|id| *id == "slow@cpu1").count();
    // Whether it is tried once more depends on what else runs on this machine.
    let (all, late) = (slow(&ran), slow(&ran[100..]));
    assert!(all < 100 && late <= 4, "{all} of 300 frames by the slow one, {late} of the last 200");
    // The learned tuning works like any other.
    let learned = adaptive.learned();
    let mut again = Adaptive::new(learned, &registry).unwrap();
    again.set_learning(false);
    assert_eq!(run(&mut again, &boxes).0, "quick@cpu1");
}

#[test]
fn algorithm_with_a_cost_too_high_is_tried_and_stays() {
    let mut adaptive = calls(&with_sleepers(), &[("slow@cpu1", 2_000_000.0), ("quick@cpu1", 2_010_000.0)]);
    let boxes = resting(40);
    assert_eq!(run(&mut adaptive, &boxes), ("slow@cpu1".to_owned(), Reason::First));
    // Usually in the first hundred frames. Later if other programs delay the sleeper, so that its cost is unclear for
    // longer.
    let tried = (0..3000).position(|_| run(&mut adaptive, &boxes).0 == "quick@cpu1");
    assert!(tried.is_some(), "in 3000 frames by the slow one the quick one was not tried");
    let quick = (0..300).filter(|_| run(&mut adaptive, &boxes).0 == "quick@cpu1").count();
    assert!(quick > 200, "{quick} of 300 frames by the quick one after it was tried in frame {tried:?}");
}

#[test]
fn frame_after_an_invalid_box_is_right() {
    let mut adaptive = Adaptive::only(ID.parse().unwrap(), &registry("brute@cpu1")).unwrap();
    let boxes = resting(100);
    let mut wrong = boxes.clone();
    wrong[7].max[2] = f32::NAN;
    for boxes in [&boxes, &wrong, &wrong, &boxes, &boxes] {
        let found = adaptive.find_pairs(boxes, &mut Pairs::new());
        if boxes[7].defect().is_some() {
            assert!(matches!(found, Err(Error::InvalidBox { index: 7, .. })), "{found:?}");
        } else {
            found.unwrap();
            assert_eq!(run(&mut adaptive, boxes).0, ID);
        }
    }
}

#[test]
fn clone_has_the_registry_the_tuning_and_what_was_learned() {
    let registry = with_sleepers();
    let mut space = Space::with(calls(&registry, &[("quick@cpu1", 50_000.0), ("slow@cpu1", 10_000.0)]));
    space.search_mut().set_exploring(false);
    space.insert_all(&resting(40), Body::kinematic()).unwrap();
    let ran = |space: &mut Space| {
        space.update().unwrap();
        space.search().last_decision().unwrap().algorithm.to_string()
    };
    let mut young = space.clone();
    assert_eq!(ran(&mut young), "slow@cpu1");
    assert!((0..300).any(|_| ran(&mut space) == "quick@cpu1"));
    let mut twin = space.clone();
    assert_eq!(twin.search().tuning(), space.search().tuning());
    assert_eq!(twin.search().learned().costs, space.search().learned().costs);
    // In its first frame it chooses by the number of objects, as it always does in a first frame of few boxes.
    ran(&mut twin);
    assert_eq!(ran(&mut twin), "quick@cpu1");
    // If the algorithm can't be made again, a frame reports that.
    let mut failing = Registry::with_cores(1);
    let made = std::sync::atomic::AtomicBool::new(false);
    failing.add("once@cpu1".parse().unwrap(), 1, move || {
        let again = made.swap(true, std::sync::atomic::Ordering::Relaxed);
        let brute = Registry::with_cores(1).create(&"brute@cpu1".parse().unwrap());
        if again { Err(Error::NoAlgorithm) } else { brute }
    });
    let once = Adaptive::only("once@cpu1".parse().unwrap(), &failing).unwrap();
    let boxes = resting(10);
    assert!(matches!(once.clone().find_pairs(&boxes, &mut Pairs::new()), Err(Error::Unavailable { .. })));
}
