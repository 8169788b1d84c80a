//! Tests of whole replays.

use super::*;
use sapwise::{Aabb, AlgorithmId, BroadPhase, Error, Pairs, Reason, Registry, Step, Tuning};
use sapwise_scenes::{Frames, Scenario};

fn steps(list: &[(u32, &str)]) -> Tuning {
    let step = |&(from_objects, id): &(u32, &str)| Step { from_objects, algorithm: id.parse().unwrap() };
    Tuning::from_steps(list.iter().map(step).collect()).unwrap()
}

fn settings(scenario: Scenario, objects: usize, frames: usize, repeats: usize) -> ReplaySettings {
    let source = FrameSource::Scene { scenario, objects, seed: 1, swing: None };
    ReplaySettings { source, frames, repeats, seed: 1, learning: true, exploring: true, co_runner: None }
}

#[test]
fn a_replay_has_every_total_and_the_choice_of_every_frame() {
    let registry = Registry::with_cores(1);
    let tuning = steps(&[(0, "brute@cpu1"), (100, "grid-sap@cpu1")]);
    let outcome = replay(&settings(Scenario::Fragmentation, 800, 300, 3), &tuning, &registry).unwrap();
    let shape = (outcome.frames.len(), outcome.repeats.len(), outcome.fixed.len(), outcome.told.len());
    assert_eq!(shape, (300, 3, registry.available().len(), 300));
    assert!(outcome.best_fixed().is_some());
    assert!(!outcome.switches().is_empty());
    assert!(outcome.foreign_load.is_none_or(|load| (0.0..=1.0).contains(&load)));
    assert!(outcome.slowdown.is_none());
    for frame in &outcome.frames {
        assert!(frame.fixed_ns.iter().all(|ns| ns.is_finite()) && frame.adaptive_ns.is_finite());
        assert_eq!(frame.adaptive.len(), 3);
    }
    // Steps know no cost, so that every repeat decides alike, from the first frame on.
    assert!(outcome.repeats.iter().all(|r| *r == outcome.repeats[0] && r[0].chosen == Some(0)));
    assert!(outcome.repeats[0].iter().all(|t| t.chosen.is_some() && !t.explored));
    assert_eq!(outcome.told[0].reason, Reason::First);
}

#[test]
fn of_two_that_disagree_the_one_that_a_user_added_is_named() {
    struct NoPairs;
    impl BroadPhase for NoPairs {
        fn find_pairs(&mut self, _: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
            pairs.clear();
            pairs.finish()
        }
    }
    let mut registry = Registry::with_cores(1);
    registry.add("mine@cpu1".parse().unwrap(), 1, || Ok(Box::new(NoPairs)));
    // Each seed has another order of turns.
    for seed in 1..=8 {
        let settings = ReplaySettings { seed, ..settings(Scenario::Uniform, 2000, 1, 1) };
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
    assert!(outcome.last_taken().iter().all(|t| t.chosen.is_some()));
}

#[test]
fn an_algorithm_that_fails_is_not_run_again_and_is_noted_once() {
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
    let counts: Vec<usize> = outcome.frames.iter().map(|f| f.fixed[own].len()).collect();
    assert_eq!(counts, [1, 1, 0, 0]);
    assert_eq!(outcome.notes.len(), 1, "{:?}", outcome.notes);
    assert!(outcome.notes[0].contains("it was lost, at frame 2"), "{:?}", outcome.notes);
    assert_eq!(outcome.missed(own).map(|m| (m.first, m.frames)), Some((2, 2)));
}

#[test]
fn a_recorded_stream_runs_like_the_scene_that_it_was_recorded_from() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.npy");
    let scene = settings(Scenario::Fragmentation, 400, 80, 1);
    scene.source.record(&path, 80).unwrap();
    let source = FrameSource::Stream { name: "scene.npy".to_owned(), frames: Frames::read(&path).unwrap() };
    let (registry, tuning) = (Registry::with_cores(1), steps(&[(0, "brute@cpu1"), (60, "grid-sap@cpu1")]));
    let stream =
        replay(&ReplaySettings { source, ..settings(Scenario::Uniform, 0, 80, 1) }, &tuning, &registry).unwrap();
    let scene = replay(&scene, &tuning, &registry).unwrap();
    let objects = |o: &Outcome| o.frames.iter().map(|f| f.objects).collect::<Vec<_>>();
    assert_eq!(objects(&stream), objects(&scene));
    assert_eq!((&stream.repeats, stream.switches()), (&scene.repeats, scene.switches()));
}

#[test]
fn a_co_runner_begins_at_its_frame_and_its_work_is_told() {
    let co_runner = CoRunner { from_frame: 3, threads: Some(1) };
    let settings = ReplaySettings { co_runner: Some(co_runner), ..settings(Scenario::Uniform, 200, 6, 2) };
    let outcome = replay(&settings, &steps(&[(0, "brute@cpu1")]), &Registry::with_cores(1)).unwrap();
    let slowdown = outcome.slowdown.unwrap();
    assert_eq!(slowdown.co_runner, co_runner);
    assert!(slowdown.of_a_loop.is_some_and(|x| x > 0.0));
}
