//! Size of the memory, and its bandwidth by the triad of STREAM.

use std::hint::black_box;
use std::sync::Mutex;
use std::time::Instant;

use rayon::ThreadPool;

use super::{Options, cache_sizes, foreign_load, pool};
use crate::SimdLevel;
use crate::cgroup;
use crate::hardware::{Parameter, ParameterId};

/// Bytes that STREAM counts for one element of triad: two read, one written, the line fetched before the write not counted.
const BYTES_PER_ELEMENT: u64 = 24;

/// The most that one array takes. First touch of more would take longer than the measurement.
const LARGEST_ARRAY_BYTES: u64 = 512 << 20;

/// The same in a run with a limit of time.
const LARGEST_UNDER_LIMIT_BYTES: u64 = 128 << 20;

/// Elements that a thread takes at a time.
const CHUNK: usize = 65_536;

/// Total of the last-level caches where the system reports none.
const ASSUMED_LLC_BYTES: u64 = 64 << 20;

const BANDWIDTHS: [ParameterId; 2] = [ParameterId::BandwidthOneThreadGbPerS, ParameterId::BandwidthAllThreadsGbPerS];

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let size = match total() {
        Some((bytes, source)) => Parameter::reported(ParameterId::MemoryBytes, bytes as f64, source),
        None => Parameter::missing(ParameterId::MemoryBytes, "neither /proc/meminfo nor sysinfo tells"),
    };
    let missing = |why: String| BANDWIDTHS.map(|name| Parameter::missing(name, &why)).to_vec();
    let bandwidths = triad(options).unwrap_or_else(missing);
    std::iter::once(size).chain(bandwidths).collect()
}

/// Memory in bytes, or the control group's limit where that is lower, and who said so.
pub(super) fn total() -> Option<(u64, &'static str)> {
    let meminfo = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| parse_mem_total(&text));
    let machine = meminfo.map(|bytes| (bytes, "/proc/meminfo")).or_else(|| {
        let mut system = sysinfo::System::new().ok()?;
        system.refresh_memory();
        Some((system.total_memory(), "sysinfo")).filter(|(bytes, _)| *bytes > 0)
    });
    match (machine, cgroup::memory_limit()) {
        (Some((bytes, _)), Some(limit)) if limit < bytes => Some((limit, "cgroup memory limit")),
        (None, Some(limit)) => Some((limit, "cgroup memory limit")),
        (machine, _) => machine,
    }
}

/// Bytes of `MemTotal` in the text of `/proc/meminfo`.
fn parse_mem_total(text: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    let kib: u64 = rest.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024).filter(|&bytes| bytes > 0)
}

/// Bytes of one array, and what to say of how they were chosen.
///
/// STREAM asks for four times the sum of the last-level caches; less measures the caches too.
fn array_bytes(llc: Option<u64>, memory: Option<u64>, largest: u64) -> (u64, String) {
    let wanted = llc.unwrap_or(ASSUMED_LLC_BYTES).saturating_mul(4);
    let cap = largest.min(memory.map_or(largest, |bytes| bytes / 24));
    let bytes = wanted.min(cap);
    let of = if llc.is_some() { "the last-level caches" } else { "an assumed last-level cache of 64 MiB" };
    let mib = bytes >> 20;
    if bytes < wanted {
        (bytes, format!("three arrays of {mib} MiB, capped below four times {of}"))
    } else {
        (bytes, format!("three arrays of {mib} MiB, four times {of}"))
    }
}

/// Both bandwidths by the triad a = b + s * c of STREAM, or a sentence when the threads or the memory can't be had.
///
/// Arrays are four times the last-level caches, at most 512 MiB each and an eighth of memory together. Each thread
/// touches its part first, and the first sample of each kind is dropped.
fn triad(options: &Options) -> Result<Vec<Parameter>, String> {
    let start = Instant::now();
    let threads = options.usable_cores();
    let llc = cache_sizes::reported().last_level.map(|level| level.bytes.saturating_mul(level.instances));
    let (array_bytes, array_choice) = if options.brief {
        (4 << 20, "three arrays of 4 MiB, brief run".to_owned())
    } else {
        let largest = if options.limit.is_some() { LARGEST_UNDER_LIMIT_BYTES } else { LARGEST_ARRAY_BYTES };
        array_bytes(llc, total().map(|(bytes, _)| bytes), largest)
    };
    let pool = pool(threads)?;
    let mut arrays = Arrays::new(&pool, array_bytes as usize / size_of::<f64>()).ok_or("no memory for the arrays")?;
    arrays.triad_on_one();
    arrays.triad_on_all(&pool);
    let plan = options.plan(9, 1150);
    let plan = foreign_load::Plan { limit: plan.limit.saturating_sub(start.elapsed()), ..plan };
    let figures = foreign_load::collect(plan, || {
        if threads > 1 {
            // Not timed: it takes back what lies in the caches of the other cores, which may be far away.
            arrays.triad_on_one();
        }
        let one = arrays.triad_on_one();
        // On one core the second figure is the first: there is nothing else to run it on.
        let all = if threads == 1 {
            one
        } else {
            // Not timed: it wakes the workers, which slept while one thread ran. STREAM's never sleep.
            arrays.triad_on_all(&pool);
            arrays.triad_on_all(&pool)
        };
        vec![one, all]
    });
    let method = |threads: usize| {
        let plural = if threads == 1 { "" } else { "s" };
        format!("STREAM triad on {threads} thread{plural}, {array_choice}; value is the median, STREAM quotes the best")
    };
    let named = BANDWIDTHS.into_iter().zip([1, threads]);
    Ok(figures.into_iter().zip(named).map(|(f, (name, threads))| f.into_parameter(name, &method(threads))).collect())
}

