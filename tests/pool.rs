//! Algorithms on several threads of a program's own pool, called from outside the pool and from within.

mod common;

use common::{Random, naive};
use sapwise::algorithm::Backend;
use sapwise::rayon1::{self as rayon, ThreadPool, ThreadPoolBuilder};
use sapwise::{Aabb, Adaptive, AlgorithmId, BroadPhase, Error, PairOrder, Pairs, Registry, Tuning};
use sapwise_scenes::Scenario;
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

/// Fails instead of hanging. The time is thousands of times what this takes; under ThreadSanitizer it takes a minute.
fn ends(test: impl FnOnce() + Send + 'static) {
    let (done, end) = mpsc::channel();
    let thread = std::thread::spawn(move || {
        // Dropped by a panic too.
        let _done: mpsc::Sender<()> = done;
        test();
    });
    assert_ne!(end.recv_timeout(Duration::from_secs(900)), Err(mpsc::RecvTimeoutError::Timeout), "it hangs");
    thread.join().unwrap();
}

/// Occupies every thread of the pool until the returned gates are dropped.
fn occupied(pool: &ThreadPool) -> Vec<mpsc::Sender<()>> {
    let (came, here) = mpsc::channel();
    let occupy = |_| {
        let (came, (open, gate)) = (came.clone(), mpsc::channel());
        pool.spawn(move || {
            came.send(()).unwrap();
            let _ = gate.recv();
        });
        open
    };
    let gates: Vec<_> = (0..pool.current_num_threads()).map(occupy).collect();
    gates.iter().for_each(|_| here.recv().unwrap());
    gates
}

fn pool(threads: usize) -> Arc<ThreadPool> {
    Arc::new(ThreadPoolBuilder::new().num_threads(threads).build().unwrap())
}

fn registry(cores: u32, pool: &Arc<ThreadPool>) -> Registry {
    let mut registry = Registry::with_cores(cores);
    registry.use_pool(Arc::clone(pool));
    registry
}

/// Returns every algorithm on every number of threads that the pool allows.
fn every_algorithm(registry: &Registry, most: u32) -> Vec<(AlgorithmId, Box<dyn BroadPhase>)> {
    let mut methods: Vec<&str> = registry.entries().iter().map(|e| e.id.method()).collect();
    methods.dedup();
    let ids = methods.iter().flat_map(|m| (1..=most).map(|k| AlgorithmId::new(m, Backend::Cpu(k)).unwrap()));
    ids.map(|id| (id.clone(), registry.create(&id).unwrap())).collect()
}

/// Returns scenes with enough boxes for every phase to have tasks for all threads.
fn scenes() -> Vec<(&'static str, Vec<Aabb>)> {
    let clustered = Scenario::Clustered.start(6000, 1).boxes().to_vec();
    vec![
        ("nothing", Vec::new()),
        ("one box", vec![Aabb::cube([0.0; 3], 1.0)]),
        ("cubes", Random(3).cubes(6000, [32.0; 3], 0.5)),
        ("clusters", clustered),
    ]
}

#[test]
fn every_algorithm_is_right_in_a_programs_pool() {
    let scenes: Vec<_> = scenes().into_iter().map(|(name, boxes)| (name, naive(&boxes), boxes)).collect();
    for threads in [1, 2, 4] {
        let pool = pool(threads);
        let registry = registry(64, &pool);
        let other = self::pool(2);
        for (id, mut algorithm) in every_algorithm(&registry, threads as u32 + 1) {
            for (name, expected, boxes) in &scenes {
                let mut pairs = Pairs::with_order(PairOrder::Canonical);
                let mut run = |place: &str| {
                    algorithm.find_pairs(boxes, &mut pairs).unwrap();
                    assert!(pairs.as_slice() == expected, "{id} {place} a pool of {threads} on {name}");
                };
                run("outside");
                pool.install(|| run("in"));
                pool.scope(|scope| scope.spawn(|_| run("in a job of")));
                other.install(|| run("in another pool than"));
                run("outside, after it,");
            }
        }
    }
}

/// More frames at once than threads: each waits for helpers that run a frame themselves.
#[test]
fn frames_in_every_thread_of_the_pool_end() {
    let pool = pool(2);
    let registry = registry(8, &pool);
    let boxes = Random(5).cubes(3000, [25.0; 3], 0.5);
    let expected = naive(&boxes);
    let mut algorithms = every_algorithm(&registry, 3);
    for _ in 0..5 {
        pool.scope(|scope| {
            for (id, algorithm) in &mut algorithms {
                let (boxes, expected) = (&boxes, &expected);
                scope.spawn(move |_| {
                    let mut pairs = Pairs::with_order(PairOrder::Canonical);
                    algorithm.find_pairs(boxes, &mut pairs).unwrap();
                    assert!(pairs.as_slice() == expected, "{id}");
                });
            }
        });
    }
}

