//! Load latencies over growing working sets, beside the cache sizes that the system reports.
//!
//! The sizes can't be trusted alone: a virtual machine reported a last-level cache of 105 MB and showed no plateau for it.

use std::cell::Cell;
use std::hint::black_box;
use std::time::{Duration, Instant};

use super::cache_sizes::{self, Level};
use super::{Options, UNDER_LIMIT, foreign_load, memory};
use crate::hardware::{Parameter, ParameterId};

/// Bytes up to which a set is walked once, untimed, before its samples. A lap of a larger one takes longer than its samples.
const WALKED_BYTES: u64 = 64 << 20;

/// The largest working set of a brief run.
const BRIEF_KIB: u32 = 4096;

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let sizes = cache_sizes::reported();
    let level = |name: ParameterId, level: &Option<Level>| match level {
        Some(found) => Parameter::reported(name, found.bytes as f64, sizes.source),
        None => Parameter::missing(name, "neither sysfs nor CPUID tells"),
    };
    let mut parameters = vec![
        level(ParameterId::CacheL1dBytes, &sizes.first_level_data),
        level(ParameterId::CacheL2Bytes, &sizes.second_level),
        level(ParameterId::CacheLlcBytes, &sizes.last_level),
    ];
    parameters.extend(latencies(options));
    parameters
}

/// Each set on its own, all its samples behind one another: what other sets push out of the caches would be missed again in every
/// sample of a set that is larger than a first-level cache.
fn latencies(options: &Options) -> Vec<Parameter> {
    let limit = memory::total().map_or(64 << 20, |(bytes, _)| bytes / 8);
    let slice = if options.brief { Duration::from_micros(200) } else { Duration::from_millis(3) };
    let one = |(kib, id): (u32, ParameterId)| {
        let bytes = u64::from(kib) << 10;
        if bytes > limit {
            return Parameter::missing(id, "the working set exceeds an eighth of memory");
        }
        if options.brief && kib > BRIEF_KIB {
            return Parameter::missing(id, "left out of a brief run");
        }
        if options.limit.is_some() {
            return Parameter::missing(id, UNDER_LIMIT);
        }
        let Some(lines) = lines(bytes as usize / size_of::<Line<'_>>()) else {
            return Parameter::missing(id, "no memory for the working set");
        };
        if link(&lines).is_none() {
            return Parameter::missing(id, "no memory for the order of its lines");
        }
        let mut at = lines.first();
        let walked = bytes <= WALKED_BYTES;
        if walked {
            at = walk(at, lines.len());
        }
        let figures = foreign_load::collect(options.plan(9, 450), || {
            let (ns, end) = sample_ns(at, slice);
            at = end;
            vec![ns]
        });
        let warm = if walked { "walked once before the first sample" } else { "too large to be walked before" };
        let method = format!("dependent loads around a random cycle of 64-byte lines, default pages; set {warm}");
        figures.into_iter().next().unwrap_or_default().into_parameter(id, &method)
    };
    ParameterId::LATENCIES.into_iter().map(one).collect()
}

/// A cache line that says where the next one is. An address and not an index: that would cost a cycle to scale.
#[repr(align(64))]
struct Line<'a> {
    next: Cell<Option<&'a Line<'a>>>,
}

/// Lines that lead nowhere yet. `None` when the memory can't be had.
fn lines<'a>(count: usize) -> Option<Vec<Line<'a>>> {
    let mut lines = Vec::new();
    lines.try_reserve_exact(count).ok()?;
    lines.resize_with(count, || Line { next: Cell::new(None) });
    Some(lines)
}

/// Links the lines to one cycle. `None` when the memory for their order can't be had.
fn link<'a>(lines: &'a [Line<'a>]) -> Option<()> {
    for (line, next) in lines.iter().zip(sattolo(lines.len())?) {
        line.next.set(lines.get(next as usize));
    }
    Some(())
}

/// Follows `steps` links. The next load's address is this load's result, so loads can't overlap.
fn walk<'a>(mut at: Option<&'a Line<'a>>, steps: usize) -> Option<&'a Line<'a>> {
    for _ in 0..steps {
        // Every line has a next one; the look whether it has is beside the chain, not in it.
        at = at?.next.get();
    }
    black_box(at)
}

/// Nanoseconds a load, over at least `slice`, and where the walk ended.
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

/// A permutation that is one cycle through every slot, by Sattolo's algorithm: `result[i]` is the slot after `i`.
///
/// A plain shuffle falls apart into shorter cycles, and a chase would stay in a cache that holds one of them.
fn sattolo(slots: usize) -> Option<Vec<u32>> {
    let count = u32::try_from(slots).ok()?;
    let mut cycle = Vec::new();
    cycle.try_reserve_exact(slots).ok()?;
    cycle.extend(0..count);
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    for i in (1..slots).rev() {
        // Xorshift; the high half is scaled to 0..i.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        cycle.swap(i, (((state >> 32) * i as u64) >> 32) as usize);
    }
    Some(cycle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycle_visits_every_slot_once() {
        for slots in [1, 2, 3, 64, 4096, 10_007] {
            let cycle = sattolo(slots).unwrap();
            let mut seen = vec![false; slots];
            let mut at = 0;
            for _ in 0..slots {
                assert!(!std::mem::replace(&mut seen[at], true));
                at = cycle[at] as usize;
            }
            assert_eq!(at, 0);
        }
        assert!(sattolo(0).unwrap().is_empty());
    }

    #[test]
    fn a_walk_returns_after_one_lap_and_not_before() {
        let lines = lines(256).unwrap();
        link(&lines).unwrap();
        let first = lines.first().unwrap();
        let end = walk(Some(first), 255).unwrap();
        assert!(!std::ptr::eq(end, first));
        assert!(std::ptr::eq(walk(Some(end), 1).unwrap(), first));
        assert_eq!(size_of::<Line<'_>>(), 64);
        assert!(super::lines(usize::MAX).is_none());
        assert!(sample_ns(Some(first), Duration::ZERO).0 > 0.0);
    }
}
