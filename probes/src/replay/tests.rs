//! Tests of whole replays.

use super::*;
use crate::algorithms::tests::Nothing;
use sapwise::tuning::Step;
use sapwise::{Aabb, AlgorithmId, BroadPhase, Error, Pairs, Reason, Registry, Tuning};
use sapwise_scenes::Scenario;

fn steps(list: &[(u32, &str)]) -> Tuning {
    let step = |&(from_objects, id): &(u32, &str)| Step { from_objects, algorithm: id.parse().unwrap() };
    Tuning::from_steps(list.iter().map(step).collect()).unwrap()
}

fn settings(scenario: Scenario, objects: usize, frames: usize, repeats: usize) -> ReplaySettings {
    let source = FrameSource::Scene { scenario, objects, seed: 1, swing: None };
    ReplaySettings { source, frames, repeats, seed: 1, learning: true }
}

#[test]
fn a_replay_has_all_times_and_the_choice_of_every_frame() {
    let registry = Registry::with_cores(1);
    let tuning = steps(&[(0, "brute@cpu1"), (100, "grid-sap@cpu1")]);
    let outcome = replay(&settings(Scenario::Fragmentation, 800, 120, 2), &tuning, &registry).unwrap();
    let shape = (outcome.frames.len(), outcome.repeats, outcome.fixed.len(), outcome.choices.len());
    assert_eq!(shape, (120, 2, registry.available().len(), 120));
    assert!(outcome.best_fixed().is_some() && !outcome.switches().is_empty());
    for frame in &outcome.frames {
        let ns = frame.fixed_ns.iter().chain([&frame.adaptive_ns, &frame.windows_ns]);
        assert!(ns.copied().all(f64::is_finite), "{frame:?}");
    }
    assert_eq!((outcome.choices[0].chosen, outcome.choices[0].reason), (Some(0), Reason::First));
    assert!(outcome.choices.iter().all(|c| c.chosen.is_some() && !c.explored()));
}

#[test]
fn of_two_that_disagree_the_one_that_a_user_added_is_named() {
    let mut registry = Registry::with_cores(1);
    registry.add("mine@cpu1".parse().unwrap(), 1, || Ok(Box::new(Nothing)));
    // Each seed has another order of turns.
    for seed in 1..=4 {
        let settings = ReplaySettings { seed, ..settings(Scenario::Uniform, 300, 1, 1) };
        let Err(error) = replay(&settings, &steps(&[(0, "brute@cpu1")]), &registry) else { panic!("took no pairs") };
        assert!(error.to_string().starts_with("mine@cpu1 returns other pairs than brute@cpu1"), "{error}");
    }
}

#[test]
fn an_algorithm_that_only_the_tuning_names_is_among_the_fixed() {
    let registry = Registry::with_cores(4);
    let id: AlgorithmId = "grid-sap@cpu3".parse().unwrap();
    if registry.create(&id).is_err() {
        return;
    }
    let outcome = replay(&settings(Scenario::Uniform, 50, 2, 1), &steps(&[(0, "grid-sap@cpu3")]), &registry).unwrap();
    assert_eq!(outcome.fixed.last(), Some(&id));
    assert!(outcome.choices.iter().all(|c| c.chosen.is_some()));
}

#[test]
fn an_algorithm_that_fails_is_noted_once_and_has_no_total() {
    /// Fails in its third frame.
    struct Failing(u32);
    impl BroadPhase for Failing {
        fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
            self.0 += 1;
            if self.0 > 2 {
                let algorithm = "mine@cpu1".parse().unwrap();
                return Err(Error::Unavailable { algorithm, reason: "it was lost".into() });
            }
            Registry::with_cores(1).create(&"brute@cpu1".parse().unwrap())?.find_pairs(boxes, pairs)
        }
    }
    let mut registry = Registry::with_cores(1);
    registry.add("mine@cpu1".parse().unwrap(), 1, || Ok(Box::new(Failing(0))));
    let outcome = replay(&settings(Scenario::Uniform, 100, 4, 2), &steps(&[(0, "brute@cpu1")]), &registry).unwrap();
    let own = outcome.fixed.iter().position(|id| id.method() == "mine").unwrap();
    assert_eq!(outcome.fixed_times(own), Err(2));
    assert_eq!(outcome.notes.len(), 1, "{:?}", outcome.notes);
    assert!(outcome.notes[0].contains("it was lost, at frame 2"), "{:?}", outcome.notes);
}
