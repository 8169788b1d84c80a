//! Where threads are bound, for those who ask for that: on one logical CPU of each physical core first, and in each process and pool on others.

use crate::cgroup;
use crate::splitmix::mix;
use core_affinity::CoreId;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A logical CPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cpu {
    id: CoreId,
    /// The physical core that it is a hyper-thread of, as the lowest number of those that share it.
    physical: usize,
}

/// How many pools have a seat on a CPU, by its number.
type Ledger = Mutex<BTreeMap<usize, u32>>;

/// The seats of all pools of this process. Where threads are bound is a thing of the process: each pool by itself would take the same seats.
static TAKEN: Ledger = Mutex::new(BTreeMap::new());

/// CPUs for the threads of a pool that are bound to one each. Given back when this is dropped.
///
/// A pool of helpers has one more than helpers. A scheduler that wakes a bound helper on the core of the caller would have them take turns
/// there while another core idles.
#[derive(Debug)]
pub(crate) struct Seats {
    cpus: Vec<Cpu>,
    /// The physical core of each CPU, by its number.
    physical: Vec<usize>,
    /// The CPU to which no helper is bound, as a position in `cpus`.
    free: AtomicUsize,
    /// The CPU on which the caller last ran, as the system counts them.
    caller: AtomicUsize,
    ledger: &'static Ledger,
}

thread_local! {
    /// The CPU to which this thread is bound, as a position in [`Seats::cpus`].
    static SEAT: Cell<usize> = const { Cell::new(0) };
}

/// Whether threads may be bound. Not under a quota: it is for time on any CPU, containers all begin with the same, and a bound thread can't
/// move away from where another one is.
pub(crate) fn may_bind() -> bool {
    !cgroup::has_cpu_quota()
}

impl Seats {
    /// As many seats as that; `None` where the calling thread may not run on as many CPUs, or where [no thread may be bound](may_bind).
    pub(crate) fn take(count: usize) -> Option<Self> {
        if may_bind() { Self::take_of(usable(), count, place_of_process(), &TAKEN) } else { None }
    }

    fn take_of(usable: Vec<Cpu>, count: usize, place: f64, ledger: &'static Ledger) -> Option<Self> {
        if usable.len() < count {
            return None;
        }
        let mut physical: Vec<usize> = (0..=usable.iter().map(|cpu| cpu.id.id).max()?).collect();
        usable.iter().for_each(|cpu| physical[cpu.id.id] = cpu.physical);
        let mut taken = lock(ledger);
        let cpus = choose(&usable, count, place, |cpu| taken.get(&cpu.id.id).copied().unwrap_or(0));
        cpus.iter().for_each(|cpu| *taken.entry(cpu.id.id).or_default() += 1);
        drop(taken);
        Some(Self { cpus, physical, free: AtomicUsize::new(0), caller: AtomicUsize::new(usize::MAX), ledger })
    }

    /// Binds this thread to the seat at a position.
    pub(crate) fn bind(&self, seat: usize) {
        // A refusal leaves the thread to the scheduler, as without binding.
        core_affinity::set_for_current(self.cpus[seat].id);
        SEAT.set(seat);
    }

    /// Notes where the caller runs.
    pub(crate) fn follow_caller(&self) {
        self.caller.store(current_cpu(), Relaxed);
    }

    /// Moves this helper to the free seat if that is farther from the caller than its own.
    pub(crate) fn make_way(&self) {
        let (seat, free) = (SEAT.get(), self.free.load(Relaxed));
        if self.nearness(seat) > self.nearness(free) && self.free.compare_exchange(free, seat, Relaxed, Relaxed).is_ok()
        {
            self.bind(free);
        }
    }

    /// 2 for the CPU of the caller, 1 for another one of the same physical core, 0 for the rest.
    fn nearness(&self, seat: usize) -> u32 {
        let (cpu, caller) = (self.cpus[seat], self.caller.load(Relaxed));
        match self.physical.get(caller) {
            _ if cpu.id.id == caller => 2,
            Some(&physical) if physical == cpu.physical => 1,
            _ => 0,
        }
    }
}

impl Drop for Seats {
    fn drop(&mut self) {
        let mut taken = lock(self.ledger);
        for cpu in &self.cpus {
            if let Some(pools) = taken.get_mut(&cpu.id.id) {
                *pools -= 1;
            }
        }
    }
}

/// The `count` CPUs among `usable` that share a physical core with the fewest others of this pool, then with the fewest pools. Among equals
/// counting begins at the physical core that lies at `place` of all of them, from 0 to 1.
fn choose(usable: &[Cpu], count: usize, place: f64, taken: impl Fn(&Cpu) -> u32) -> Vec<Cpu> {
    let mut cores: Vec<usize> = usable.iter().map(|cpu| cpu.physical).collect();
    cores.sort_unstable();
    cores.dedup();
    let first = ((place * cores.len() as f64) as usize).min(cores.len().saturating_sub(1));
    let mut ranked = Vec::new();
    for (k, core) in cores.iter().enumerate() {
        let mut siblings: Vec<&Cpu> = usable.iter().filter(|cpu| cpu.physical == *core).collect();
        siblings.sort_by_key(|cpu| taken(cpu));
        let pools: u32 = siblings.iter().map(|cpu| taken(cpu)).sum();
        let turn = (k + cores.len() - first) % cores.len();
        ranked.extend(siblings.into_iter().enumerate().map(|(rank, cpu)| ((rank, taken(cpu), pools, turn), *cpu)));
    }
    ranked.sort_by_key(|(rank, _)| *rank);
    ranked.into_iter().take(count).map(|(_, cpu)| cpu).collect()
}

