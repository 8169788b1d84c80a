//! The types that threads may share, and the pinning of helper threads.

use sapwise::algorithm::Load;
use sapwise::{Adaptive, BroadPhase, Changes, Error, Pairs, Registry, Tuning};
use sapwise_tune::Model;

#[test]
fn public_types_are_send_and_sync() {
    fn both<T: Send + Sync + ?Sized>() {}
    both::<Adaptive>();
    both::<dyn BroadPhase>();
    both::<Registry>();
    both::<Pairs>();
    both::<Changes>();
    both::<Tuning>();
    both::<Model>();
    both::<Load>();
    both::<Error>();
}

/// Returns the number of CPUs on which a thread may run, from its `status` in `/proc`: a list such as `0-3,7`.
#[cfg(all(feature = "measure", target_os = "linux"))]
fn cpus(status: &str) -> usize {
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap().trim();
    let number = |text: &str| text.parse::<usize>().unwrap();
    list.split(',').map(|part| part.split_once('-').map_or(1, |(from, to)| number(to) - number(from) + 1)).sum()
}

/// Returns the number of helper threads, and the number of those that may run on one CPU only.
#[cfg(all(feature = "measure", target_os = "linux"))]
fn pool_threads() -> (usize, usize) {
    let status =
        |task: std::io::Result<std::fs::DirEntry>| std::fs::read_to_string(task.ok()?.path().join("status")).ok();
    let ours = std::fs::read_dir("/proc/self/task")
        .unwrap()
        .filter_map(status)
        .filter(|text| text.starts_with("Name:\tsapwise-"));
    let bound: Vec<bool> = ours.map(|text| cpus(&text) == 1).collect();
    (bound.len(), bound.iter().filter(|&&bound| bound).count())
}

#[cfg(all(feature = "measure", target_os = "linux"))]
#[test]
fn no_thread_is_pinned_unless_asked() {
    use sapwise::Aabb;
    use sapwise::algorithm::usable_cores;
    if usable_cores() < 2 {
        // Every thread runs on the one CPU.
        return;
    }
    let boxes: Vec<Aabb> = (0..20_000).map(|k| Aabb::cube([(k % 100) as f32, (k / 100) as f32, 0.0], 0.4)).collect();
    let run = |registry: &Registry, text: &str| {
        let mut algorithm = registry.create(&text.parse().unwrap()).unwrap();
        (0..20).for_each(|_| algorithm.find_pairs(&boxes, &mut Pairs::new()).unwrap());
        algorithm
    };
    let mut registry = Registry::with_cores(3);
    let free = run(&registry, "grid-sap@cpu3");
    assert_eq!(pool_threads(), (2, 0));
    registry.pin_threads();
    let pinned = run(&registry, "grid-sap@cpu2");
    // The one helper of `grid-sap@cpu2`. Under a CPU quota, which allows fewer cores than the affinity, none.
    let affinity = cpus(&std::fs::read_to_string("/proc/thread-self/status").unwrap());
    let bound = usize::from(usable_cores() as usize == affinity);
    assert_eq!(pool_threads(), (3, bound), "{affinity} CPUs");
    drop((free, pinned));
}
