//! Size of the memory, and its bandwidth by the triad of STREAM.

use std::sync::Mutex;
use std::time::Instant;

use rayon::ThreadPool;
use sysinfo::{ProcessRefreshKind, ProcessesToUpdate, System};

use super::samples::Plan;
use super::{Options, cache_sizes, filled, missing, pool};
use crate::hardware::{Parameter, ParameterId};
use sapwise::internals::triad;

/// Bytes that STREAM counts for one element of triad: two read, one written, without the line that is fetched before
/// the write.
const BYTES_PER_ELEMENT: u64 = 24;

/// Largest array. The first touch of a larger one would take longer than the measurement.
const LARGEST_BYTES: u64 = 512 << 20;

/// Largest array under a time limit.
const LARGEST_UNDER_LIMIT_BYTES: u64 = 128 << 20;

/// Array of a brief run.
const BRIEF_BYTES: u64 = 4 << 20;

/// Elements that a thread takes at a time.
const CHUNK: usize = 65_536;

/// Total of the last-level caches if the system reports none.
const ASSUMED_LLC_BYTES: u64 = 64 << 20;

const BANDWIDTHS: [ParameterId; 2] = [ParameterId::BandwidthOneThreadGbPerS, ParameterId::BandwidthAllThreadsGbPerS];

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let size = match total_bytes() {
        Some(bytes) => Parameter::reported(ParameterId::MemoryBytes, bytes as f64, "sysinfo, with the cgroup's limit"),
        None => Parameter::missing(ParameterId::MemoryBytes, "sysinfo does not report it"),
    };
    let bandwidths = bandwidths(options).unwrap_or_else(|why| missing(&BANDWIDTHS, &why));
    std::iter::once(size).chain(bandwidths).collect()
}

/// Memory of the machine in bytes, or the limit of this process's cgroup if that is lower.
pub(super) fn total_bytes() -> Option<u64> {
    let mut system = System::new().ok()?;
    system.refresh_memory();
    let pid = sysinfo::get_current_pid().ok()?;
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[pid]), false, ProcessRefreshKind::nothing());
    let limit = system.process(pid).and_then(|own| own.cgroup_limits()).map_or(u64::MAX, |own| own.total_memory);
    Some(system.total_memory().min(limit)).filter(|&bytes| bytes > 0)
}

/// Bytes of one array: four times the sum of the last-level caches, as STREAM asks, within a bound and an eighth of
/// memory for three.
fn array_bytes(llc: u64, memory: u64, largest: u64) -> u64 {
    llc.saturating_mul(4).min(largest).min(memory / 24)
}

/// Measures both bandwidths by the triad a = b + s * c of STREAM. Fails if the threads or the memory are refused.
fn bandwidths(options: &Options) -> Result<Vec<Parameter>, String> {
    let start = Instant::now();
    let threads = options.usable_cores();
    let bytes = if options.brief {
        BRIEF_BYTES
    } else {
        let llc = cache_sizes::reported().last().map(|cache| cache.bytes.saturating_mul(cache.instances));
        let largest = if options.limit.is_some() { LARGEST_UNDER_LIMIT_BYTES } else { LARGEST_BYTES };
        array_bytes(llc.unwrap_or(ASSUMED_LLC_BYTES), total_bytes().unwrap_or(u64::MAX), largest)
    };
    let pool = pool(threads)?;
    let mut arrays = Arrays::new(&pool, bytes as usize / size_of::<f64>()).ok_or("no memory for the arrays")?;
    arrays.triad_on_one();
    arrays.triad_on_all(&pool);
    let method = |threads: usize| {
        let (plural, mib) = (if threads == 1 { "" } else { "s" }, bytes >> 20);
        format!(
            "STREAM triad on {threads} thread{plural}, three arrays of {mib} MiB; value is the median, STREAM quotes \
             the best"
        )
    };
    let plan = options.plan(9, 1150);
    let plan = Plan { limit: plan.limit.saturating_sub(start.elapsed()), ..plan };
    let named = [(BANDWIDTHS[0], method(1)), (BANDWIDTHS[1], method(threads))];
    plan.measure(named, || {
        if threads == 1 {
            let one = arrays.triad_on_one();
            return Ok([one, one]);
        }
        // Untimed: takes back what lies in the caches of the other cores.
        arrays.triad_on_one();
        let one = arrays.triad_on_one();
        // Untimed: wakes the workers, which slept while one thread ran. STREAM's never sleep.
        arrays.triad_on_all(&pool);
        Ok([one, arrays.triad_on_all(&pool)])
    })
}

