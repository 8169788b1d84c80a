//! Cache sizes that the system reports.

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
    /// Who says so.
    pub(super) source: &'static str,
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

#[cfg(test)]
mod tests {
    use super::*;

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
