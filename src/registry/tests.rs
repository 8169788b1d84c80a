use super::*;
use crate::adaptive::tests::{MadeUp, tuning_of_steps};
use crate::{Aabb, Pairs};

#[test]
fn thread_counts_double_up_to_all() {
    assert_eq!(thread_counts(1).collect::<Vec<_>>(), [1]);
    assert_eq!(thread_counts(2).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(thread_counts(6).collect::<Vec<_>>(), [1, 2, 4, 6]);
    assert_eq!(thread_counts(0).collect::<Vec<_>>(), [1]);
}

#[test]
fn user_adds_and_replaces_algorithms() {
    let mut registry = Registry::with_cores(1);
    let ours = registry.entries().len();
    let id: AlgorithmId = "my-tree@cpu1".parse().unwrap();
    for revision in [7, 8] {
        registry.add(id.clone(), revision, || Ok(Box::new(MadeUp(|| Ok(()), || {}))));
    }
    assert_eq!(registry.entries().len(), ours + 1);
    assert_eq!(registry.entries()[ours].revision, 8);
    assert!(registry.create(&id).is_ok());
}

#[test]
#[cfg(feature = "parallel")]
fn clock_stays_ignored_in_a_pool() {
    let mut registry = Registry::with_cores(1);
    registry.ignore_clock();
    registry.use_pool(Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap()));
    assert!(registry.threads.untimed);
}

#[test]
fn no_file_starts_more_threads_than_there_are_cores() {
    let registry = Registry::with_cores(3);
    for text in ["grid-sap@cpu4096", "brute@cpu4", "pair-cache@cpu4"] {
        let id: AlgorithmId = text.parse().unwrap();
        let Err(error) = registry.create(&id) else { panic!("made {text}") };
        if cfg!(feature = "parallel") {
            assert!(error.to_string().contains("but this machine has 3"), "{error}");
        }
        // Nor does a tuning of steps.
        let tuning = tuning_of_steps(&[(0, text), (20, "brute@cpu1")]);
        let mut adaptive = crate::Adaptive::new(tuning, &registry).unwrap();
        adaptive.find_pairs(&[Aabb::cube([0.0; 3], 1.0)], &mut Pairs::new()).unwrap();
        assert_eq!(adaptive.last_decision().unwrap().algorithm.to_string(), "brute@cpu1");
        assert!(crate::Adaptive::only(id, &registry).is_err());
    }
    if cfg!(feature = "parallel") {
        for text in ["grid-sap@cpu2", "brute@cpu3", "pair-cache@cpu3"] {
            assert!(registry.create(&text.parse().unwrap()).is_ok(), "{text}");
        }
    }
}

#[test]
fn unknown_algorithm_error_lists_the_known_ones() {
    let registry = Registry::with_cores(1);
    let Err(error) = registry.create(&"octree@cpu1".parse().unwrap()) else { panic!("made an unknown algorithm") };
    assert!(error.to_string().contains("brute@cpu1"), "{error}");
    assert!(registry.create(&"brute@gpu0".parse().unwrap()).is_err());
    assert!(registry.create(&"octree@gpu0".parse().unwrap()).is_err());
}

#[test]
#[cfg(feature = "parallel")]
fn refused_threads_are_an_error_of_the_frame() {
    use std::sync::atomic::Ordering::Relaxed;
    let registry = Registry::with_cores(3);
    let boxes: Vec<Aabb> = (0..5000).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.5)).collect();
    let tuning = tuning_of_steps(&[(0, "pair-cache@cpu1"), (2000, "pair-cache@cpu3")]);
    let mut adaptive = crate::Adaptive::new(tuning, &registry).unwrap();
    let ids = cpu::METHODS.iter().map(|method| AlgorithmId::cpu(method.name, 3));
    let made: Vec<_> = ids.map(|id| (registry.create(&id).unwrap(), id)).collect();
    let mut pairs = Pairs::new();
    registry.threads.helpers(2).refused.store(true, Relaxed);
    for (mut algorithm, id) in made {
        let Err(Error::Unavailable { algorithm, reason }) = algorithm.find_pairs(&boxes, &mut pairs) else {
            panic!("{id} ran on refused threads")
        };
        assert!(algorithm == id && matches!(reason, Unavailable::ThreadsRefused { threads: 2, .. }), "{reason}");
    }
    let mut ran = |adaptive: &mut crate::Adaptive| {
        adaptive.find_pairs(&boxes, &mut pairs).unwrap();
        assert_eq!(pairs.len(), 4999);
        adaptive.last_decision().unwrap().algorithm.to_string()
    };
    assert_eq!(ran(&mut adaptive), "pair-cache@cpu1");
    // The system is asked anew in each frame.
    registry.threads.helpers(2).refused.store(false, Relaxed);
    adaptive.revive(&registry).unwrap();
    assert_eq!(ran(&mut adaptive), "pair-cache@cpu3");
}
