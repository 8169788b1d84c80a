//! The default limit on the pairs of a frame.

/// Free memory for each pair. A list takes 8 bytes a pair, twice that while it grows, and once more for NumPy. With
/// several threads, each task may hold a list of up to the limit.
const BYTES_A_PAIR: u64 = 256;

/// Returns the default limit: one pair for each [`BYTES_A_PAIR`] of free memory. So a scene in which all boxes meet
/// raises an exception and does not end the process. `None` if the system does not report its free memory.
pub(crate) fn most_pairs() -> Option<usize> {
    let available = available(&std::fs::read_to_string("/proc/meminfo").ok()?)?;
    let free = cgroup_left().map_or(available, |left| left.min(available));
    usize::try_from(free / BYTES_A_PAIR).ok().map(|pairs| pairs.max(1))
}

/// Reads `MemAvailable`, in bytes.
fn available(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// Returns the memory that the control group of this process (version 2) leaves, if it has a limit.
fn cgroup_left() -> Option<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let path = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    let read = |file: &str| {
        let text = std::fs::read_to_string(format!("/sys/fs/cgroup{path}/{file}")).ok()?;
        text.trim().parse::<u64>().ok()
    };
    // "max", no limit, is no number.
    Some(read("memory.max")?.saturating_sub(read("memory.current")?))
}
