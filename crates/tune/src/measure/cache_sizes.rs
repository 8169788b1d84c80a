//! Cache sizes that the system reports.

use std::collections::BTreeSet;

/// A data cache of the first CPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cache {
    pub(super) level: u8,
    pub(super) bytes: u64,
    /// Known number of them in the machine: a socket of several dies has one last-level cache on each.
    pub(super) instances: u64,
}

/// Where the sizes come from.
pub(super) const SOURCE: &str = "/sys/devices/system/cpu/cpu0/cache, or CPUID leaf 4 or 0x8000001D";

/// Returns the data caches by level, ascending: from sysfs, else from CPUID. Empty if the system has neither.
pub(super) fn reported() -> Vec<Cache> {
    let mut caches = from_sysfs();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if caches.is_empty() {
        caches = from_cpuid();
    }
    caches.sort_by_key(|cache| cache.level);
    caches
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
fn from_cpuid() -> Vec<Cache> {
    use raw_cpuid::CacheType::{Data, Unified};
    let caches = raw_cpuid::CpuId::new().get_cache_parameters();
    let data = caches.into_iter().flatten().filter(|c| matches!(c.cache_type(), Data | Unified));
    data.map(|c| {
        let factors = [c.associativity(), c.physical_line_partitions(), c.coherency_line_size(), c.sets()];
        Cache { level: c.level(), bytes: factors.iter().map(|&f| f as u64).product(), instances: 1 }
    })
    .collect()
}

fn from_sysfs() -> Vec<Cache> {
    let read = |cpu: usize, index: usize, name: &str| {
        std::fs::read_to_string(format!("/sys/devices/system/cpu/cpu{cpu}/cache/index{index}/{name}")).ok()
    };
    let cpus = std::thread::available_parallelism().map_or(1, usize::from);
    let cache = |index| {
        let level = read(0, index, "level")?.trim().parse().ok()?;
        let bytes = parse_size(&read(0, index, "size")?)?;
        let sharers: BTreeSet<String> = (0..cpus).filter_map(|cpu| read(cpu, index, "shared_cpu_list")).collect();
        Some(Cache { level, bytes, instances: sharers.len().max(1) as u64 })
    };
    // No CPU has more than five.
    let is_data = |index: &usize| read(0, *index, "type").is_some_and(|kind| kind.trim() != "Instruction");
    (0..10).filter(is_data).filter_map(cache).collect()
}

/// Bytes from a size of sysfs, such as `48K`.
fn parse_size(text: &str) -> Option<u64> {
    let text = text.trim();
    let (digits, unit) = match (text.strip_suffix('K'), text.strip_suffix('M')) {
        (Some(digits), _) => (digits, 1 << 10),
        (_, Some(digits)) => (digits, 1 << 20),
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
        for wrong in ["0K", "K", "", "99999999999999999999K"] {
            assert_eq!(parse_size(wrong), None, "{wrong}");
        }
    }

    /// Machine ids contain the last-level cache.
    #[cfg(all(target_os = "linux", target_arch = "x86_64"))]
    #[test]
    fn sysfs_and_cpuid_agree() {
        let sizes = |caches: Vec<Cache>| caches.iter().map(|c| (c.level, c.bytes)).collect::<Vec<_>>();
        let sysfs = sizes(from_sysfs());
        assert!(sysfs.is_empty() || sysfs == sizes(from_cpuid()), "{sysfs:?}");
    }
}
