//! Other programs at work, made by ourselves: threads that take memory bandwidth or cache.

use core_affinity::CoreId;
use sapwise::ParameterId;
use sapwise::measure::{self, Family, Options};
use sapwise::usable_cores;
use sapwise_scenes::Random;
use std::fmt;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;

/// What the other programs take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Contended {
    /// Memory bandwidth: they stream through memory
    Memory,
    /// The last-level cache: they change lines in random order in a buffer that just fits into it
    Cache,
}

/// Numbers in the buffer of a thread that streams: 64 MB, beyond the last-level cache of most machines.
const NUMBERS: usize = 8 << 20;

/// The last-level cache where nobody tells.
pub(crate) const ASSUMED_LLC_BYTES: f64 = 32.0 * 1024.0 * 1024.0;

/// Share of the last-level cache that the buffer of the threads that take it has. The whole of it would not fit beside what
/// the measured programs use, and the misses would take memory bandwidth as well.
const CACHE_SHARE: f64 = 0.75;

/// 64-bit words in a line of 64 bytes.
const LINE: usize = 8;

/// Threads at work until this is dropped.
#[derive(Default)]
pub(crate) struct Threads {
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Threads {
    /// Starts one more, bound to a core where one is given, whose work ends soon after the flag is set that it gets.
    ///
    /// # Errors
    /// When the system refuses it.
    pub(crate) fn spawn(
        &mut self,
        name: String,
        core: Option<CoreId>,
        work: impl FnOnce(&AtomicBool) + Send + 'static,
    ) -> std::io::Result<()> {
        let stop = Arc::clone(&self.stop);
        let body = move || {
            if let Some(core) = core {
                // A refusal leaves the thread to the scheduler.
                core_affinity::set_for_current(core);
            }
            work(&stop);
        };
        self.threads.push(std::thread::Builder::new().name(name).spawn(body)?);
        Ok(())
    }
}

/// Half of the usable cores, at least one, kept busy until the threads are dropped, beside a measurement on at most `threads` cores.
///
/// # Errors
/// When the system refuses one.
pub(crate) fn contend(kind: Contended, threads: Option<u32>) -> std::io::Result<Threads> {
    let mut contention = Threads::default();
    let words = if kind == Contended::Cache { words() } else { Arc::default() };
    let mut cores = spare_cores(core_affinity::get_core_ids().unwrap_or_default(), threads).into_iter();
    for k in 0..usable_cores().div_ceil(2) {
        let words = Arc::clone(&words);
        contention.spawn(format!("contention-{k}"), cores.next(), move |stop| match kind {
            Contended::Memory => stream(stop),
            Contended::Cache => evict(stop, &words, u64::from(k)),
        })?;
    }
    Ok(contention)
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A thread that panicked has stopped, which is all that is wanted.
            let _ = thread.join();
        }
    }
}

impl fmt::Display for Contended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Memory => "memory",
            Self::Cache => "cache",
        })
    }
}

/// The cores for what runs beside a measurement on one thread, from the last one on: were that thread to share its core, it would lose
/// half of its time, which says nothing about memory or cache. None beside more threads, which are bound to any cores, and none where all
/// cores are measured: there the scheduler decides.
fn spare_cores(all: Vec<CoreId>, threads: Option<u32>) -> Vec<CoreId> {
    if threads == Some(1) { all.into_iter().skip(1).rev().collect() } else { Vec::new() }
}

/// The buffer of all threads that take the cache. One for all of them: however many last-level caches the machine has and
/// whichever cores share one, the lines of those who run there come to each.
fn words() -> Arc<[AtomicU64]> {
    let caches = measure::family(Family::Caches, &Options::default().brief(true));
    let llc =
        caches.iter().find(|p| p.name == ParameterId::CacheLlcBytes).and_then(|p| p.value).unwrap_or(ASSUMED_LLC_BYTES);
    let lines = (llc * CACHE_SHARE) as usize / (LINE * size_of::<AtomicU64>());
    (0..lines.max(1) * LINE).map(|_| AtomicU64::new(0)).collect()
}

fn stream(stop: &AtomicBool) {
    let mut numbers = vec![1.0_f64; NUMBERS];
    while !stop.load(Ordering::Relaxed) {
        for part in numbers.chunks_mut(1 << 16) {
            part.iter_mut().for_each(|x| *x = *x * 0.5 + 1.0);
            if stop.load(Ordering::Relaxed) {
                break;
            }
        }
        black_box(&mut numbers);
    }
}

fn evict(stop: &AtomicBool, words: &[AtomicU64], seed: u64) {
    let lines = (words.len() / LINE) as u128;
    let mut shuffle = Random::new(seed);
    while !stop.load(Ordering::Relaxed) {
        for _ in 0..1 << 12 {
            // The upper half of the product is even over the lines, without a division.
            let line = (u128::from(shuffle.bits()) * lines) >> 64;
            let word = &words[line as usize * LINE];
            // Not one atomic addition: that would wait for every line, and take fewer of them. A lost count is none.
            word.store(word.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_is_beside_one_thread_leaves_it_a_core() {
        let all = || (0..4).map(|id| CoreId { id }).collect::<Vec<_>>();
        let ids = |threads| spare_cores(all(), threads).iter().map(|c| c.id).collect::<Vec<_>>();
        assert_eq!((ids(None), ids(Some(2)), ids(Some(4))), (vec![], vec![], vec![]));
        assert_eq!(ids(Some(1)), [3, 2, 1]);
    }

    #[test]
    fn lines_all_over_the_cache_are_changed_until_it_is_dropped() {
        let words = words();
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| evict(&stop, &words, 1));
            let changed = |part: &[AtomicU64]| part.iter().any(|w| w.load(Ordering::Relaxed) > 0);
            // In every eighth of the buffer; a walk that stays in one part would never end this.
            while !words.chunks(words.len().div_ceil(8)).all(changed) {
                std::thread::yield_now();
            }
            stop.store(true, Ordering::Relaxed);
        });
        assert!(words.iter().enumerate().all(|(k, w)| k % LINE == 0 || w.load(Ordering::Relaxed) == 0));
    }
}
