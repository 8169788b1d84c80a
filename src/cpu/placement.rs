//! Pins threads, for callers who ask for that: one to each physical core before any has two, and to other cores in
//! each process.

use crate::mix;
use core_affinity::CoreId;
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// A logical CPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cpu {
    id: CoreId,
    /// The physical core: the lowest number of the CPUs that share it.
    physical: usize,
}

/// CPUs of all pools of this process so far. The next pool begins at the core behind them.
static HANDED_OUT: AtomicUsize = AtomicUsize::new(0);

/// The CPUs of a pool whose threads are pinned, one each.
///
/// A pool of helpers has one CPU more than helpers. A scheduler that wakes a pinned helper on the core of the caller
/// would make them take turns there while another core idles.
#[derive(Debug)]
pub(crate) struct CpuPlacement {
    cpus: Vec<Cpu>,
    /// The physical core of each CPU, by its number.
    physical: Vec<usize>,
    /// The CPU without a helper, as a position in `cpus`.
    free: AtomicUsize,
    /// The CPU on which the caller ran last, as the system numbers them.
    caller: AtomicUsize,
}

thread_local! {
    /// The CPU to which this thread is pinned, as a position in [`CpuPlacement::cpus`].
    static POSITION: Cell<usize> = const { Cell::new(0) };
}

/// Returns whether threads may be pinned: not under the CPU quota of a cgroup. A quota is for time on any CPU,
/// containers all begin with the same CPUs, and a pinned thread can't move away from a busy one.
pub(crate) fn may_pin() -> bool {
    // Linux: the least of affinity and quota, the quota rounded down.
    let allowed = std::thread::available_parallelism().map_or(usize::MAX, usize::from);
    cfg!(not(target_os = "linux")) || allowed >= core_affinity::get_core_ids().map_or(0, |cpus| cpus.len())
}

impl CpuPlacement {
    /// Chooses `count` CPUs. `None` if the calling thread may run on fewer, or if [threads must not be
    /// pinned](may_pin).
    pub(crate) fn choose(count: usize) -> Option<Self> {
        let usable = if may_pin() { usable() } else { Vec::new() };
        let first = (mix(number_of_process()) as usize).wrapping_add(HANDED_OUT.fetch_add(count, Relaxed));
        Self::among(&usable, count, first)
    }

    fn among(usable: &[Cpu], count: usize, first: usize) -> Option<Self> {
        if usable.len() < count {
            return None;
        }
        let mut physical: Vec<usize> = (0..=usable.iter().map(|cpu| cpu.id.id).max()?).collect();
        usable.iter().for_each(|cpu| physical[cpu.id.id] = cpu.physical);
        let cpus = spread(usable, count, first);
        Some(Self { cpus, physical, free: AtomicUsize::new(0), caller: AtomicUsize::new(usize::MAX) })
    }

    /// Pins this thread to the CPU at a position.
    pub(crate) fn pin(&self, position: usize) {
        // If the system refuses, the scheduler places the thread, as without pinning.
        core_affinity::set_for_current(self.cpus[position].id);
        POSITION.set(position);
    }

    /// Records the CPU of the caller.
    pub(crate) fn follow_caller(&self) {
        self.caller.store(current_cpu(), Relaxed);
    }

    /// Moves this helper to the free CPU if that one is farther from the caller than its own.
    pub(crate) fn make_way(&self) {
        let (own, free) = (POSITION.get(), self.free.load(Relaxed));
        if self.nearness(own) > self.nearness(free) && self.free.compare_exchange(free, own, Relaxed, Relaxed).is_ok() {
            self.pin(free);
        }
    }

    /// Returns 2 for the CPU of the caller, 1 for another one of the same physical core, 0 for the rest.
    fn nearness(&self, position: usize) -> u32 {
        let (cpu, caller) = (self.cpus[position], self.caller.load(Relaxed));
        match self.physical.get(caller) {
            _ if cpu.id.id == caller => 2,
            Some(&physical) if physical == cpu.physical => 1,
            _ => 0,
        }
    }
}

/// Returns `count` of the CPUs, one of each physical core before any has two, beginning with core number `first`,
/// cyclically.
fn spread(usable: &[Cpu], count: usize, first: usize) -> Vec<Cpu> {
    let mut cores: Vec<usize> = usable.iter().map(|cpu| cpu.physical).collect();
    cores.sort_unstable();
    cores.dedup();
    let mut ranked = Vec::new();
    for (k, core) in cores.iter().enumerate() {
        let turn = (k + cores.len() - first % cores.len()) % cores.len();
        let siblings = usable.iter().filter(|cpu| cpu.physical == *core);
        ranked.extend(siblings.enumerate().map(|(sibling, cpu)| ((sibling, turn), *cpu)));
    }
    ranked.sort_by_key(|(rank, _)| *rank);
    ranked.into_iter().take(count).map(|(_, cpu)| cpu).collect()
}

