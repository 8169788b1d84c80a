//! Cache sizes that the system reports, and load latencies over growing working sets.
//!
//! The sizes can't be trusted alone: a virtual machine reported a last-level cache of 105 MB and showed no plateau for it.

use std::cell::Cell;
use std::hint::black_box;
use std::time::{Duration, Instant};

use super::{Options, UNDER_LIMIT, foreign_load, memory};
use crate::hardware::{Parameter, ParameterId};

/// Bytes up to which a set is walked once, untimed, before its samples. A lap of a larger one takes longer than its samples.
const WALKED_BYTES: u64 = 64 << 20;

/// The largest working set of a brief run.
const BRIEF_KIB: u32 = 4096;

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let sizes = reported();
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

/// One cache of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Level {
    pub(super) level: u8,
    pub(super) bytes: u64,
    /// How many of them the machine has, as far as it is known: a socket of several dies has one last-level cache on each.
    pub(super) instances: u64,
}

/// The data caches that the first CPU uses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Caches {
    pub(super) first_level_data: Option<Level>,
    pub(super) second_level: Option<Level>,
    pub(super) last_level: Option<Level>,
    source: &'static str,
}

impl Caches {
    fn new(levels: &[Level], source: &'static str) -> Self {
        let at = |wanted| levels.iter().find(|l| l.level == wanted).copied();
        Self {
            first_level_data: at(1),
            second_level: at(2),
            last_level: levels.iter().max_by_key(|l| l.level).copied(),
            source,
        }
    }
}

/// Sizes from sysfs, else from CPUID. Nothing on systems that have neither.
pub(super) fn reported() -> Caches {
    let levels = sysfs_levels();
    if !levels.is_empty() {
        return Caches::new(&levels, "/sys/devices/system/cpu/cpu0/cache");
    }
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        Caches::new(&cpuid_levels(), "CPUID leaf 4 or 0x8000001D")
    }
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    {
        Caches::default()
    }
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
fn cpuid_levels() -> Vec<Level> {
    let cpuid = raw_cpuid::CpuId::new();
    let Some(caches) = cpuid.get_cache_parameters() else { return Vec::new() };
    caches
        .filter(|c| matches!(c.cache_type(), raw_cpuid::CacheType::Data | raw_cpuid::CacheType::Unified))
        .map(|c| {
            let factors = [c.associativity(), c.physical_line_partitions(), c.coherency_line_size(), c.sets()];
            let bytes = factors.iter().fold(1_u64, |product, &f| product.saturating_mul(f as u64));
            Level { level: c.level(), bytes, instances: 1 }
        })
        .collect()
}

fn sysfs_levels() -> Vec<Level> {
    let read = |cpu: usize, index: usize, name: &str| {
        std::fs::read_to_string(format!("/sys/devices/system/cpu/cpu{cpu}/cache/index{index}/{name}")).ok()
    };
    let mut levels = Vec::new();
    // No CPU has more than 5 entries; the bound is there so that a broken file system can't hold us.
    for index in 0..10 {
        let Some(kind) = read(0, index, "type") else { break };
        if kind.trim() == "Instruction" {
            continue;
        }
        let level = read(0, index, "level").and_then(|text| text.trim().parse().ok());
        let bytes = read(0, index, "size").and_then(|text| parse_size(&text));
        let (Some(level), Some(bytes)) = (level, bytes) else { continue };
        let cpus = std::thread::available_parallelism().map_or(1, usize::from);
        let mut shared: Vec<String> = (0..cpus).filter_map(|cpu| read(cpu, index, "shared_cpu_list")).collect();
        shared.sort_unstable();
        shared.dedup();
        levels.push(Level { level, bytes, instances: shared.len().max(1) as u64 });
    }
    levels
}

/// Bytes from a size of sysfs, such as `48K`.
fn parse_size(text: &str) -> Option<u64> {
    let text = text.trim();
    let (digits, unit) = match text.as_bytes().last()? {
        b'K' => (text.get(..text.len() - 1)?, 1 << 10),
        b'M' => (text.get(..text.len() - 1)?, 1 << 20),
        _ => (text, 1),
    };
    digits.parse::<u64>().ok()?.checked_mul(unit).filter(|&bytes| bytes > 0)
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

    #[test]
    fn sizes_of_sysfs() {
        assert_eq!(parse_size("48K\n"), Some(49_152));
        assert_eq!(parse_size("32M"), Some(33_554_432));
        assert_eq!(parse_size("512"), Some(512));
        assert_eq!(parse_size("0K"), None);
        assert_eq!(parse_size("K"), None);
        assert_eq!(parse_size(""), None);
        assert_eq!(parse_size("99999999999999999999K"), None);
    }

    #[test]
    fn last_level_is_the_highest_even_without_a_third() {
        let level = |level, bytes| Level { level, bytes, instances: 1 };
        let caches = Caches::new(&[level(1, 1 << 15), level(2, 1 << 20)], "");
        assert_eq!(caches.last_level, Some(level(2, 1 << 20)));
        assert_eq!(Caches::new(&[], "").last_level, None);
    }
}