/// A rayon worker calls while it holds a lock, and a job that wants the lock is next in its queue: to run other jobs
/// while waiting would deadlock.
#[test]
fn worker_that_holds_a_lock_runs_no_other_job() {
    ends(|| {
        let pool = pool(2);
        // With own helpers and with those of the pool.
        for registry in [Registry::with_cores(7), registry(3, &pool)] {
            let boxes = Random(7).cubes(12_000, [50.0; 3], 0.5);
            let most = registry.available().iter().map(|e| e.id.threads()).max().unwrap();
            for (_, mut algorithm) in every_algorithm(&registry, most) {
                let lock = Arc::new(Mutex::new(0));
                let mut pairs = Pairs::new();
                pool.install(|| {
                    for frame in 0..8 {
                        let mut held = lock.lock().unwrap();
                        let wants = Arc::clone(&lock);
                        rayon::spawn(move || *wants.lock().unwrap() += 1);
                        algorithm.find_pairs(&boxes, &mut pairs).unwrap();
                        *held += 1;
                        assert!(*held > frame);
                    }
                });
            }
        }
    });
}

#[test]
fn frames_end_beside_a_busy_pool() {
    ends(|| {
        let pool = pool(2);
        let registry = registry(8, &pool);
        let boxes = Random(9).cubes(12_000, [50.0; 3], 0.5);
        let expected = naive(&boxes);
        let gates = occupied(&pool);
        for (id, mut algorithm) in every_algorithm(&registry, 3) {
            let mut pairs = Pairs::with_order(PairOrder::Canonical);
            for _ in 0..3 {
                algorithm.find_pairs(&boxes, &mut pairs).unwrap();
                assert!(pairs.as_slice() == expected, "{id}");
            }
        }
        drop(gates);
    });
}

/// More callers than threads, on their own threads and in the pool.
#[test]
fn many_callers_share_a_pool() {
    ends(|| {
        let pool = pool(3);
        let registry = registry(4, &pool);
        let boxes = Random(13).cubes(8000, [45.0; 3], 0.5);
        let expected = naive(&boxes);
        let run = |inside: bool| {
            let mut algorithm = registry.create(&"grid-sap@cpu4".parse().unwrap()).unwrap();
            let mut pairs = Pairs::with_order(PairOrder::Canonical);
            for _ in 0..20 {
                let mut frame = || algorithm.find_pairs(&boxes, &mut pairs).unwrap();
                if inside {
                    pool.install(frame);
                } else {
                    frame();
                }
                assert!(pairs.as_slice() == expected);
            }
        };
        std::thread::scope(|scope| {
            for caller in 0..12 {
                let run = &run;
                scope.spawn(move || run(caller % 2 == 0));
            }
        });
    });
}

#[test]
fn more_threads_than_the_pool_has_are_unavailable() {
    let pool = pool(4);
    let mut registry = registry(8, &pool);
    let counts = |registry: &Registry, available: bool| -> Vec<u32> {
        let of_brute =
            registry.entries().iter().filter(|e| e.id.method() == "brute" && e.unavailable.is_none() == available);
        of_brute.map(|e| e.id.threads()).collect()
    };
    // The list has all numbers of threads, as without a pool.
    assert_eq!((counts(&registry, true), counts(&registry, false)), (vec![1, 2, 4, 5], vec![8]));
    for text in ["brute@cpu8", "pair-cache@cpu6"] {
        let Err(Error::Unavailable { reason, .. }) = registry.create(&text.parse().unwrap()) else {
            panic!("made {text}")
        };
        assert!(reason.to_string().contains("more than the 4 threads of the given pool"), "{reason}");
    }
    registry.use_pool(self::pool(1));
    assert_eq!((counts(&registry, true), counts(&registry, false)), (vec![1, 2], vec![4, 5, 8]));
    registry.use_pool(self::pool(30));
    assert_eq!(counts(&registry, true), [1, 2, 4, 5, 8]);
    // On a machine with one core a pool adds nothing.
    assert_eq!(counts(&self::registry(1, &pool), true), [1]);
}

#[test]
fn adaptive_keeps_to_the_pool() {
    let pool = pool(2);
    let registry = registry(8, &pool);
    let mut adaptive = Adaptive::new(Tuning::usual(&registry), &registry).unwrap();
    let boxes = Random(11).cubes(23_000, [62.0; 3], 0.5);
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    pool.install(|| adaptive.find_pairs(&boxes, &mut pairs)).unwrap();
    assert!(pairs.as_slice() == naive(&boxes));
    assert_eq!(adaptive.last_decision().unwrap().algorithm.to_string(), "pair-cache@cpu3");
    // The pool outlives its users.
    drop((adaptive, registry));
    assert_eq!(pool.install(rayon::current_num_threads), 2);
}