/// Returns the CPUs on which this thread may run.
fn usable() -> Vec<Cpu> {
    let cpu = |id: CoreId| {
        let siblings = format!("/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list", id.id);
        let siblings = std::fs::read_to_string(siblings).unwrap_or_default();
        Cpu { id, physical: first_number(&siblings).map_or(id.id, |first| first as usize) }
    };
    core_affinity::get_core_ids().unwrap_or_default().into_iter().map(cpu).collect()
}

/// Returns a number that differs from process to process.
fn number_of_process() -> u64 {
    // The first process of every container has the number 1. Containers differ in the number of their namespace.
    let namespace = std::fs::read_link("/proc/self/ns/pid").unwrap_or_default();
    u64::from(std::process::id()) + first_number(&namespace.to_string_lossy()).unwrap_or(0)
}

fn first_number(text: &str) -> Option<u64> {
    let digits = text.trim_start_matches(|c: char| !c.is_ascii_digit());
    digits.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// Returns the CPU on which this thread runs now, or a number that no CPU has if the system does not report it.
fn current_cpu() -> usize {
    #[cfg(target_os = "linux")]
    return rustix::thread::sched_getcpu();
    #[cfg(not(target_os = "linux"))]
    usize::MAX
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a machine of `cores` physical cores with two hyper-threads each: `k` and `k + cores`.
    fn machine(cores: usize) -> Vec<Cpu> {
        (0..2 * cores).map(|id| Cpu { id: CoreId { id }, physical: id % cores }).collect()
    }

    fn ids(cpus: &[Cpu]) -> Vec<usize> {
        cpus.iter().map(|cpu| cpu.id.id).collect()
    }

    #[test]
    fn each_physical_core_has_one_thread_before_any_has_two() {
        let four = machine(4);
        assert_eq!(ids(&spread(&four, 4, 0)), [0, 1, 2, 3]);
        assert_eq!(ids(&spread(&four, 6, 8)), [0, 1, 2, 3, 4, 5]);
        assert_eq!(ids(&spread(&four, 3, 2)), [2, 3, 0]);
        // Neighbours are siblings here, as on most Intel machines under Windows.
        let neighbours: Vec<Cpu> = (0..8).map(|id| Cpu { id: CoreId { id }, physical: id / 2 * 2 }).collect();
        assert_eq!(ids(&spread(&neighbours, 5, 1)), [2, 4, 6, 0, 3]);
        // A mask that leaves one of two siblings.
        assert_eq!(ids(&spread(&neighbours[1..4], 3, 0)), [1, 2, 3]);
        assert!(CpuPlacement::among(&four, 9, 0).is_none() && CpuPlacement::among(&[], 0, 0).is_none());
    }

    #[test]
    fn processes_spread_over_the_machine() {
        let machine = machine(64);
        for step in 1..40 {
            let mut threads = [0; 64];
            for server in 0..16 {
                let cpus = spread(&machine, 4, mix(31_415 + server * step) as usize);
                ids(&cpus).into_iter().for_each(|id| threads[id] += 1);
            }
            // 64 threads on 64 cores: if all processes began with the first core, four cores would have 16 each.
            let most = threads.iter().max().unwrap();
            assert!(*most <= 8, "process numbers in steps of {step}: {threads:?}");
        }
    }

    #[test]
    fn helper_makes_way_for_the_caller() {
        let placement = CpuPlacement::among(&machine(4), 3, 0).unwrap();
        let after = |position: usize, caller: usize| {
            std::thread::scope(|scope| {
                let moved = scope.spawn(|| {
                    POSITION.set(position);
                    placement.free.store(0, Relaxed);
                    placement.caller.store(caller, Relaxed);
                    placement.make_way();
                    (POSITION.get(), placement.free.load(Relaxed))
                });
                moved.join().unwrap()
            })
        };
        assert_eq!(after(1, 1), (0, 1), "it has the CPU of the caller");
        assert_eq!(after(1, 5), (0, 1), "it has the other half of the caller's core");
        assert_eq!((after(1, 2), after(1, 0), after(1, 4)), ((1, 0), (1, 0), (1, 0)), "it is not in the way");
        assert_eq!(after(1, usize::MAX), (1, 0), "nobody knows where the caller is");
    }

    #[test]
    fn first_numbers_of_sibling_lists_and_namespaces() {
        let texts = ["3,67\n", "0-1\n", "12", "pid:[4026531836]", "", "none"];
        assert_eq!(texts.map(first_number), [Some(3), Some(0), Some(12), Some(4_026_531_836), None, None]);
    }
}
