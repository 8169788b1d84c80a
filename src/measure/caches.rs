//! Cache sizes that the system reports, and load latencies over growing working sets.
//!
//! The sizes can't be trusted alone: a virtual machine reported a last-level cache of 105 MB and showed no plateau for it.

use std::hint::black_box;
use std::time::{Duration, Instant};

use super::{Options, foreign_load, memory};
use crate::hardware::{Parameter, parameter};

/// `u32`s in a line of 64 bytes.
const LINE: usize = 16;

/// Bytes up to which a chase is walked once, untimed, before each sample. Larger sets would take longer than the sample.
const WALKED_BYTES: usize = 16 << 20;

/// The largest working set of a brief run.
const BRIEF_KIB: u32 = 4096;

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let sizes = reported();
    let level = |name: &str, level: &Option<Level>| match level {
        Some(found) => Parameter::reported(name, found.bytes as f64, sizes.source),
        None => Parameter::missing(name, "neither sysfs nor CPUID tells"),
    };
    let mut parameters = vec![
        level(parameter::CACHE_L1D_BYTES, &sizes.first_level_data),
        level(parameter::CACHE_L2_BYTES, &sizes.second_level),
        level(parameter::CACHE_LLC_BYTES, &sizes.last_level),
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

fn latencies(options: &Options) -> Vec<Parameter> {
    let start = Instant::now();
    let limit = memory::total().map_or(64 << 20, |(bytes, _)| bytes / 8);
    let plan = options.plan(9, 1100);
    // The largest first: building a set streams through the caches, so that the small ones are left in them.
    let mut built: Vec<(String, Result<Chase, String>)> = Vec::new();
    for kib in parameter::LATENCY_WORKING_SETS_KIB.into_iter().rev() {
        let bytes = u64::from(kib) << 10;
        let chase = if bytes > limit {
            Err("the working set exceeds an eighth of memory".to_owned())
        } else if options.brief && kib > BRIEF_KIB {
            Err("left out of a brief run".to_owned())
        } else {
            Chase::new(bytes as usize / (LINE * 4)).ok_or_else(|| "no memory for the working set".to_owned())
        };
        built.push((parameter::latency_name(kib), chase));
    }
    built.reverse();
    let slice = if options.brief { Duration::from_micros(200) } else { Duration::from_millis(3) };
    let sampling = foreign_load::Plan { limit: plan.limit.saturating_sub(start.elapsed()), ..plan };
    let figures = foreign_load::collect(sampling, || {
        built.iter_mut().filter_map(|(_, chase)| chase.as_mut().ok()).map(|chase| chase.sample_ns(slice)).collect()
    });
    let mut figures = figures.into_iter();
    built
        .into_iter()
        .map(|(name, chase)| match chase {
            Ok(chase) => figures.next().unwrap_or_default().into_parameter(&name, chase.method()),
            Err(why) => Parameter::missing(&name, &why),
        })
        .collect()
}

/// A working set of lines, each holding where the next one is.
struct Chase {
    /// The first word of each line is the index of the first word of the next.
    words: Vec<u32>,
    at: u32,
}

impl Chase {
    /// `None` when the memory can't be had, or indices would not fit.
    fn new(lines: usize) -> Option<Self> {
        let words_needed = lines.checked_mul(LINE).filter(|&n| u32::try_from(n).is_ok())?;
        let cycle = sattolo(lines)?;
        let mut words = Vec::new();
        words.try_reserve_exact(words_needed).ok()?;
        for next in cycle {
            words.push(next * LINE as u32);
            words.extend_from_slice(&[0; LINE - 1]);
        }
        Some(Self { words, at: 0 })
    }

    fn lines(&self) -> usize {
        self.words.len() / LINE
    }

    fn is_walked(&self) -> bool {
        self.words.len() * 4 <= WALKED_BYTES
    }

    fn method(&self) -> &'static str {
        if self.is_walked() {
            "dependent loads around a random cycle of 64-byte lines, default pages; set walked once before each sample"
        } else {
            "dependent loads around a random cycle of 64-byte lines, default pages; each sample goes on where the last one stopped"
        }
    }

    /// Follows `steps` links. The next load's address is this load's result, so loads can't overlap.
    fn walk(&mut self, steps: usize) {
        let mut at = self.at;
        for _ in 0..steps {
            // Every word is an index into `words`; the bounds check is beside the chain, not in it.
            at = self.words[at as usize];
        }
        self.at = black_box(at);
    }

    /// Nanoseconds a load, over at least `slice`.
    fn sample_ns(&mut self, slice: Duration) -> f64 {
        const STEPS: usize = 16_384;
        // What the other sets have pushed out of the caches comes back first.
        if self.is_walked() {
            self.walk(self.lines());
        }
        let start = Instant::now();
        let mut steps = 0_u64;
        loop {
            self.walk(STEPS);
            steps += STEPS as u64;
            let elapsed = start.elapsed();
            if elapsed >= slice {
                return elapsed.as_nanos() as f64 / steps as f64;
            }
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
    fn chase_returns_after_one_lap_and_not_before() {
        let mut chase = Chase::new(256).unwrap();
        chase.walk(255);
        assert_ne!(chase.at, 0);
        chase.walk(1);
        assert_eq!(chase.at, 0);
        assert_eq!(chase.lines(), 256);
        assert!(Chase::new(usize::MAX).is_none());
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