/// The CPUs on which this thread may run.
fn usable() -> Vec<Cpu> {
    let cpu = |id: CoreId| {
        let siblings = format!("/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list", id.id);
        let siblings = std::fs::read_to_string(siblings).unwrap_or_default();
        Cpu { id, physical: first_number(&siblings).map_or(id.id, |first| first as usize) }
    };
    core_affinity::get_core_ids().unwrap_or_default().into_iter().map(cpu).collect()
}

/// Where counting begins in this process, from 0 to 1.
fn place_of_process() -> f64 {
    // In a container the first process has the number 1, as in every other: the number of its namespace tells them apart.
    let namespace = std::fs::read_link("/proc/self/ns/pid").unwrap_or_default();
    place(u64::from(std::process::id()) + first_number(&namespace.to_string_lossy()).unwrap_or(0))
}

/// Anywhere, so that no rule in the numbers of processes puts many of them in one place.
fn place(process: u64) -> f64 {
    mix(process) as f64 / 2.0_f64.powi(64)
}

fn first_number(text: &str) -> Option<u64> {
    let digits = text.trim_start_matches(|c: char| !c.is_ascii_digit());
    digits.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// The CPU on which this thread runs now; a number that none has where the system does not tell.
fn current_cpu() -> usize {
    #[cfg(target_os = "linux")]
    return rustix::thread::sched_getcpu();
    #[cfg(not(target_os = "linux"))]
    usize::MAX
}

fn lock(ledger: &Ledger) -> MutexGuard<'_, BTreeMap<usize, u32>> {
    ledger.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine of `cores` physical cores with two hyper-threads each: `k` and `k + cores`.
    fn machine(cores: usize) -> Vec<Cpu> {
        (0..2 * cores).map(|id| Cpu { id: CoreId { id }, physical: id % cores }).collect()
    }

    fn ids(cpus: &[Cpu]) -> Vec<usize> {
        cpus.iter().map(|cpu| cpu.id.id).collect()
    }

    #[test]
    fn each_physical_core_has_one_thread_before_any_has_two() {
        let four = machine(4);
        assert_eq!(ids(&choose(&four, 4, 0.0, |_| 0)), [0, 1, 2, 3]);
        assert_eq!(ids(&choose(&four, 6, 0.0, |_| 0)), [0, 1, 2, 3, 4, 5]);
        assert_eq!(ids(&choose(&four, 3, 0.5, |_| 0)), [2, 3, 0]);
        // Neighbours are siblings here, as on most machines of Intel's under Windows.
        let neighbours: Vec<Cpu> = (0..8).map(|id| Cpu { id: CoreId { id }, physical: id / 2 * 2 }).collect();
        assert_eq!(ids(&choose(&neighbours, 5, 0.25, |_| 0)), [2, 4, 6, 0, 3]);
        // A mask that leaves one of two siblings.
        assert_eq!(ids(&choose(&neighbours[1..4], 3, 0.0, |_| 0)), [1, 2, 3]);
    }

    #[test]
    fn pools_share_a_cpu_only_where_there_is_no_other() {
        static LEDGER: Ledger = Mutex::new(BTreeMap::new());
        let take = |count| Seats::take_of(machine(4), count, 0.0, &LEDGER).unwrap();
        let (a, b) = (take(2), take(2));
        assert_eq!((ids(&a.cpus), ids(&b.cpus)), (vec![0, 1], vec![2, 3]));
        // Four seats on four cores, none of them taken.
        let c = take(4);
        assert_eq!(ids(&c.cpus), [4, 5, 6, 7]);
        let d = take(1);
        assert_eq!(ids(&d.cpus), [0]);
        drop((b, d));
        assert_eq!(ids(&take(2).cpus), [2, 3]);
        drop((a, c));
        assert!(lock(&LEDGER).values().all(|&pools| pools == 0));
        assert!(Seats::take_of(machine(4), 9, 0.0, &LEDGER).is_none());
        assert!(Seats::take_of(Vec::new(), 0, 0.0, &LEDGER).is_none());
    }

    #[test]
    fn processes_spread_over_the_machine() {
        let machine = machine(64);
        for step in 1..40 {
            let mut threads = [0; 64];
            for server in 0..16 {
                let cpus = choose(&machine, 4, place(31_415 + server * step), |_| 0);
                ids(&cpus).into_iter().for_each(|id| threads[id] += 1);
            }
            // 64 threads on 64 cores; 16 on each of four if all began with the first. About a third is idle where 16 places are drawn by lot.
            let (most, idle) = (threads.iter().max().unwrap(), threads.iter().filter(|&&t| t == 0).count());
            assert!(*most <= 7 && idle <= 36, "process numbers in steps of {step}: {threads:?}");
        }
    }

    #[test]
    fn a_helper_makes_way_for_the_caller() {
        static LEDGER: Ledger = Mutex::new(BTreeMap::new());
        let seats = Seats::take_of(machine(4), 3, 0.0, &LEDGER).unwrap();
        let after = |seat: usize, caller: usize| {
            std::thread::scope(|scope| {
                let moved = scope.spawn(|| {
                    SEAT.set(seat);
                    seats.free.store(0, Relaxed);
                    seats.caller.store(caller, Relaxed);
                    seats.make_way();
                    (SEAT.get(), seats.free.load(Relaxed))
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
    fn lists_of_siblings_and_names_of_namespaces() {
        let of = |text| first_number(text);
        assert_eq!(
            [of("3,67\n"), of("0-1\n"), of("12"), of("pid:[4026531836]")],
            [Some(3), Some(0), Some(12), Some(4_026_531_836)]
        );
        assert_eq!((of(""), of("none")), (None, None));
    }
}
