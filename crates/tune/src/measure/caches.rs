//! Load latencies over growing working sets, and the cache sizes that the system reports.
//!
//! The sizes alone are not enough: a virtual machine reported a last-level cache of 105 MB and showed no plateau for
//! it.

use std::cell::Cell;
use std::hint::black_box;
use std::time::{Duration, Instant};

use super::{Options, cache_sizes, filled, memory};
use crate::hardware::{Parameter, ParameterId};
use sapwise::internals::splitmix;

/// Largest set that is walked once, untimed, before its samples, in bytes. A lap of a larger one takes longer than its
/// samples.
const WALKED_BYTES: usize = 64 << 20;

/// The largest working set of a brief run.
const BRIEF_KIB: u32 = 4096;

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let caches = cache_sizes::reported();
    let size = |name, cache: Option<&cache_sizes::Cache>| match cache {
        Some(cache) => Parameter::reported(name, cache.bytes as f64, cache_sizes::SOURCE),
        None => Parameter::missing(name, "neither sysfs nor CPUID reports it"),
    };
    let at = |level| caches.iter().find(|cache| cache.level == level);
    let sizes = [
        size(ParameterId::CacheL1dBytes, at(1)),
        size(ParameterId::CacheL2Bytes, at(2)),
        size(ParameterId::CacheLlcBytes, caches.last()),
    ];
    let limit = memory::total_bytes().map_or(64 << 20, |bytes| bytes / 8);
    let latency = |(kib, id)| {
        let parameters = latencies(kib, id, limit, options);
        parameters.unwrap_or_else(|why: &str| vec![Parameter::missing(id, why)])
    };
    sizes.into_iter().chain(ParameterId::LATENCIES.into_iter().flat_map(latency)).collect()
}

/// Takes all samples of one set in a row: other sets would evict its lines between them.
fn latencies(kib: u32, id: ParameterId, limit: u64, options: &Options) -> Result<Vec<Parameter>, &'static str> {
    if options.limit.is_some() {
        return Err("not measured under a time limit");
    } else if options.brief && kib > BRIEF_KIB {
        return Err("not measured in a brief run");
    } else if u64::from(kib) << 10 > limit {
        return Err("the working set exceeds an eighth of memory");
    }
    let bytes = (kib as usize) << 10;
    let slice = Duration::from_micros(if options.brief { 200 } else { 3000 });
    let lines = filled(bytes / size_of::<Line<'_>>(), Line::default()).ok_or("no memory for the working set")?;
    link(&lines);
    let mut at = lines.first();
    let warm = if bytes <= WALKED_BYTES {
        at = walk(at, lines.len());
        "walked once before the first sample"
    } else {
        "too large to be walked before"
    };
    let method = format!("dependent loads around a random cycle of 64-byte lines, default pages; set {warm}");
    options.plan(9, 450).measure([(id, method)], || {
        let (ns, end) = sample_ns(at, slice);
        at = end;
        Ok([ns])
    })
}

/// A cache line that refers to the next one. An index would cost a cycle to scale.
#[derive(Clone, Default)]
#[repr(align(64))]
struct Line<'a> {
    next: Cell<Option<&'a Line<'a>>>,
}

/// Links the lines to one random cycle, by Sattolo's algorithm. A plain shuffle would fall apart into shorter cycles,
/// and a walk would stay in a cache that holds one of them.
fn link<'a>(lines: &'a [Line<'a>]) {
    let mut order: Vec<usize> = (0..lines.len()).collect();
    let mut state = 0;
    for i in (1..lines.len()).rev() {
        order.swap(i, splitmix::next(&mut state) as usize % i);
    }
    for (line, next) in lines.iter().zip(order) {
        line.next.set(lines.get(next));
    }
}

/// Follows `steps` links. The address of each load is the result of the previous one, so loads can't overlap.
fn walk<'a>(mut at: Option<&'a Line<'a>>, steps: usize) -> Option<&'a Line<'a>> {
    for _ in 0..steps {
        // Every line has a next one; the test is beside the chain, not in it.
        at = at?.next.get();
    }
    black_box(at)
}

/// Returns the nanoseconds of a load, averaged over at least `slice`, and the line at which the walk ended.
fn sample_ns<'a>(mut at: Option<&'a Line<'a>>, slice: Duration) -> (f64, Option<&'a Line<'a>>) {
    const STEPS: usize = 16_384;
    let start = Instant::now();
    let mut steps = 0_u64;
    loop {
        at = walk(at, STEPS);
        steps += STEPS as u64;
        let elapsed = start.elapsed();
        if elapsed >= slice {
            return (elapsed.as_nanos() as f64 / steps as f64, at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_returns_after_one_lap_and_not_before() {
        assert_eq!(size_of::<Line<'_>>(), 64);
        for count in [1, 2, 3, 64, 1000] {
            let lines = filled(count, Line::default()).unwrap();
            link(&lines);
            let first = lines.first().unwrap();
            let mut laps = (1..=count).filter(|&steps| std::ptr::eq(walk(Some(first), steps).unwrap(), first));
            assert_eq!((laps.next(), laps.next()), (Some(count), None));
            assert!(sample_ns(Some(first), Duration::ZERO).0 > 0.0);
        }
    }
}