/// The part of the three arrays that one thread touched first.
#[derive(Default)]
struct Part {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Part {
    fn new(elements: usize) -> Option<Self> {
        let filled = |value: f64| {
            let mut array = Vec::new();
            array.try_reserve_exact(elements).ok()?;
            array.resize(elements, value);
            Some(array)
        };
        Some(Self { a: filled(0.0)?, b: filled(1.0)?, c: filled(2.0)? })
    }
}

/// The three arrays of triad, in one part per thread.
struct Arrays {
    parts: Vec<Part>,
}

impl Arrays {
    /// Each thread allocates and fills its own part, so that the pages lie in its memory node. `None` without the memory.
    fn new(pool: &ThreadPool, elements: usize) -> Option<Self> {
        let each = elements.div_ceil(pool.current_num_threads()).max(1);
        let parts = pool.broadcast(|_| Part::new(each));
        Some(Self { parts: parts.into_iter().collect::<Option<_>>()? })
    }

    fn elements(&self) -> u64 {
        self.parts.iter().map(|part| part.a.len() as u64).sum()
    }

    /// GB/s of the calling thread.
    fn triad_on_one(&mut self) -> f64 {
        let start = Instant::now();
        for part in &mut self.parts {
            pass(&mut part.a, &part.b, &part.c);
        }
        self.gb_per_s(start)
    }

    /// GB/s of all threads of the pool.
    ///
    /// Each thread takes chunks of its own part, then helps the others: with one fixed part a thread, the slowest
    /// thread alone decides, and one machine gave 52 GB/s instead of 73.
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
                    pass(a, b, c);
                }
            }
        });
        self.gb_per_s(start)
    }

    fn gb_per_s(&self, start: Instant) -> f64 {
        // Bytes a nanosecond are gigabytes a second. A clock that did not move yields infinity, which is no usable sample.
        (self.elements() * BYTES_PER_ELEMENT) as f64 / start.elapsed().as_nanos() as f64
    }
}

/// One pass of a = b + s * c, with the widest vectors in use.
///
/// The default for x86-64 is 128-bit vectors: with them one thread gave 0.90 of the bandwidth that a C program gave
/// when compiled for the machine, and 1.02 of it with 512-bit ones.
fn pass(a: &mut [f64], b: &[f64], c: &[f64]) {
    #[cfg(target_arch = "x86_64")]
    match SimdLevel::in_use() {
        // SAFETY: the level in use is one that the CPU was detected to have.
        SimdLevel::Avx512 => return unsafe { pass_avx512(a, b, c) },
        // SAFETY: the same.
        SimdLevel::Avx2 => return unsafe { pass_avx2(a, b, c) },
        SimdLevel::Portable => {}
    }
    pass_portable(a, b, c);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn pass_avx512(a: &mut [f64], b: &[f64], c: &[f64]) {
    pass_portable(a, b, c);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn pass_avx2(a: &mut [f64], b: &[f64], c: &[f64]) {
    pass_portable(a, b, c);
}

/// Inlined always: only then it is compiled for the vectors of its caller.
#[inline(always)]
fn pass_portable(a: &mut [f64], b: &[f64], c: &[f64]) {
    let scalar = black_box(3.0);
    // Zipped slices: indices would leave bounds checks in the loop, and it would not be vectorised.
    for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
        *a = b + scalar * c;
    }
    black_box(a);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mem_total() {
        assert_eq!(parse_mem_total("MemTotal:       24684096 kB\nMemFree: 1 kB\n"), Some(24_684_096 * 1024));
        assert_eq!(parse_mem_total("MemFree: 1 kB\n"), None);
        assert_eq!(parse_mem_total("MemTotal: 0 kB\n"), None);
        assert_eq!(parse_mem_total("MemTotal: x kB\n"), None);
    }

    #[test]
    fn array_sizes() {
        let (mib, gib) = (1_u64 << 20, 1_u64 << 30);
        assert_eq!(
            array_bytes(Some(32 * mib), Some(24 * gib), LARGEST_ARRAY_BYTES),
            (128 * mib, "three arrays of 128 MiB, four times the last-level caches".to_owned())
        );
        assert_eq!(array_bytes(Some(256 * mib), Some(256 * gib), LARGEST_ARRAY_BYTES).0, 512 * mib);
        assert_eq!(array_bytes(Some(256 * mib), Some(256 * gib), LARGEST_UNDER_LIMIT_BYTES).0, 128 * mib);
        // An eighth of a small memory for all three.
        assert_eq!(array_bytes(Some(32 * mib), Some(240 * mib), LARGEST_ARRAY_BYTES).0, 10 * mib);
        assert_eq!(array_bytes(None, None, LARGEST_ARRAY_BYTES).0, 256 * mib);
        assert!(array_bytes(Some(u64::MAX), None, LARGEST_ARRAY_BYTES).1.contains("capped"));
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
        assert!(arrays.elements() >= 3 * CHUNK as u64 + 7);
    }
}