/// The part of the three arrays that one thread touched first.
struct Part {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

/// The three arrays of triad, in one part a thread.
struct Arrays {
    parts: Vec<Part>,
}

impl Arrays {
    /// Each thread allocates and fills its part, so that the pages lie in its memory node. `None` without the memory.
    fn new(pool: &ThreadPool, elements: usize) -> Option<Self> {
        let each = elements.div_ceil(pool.current_num_threads()).max(1);
        let part = || Some(Part { a: filled(each, 0.0)?, b: filled(each, 1.0)?, c: filled(each, 2.0)? });
        Some(Self { parts: pool.broadcast(|_| part()).into_iter().collect::<Option<_>>()? })
    }

    /// GB/s of the calling thread.
    fn triad_on_one(&mut self) -> f64 {
        let start = Instant::now();
        for part in &mut self.parts {
            triad(&mut part.a, &part.b, &part.c);
        }
        self.gb_per_s(start)
    }

    /// GB/s of all threads of the pool.
    ///
    /// Each thread takes chunks of its own part, then helps the others: with one fixed part a thread the slowest
    /// thread decides, and one machine showed 52 GB/s instead of 73 GB/s.
    fn triad_on_all(&mut self, pool: &ThreadPool) -> f64 {
        let start = Instant::now();
        let queues: Vec<_> = self
            .parts
            .iter_mut()
            .map(|Part { a, b, c }| Mutex::new(a.chunks_mut(CHUNK).zip(b.chunks(CHUNK)).zip(c.chunks(CHUNK))))
            .collect();
        pool.broadcast(|worker| {
            let (others, own) = queues.split_at(worker.index().min(queues.len()));
            for queue in own.iter().chain(others) {
                // The closure drops the lock before the chunk is worked on.
                while let Some(((a, b), c)) = queue.lock().ok().and_then(|mut chunks| chunks.next()) {
                    triad(a, b, c);
                }
            }
        });
        self.gb_per_s(start)
    }

    /// Infinite if the clock did not move.
    fn gb_per_s(&self, start: Instant) -> f64 {
        let elements: u64 = self.parts.iter().map(|part| part.a.len() as u64).sum();
        (elements * BYTES_PER_ELEMENT) as f64 / start.elapsed().as_nanos() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn array_sizes() {
        let (mib, gib) = (1_u64 << 20, 1_u64 << 30);
        assert_eq!(array_bytes(32 * mib, 24 * gib, LARGEST_BYTES), 128 * mib);
        assert_eq!(array_bytes(256 * mib, 256 * gib, LARGEST_BYTES), 512 * mib);
        // An eighth of a small memory for all three.
        assert_eq!(array_bytes(32 * mib, 240 * mib, LARGEST_BYTES), 10 * mib);
        assert_eq!(array_bytes(u64::MAX, u64::MAX, LARGEST_BYTES), LARGEST_BYTES);
    }

    #[test]
    fn both_triads_cover_every_element() {
        let pool = pool(3).unwrap();
        let mut arrays = Arrays::new(&pool, 3 * CHUNK + 7).unwrap();
        for all in [false, true] {
            arrays.parts.iter_mut().for_each(|part| part.a.fill(0.0));
            let rate = if all { arrays.triad_on_all(&pool) } else { arrays.triad_on_one() };
            assert!(rate > 0.0);
            assert!(arrays.parts.iter().flat_map(|part| &part.a).all(|&a| a == 7.0));
        }
    }
}
