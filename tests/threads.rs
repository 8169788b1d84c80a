//! Which calls start helper threads: frames that need them, and nothing else.
//!
//! One test only, because it counts the threads of the process.
#![cfg(all(target_os = "linux", feature = "parallel"))]

use sapwise::rayon1::ThreadPoolBuilder;
use sapwise::{Aabb, Adaptive, Between, Body, Registry, Space, Tuning, Worlds};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Returns the number of threads whose names begin so.
fn threads(name: &str) -> usize {
    let tasks = std::fs::read_dir("/proc/self/task").unwrap();
    // A thread may end while the list is read.
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.unwrap().path().join("comm")).ok());
    names.filter(|of| of.starts_with(name)).count()
}

/// Returns a space of `count` bodies that will not rest.
fn space(registry: &Registry, count: usize) -> Space {
    let mut space = Space::with(Adaptive::new(Tuning::usual(registry), registry).unwrap());
    let row: Vec<Aabb> = (0..count).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.4)).collect();
    space.insert_all(&row, Body::default()).unwrap();
    space
}

/// Returns the algorithm that ran.
fn update(space: &mut Space) -> String {
    space.update().unwrap();
    space.search().last_decision().unwrap().algorithm.to_string()
}

#[test]
fn helpers_start_with_the_first_frame_that_needs_them() {
    let all = || threads("");
    let before = all();
    let registry = Registry::with_cores(3);
    let mut others = Space::new();
    others.insert(Aabb::cube([0.0; 3], 1.0), Body::default()).unwrap();
    others.update().unwrap();
    let algorithms: Vec<_> = registry.entries().iter().map(|entry| registry.create(&entry.id).unwrap()).collect();
    let lists = (Between::new(&registry), Worlds::new(&registry));
    let mut small = space(&registry, 1000);
    assert_eq!(update(&mut small), "pair-cache@cpu1");
    assert_eq!(all(), before);

    let mut large = space(&registry, 100_000);
    assert_eq!(update(&mut large), "pair-cache@cpu3");
    assert_eq!((all(), threads("sapwise-2-")), (before + 2, 2));
    // Clones, and other spaces of the same registry, run on the same threads.
    let mut clones: Vec<Space> = (0..8).map(|_| large.clone()).collect();
    clones.push(space(&registry.clone(), 100_000));
    clones.iter_mut().for_each(|clone| assert_eq!(update(clone), "pair-cache@cpu3"));
    assert_eq!(all(), before + 2);
    drop((registry, algorithms, lists, small, large));
    clones.truncate(1);
    assert_eq!(update(&mut clones[0]), "pair-cache@cpu3");
    drop(clones);
    // They end by themselves.
    let began = Instant::now();
    while all() > before && began.elapsed() < Duration::from_secs(60) {
        std::thread::yield_now();
    }
    assert_eq!(all(), before);

    // A clone of a space that runs on one thread, or on a program's pool, starts no helper either.
    let mut one = space(&Registry::with_cores(1), 100_000).clone();
    assert_eq!((update(&mut one), all()), ("pair-cache@cpu1".to_owned(), before));
    let mut registry = Registry::with_cores(8);
    registry.use_pool(Arc::new(ThreadPoolBuilder::new().num_threads(2).build().unwrap()));
    let mut given = space(&registry, 100_000).clone();
    assert_eq!((update(&mut given), all()), ("pair-cache@cpu3".to_owned(), before + 2));
}
