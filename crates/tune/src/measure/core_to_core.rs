//! Time until a core sees what another core wrote.
//!
//! The hypervisor of one machine moved its two virtual cores between one group of cores that shares a cache (23 ns)
//! and two groups (175 ns), for seconds or minutes. The bandwidth of both was 88 GB/s or 52 GB/s accordingly, and two
//! threads gained 1.5× on small work in one place and lost a third in the other. Without this parameter the
//! difference looks like noise.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use core_affinity::CoreId;

use super::Options;
use crate::hardware::{Parameter, ParameterId};
use crate::stats;

/// Exchanges before those that count: by then both threads run.
const WARM_UP: u32 = 200;
/// Exchanges behind one sample.
const COUNTED: u32 = 1000;
/// Most pairs of cores. Of more cores some are left out, evenly.
const PAIRS: usize = 8;
/// Ends an exchange whose partner does not run. A complete one takes half a millisecond.
const LIMIT: Duration = Duration::from_millis(10);

pub(super) fn measure(options: &Options) -> Result<Vec<Parameter>, String> {
    let pairs = pairs(options.usable_cores());
    if pairs.is_empty() {
        return Err("one usable core, or threads can't be bound to cores here".to_owned());
    }
    let method = format!(
        "one way of an exchange through one word between threads bound to two cores; median over {} pairs of the \
         first core with others",
        pairs.len()
    );
    options.plan(15, 300).measure([(ParameterId::CoreToCoreNs, method)], || Ok([median_of(&pairs)]))
}

/// Measures [`ParameterId::CoreToCoreNs`] once, over the first core with the second and the last, as the best of
/// three so that a preempted thread does not count. Takes 1 to 2 ms, at most 60 ms if other programs hold a core.
///
/// Shows during a long measurement whether the machine stayed the same. `None` on one core, and if threads can't be
/// bound or don't run.
pub fn core_to_core_ns(options: &Options) -> Option<f64> {
    let all = pairs(options.usable_cores());
    let mut pairs: Vec<(CoreId, CoreId)> = all.first().into_iter().chain(all.last()).copied().collect();
    pairs.dedup();
    let best = (0..3).map(|_| median_of(&pairs)).fold(f64::INFINITY, f64::min);
    best.is_finite().then_some(best)
}

/// The first core with each of the other used ones.
fn pairs(cores: usize) -> Vec<(CoreId, CoreId)> {
    let mut ids = core_affinity::get_core_ids().unwrap_or_default();
    ids.truncate(cores);
    let [first, others @ ..] = &ids[..] else { return Vec::new() };
    let count = others.len().min(PAIRS);
    (1..=count).map(|k| (*first, others[k * others.len() / count - 1])).collect()
}

/// Infinite if no exchange completed.
fn median_of(pairs: &[(CoreId, CoreId)]) -> f64 {
    let times: Vec<f64> = pairs.iter().filter_map(|&(a, b)| exchange_ns(a, b)).collect();
    stats::median(&times).unwrap_or(f64::INFINITY)
}

/// A word that has its cache line to itself, and the neighbour line that some cores fetch with it.
#[derive(Default)]
#[repr(align(128))]
struct Line(AtomicU32);

/// Nanoseconds until one core sees the word that the other one wrote.
fn exchange_ns(a: CoreId, b: CoreId) -> Option<f64> {
    let line = Line::default();
    let word = &line.0;
    let end = Instant::now() + LIMIT;
    std::thread::scope(|scope| {
        let answering = std::thread::Builder::new().spawn_scoped(scope, || {
            let bound = core_affinity::set_for_current(b);
            (0..WARM_UP + COUNTED).all(|k| {
                let came = bound && await_word(word, 2 * k + 1, end);
                word.store(2 * k + 2, Ordering::Release);
                came
            })
        });
        let asking = std::thread::Builder::new().spawn_scoped(scope, || {
            let bound = core_affinity::set_for_current(a);
            let mut began = Instant::now();
            for k in 0..WARM_UP + COUNTED {
                if k == WARM_UP {
                    began = Instant::now();
                }
                word.store(2 * k + 1, Ordering::Release);
                if !bound || !await_word(word, 2 * k + 2, end) {
                    return None;
                }
            }
            Some(began.elapsed().as_nanos() as f64 / f64::from(2 * COUNTED))
        });
        // If the system refuses one thread, the other one waits until the limit.
        let (answering, asking) = (answering.ok()?, asking.ok()?);
        let ns = asking.join().ok().flatten();
        ns.filter(|_| answering.join().unwrap_or(false))
    })
}

fn await_word(word: &AtomicU32, value: u32, end: Instant) -> bool {
    let mut spins = 0_u32;
    while word.load(Ordering::Acquire) != value {
        std::hint::spin_loop();
        spins = spins.wrapping_add(1);
        // Reading the clock each time would take longer than an exchange.
        if spins.is_multiple_of(1024) && Instant::now() >= end {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_core_has_no_pair() {
        assert!(pairs(1).is_empty() && pairs(0).is_empty());
        assert_eq!(core_to_core_ns(&Options::default().with_threads(Some(1)).brief(true)), None);
    }

    #[test]
    fn an_exchange_takes_longer_than_a_cycle_and_ends_without_a_partner() {
        let ids = core_affinity::get_core_ids().unwrap_or_default();
        if let [a, b, ..] = ids[..] {
            // Among other tests a partner may not run in time; then there is no value.
            assert!(exchange_ns(a, b).is_none_or(|ns| ns > 0.2), "faster than a cycle");
        }
        let word = AtomicU32::new(0);
        assert!(!await_word(&word, 1, Instant::now()));
        assert!(await_word(&word, 0, Instant::now()));
    }
}
