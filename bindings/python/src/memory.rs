//! How many pairs a frame may have where the caller sets no limit.

/// Free memory for each pair. A list of pairs takes 8 bytes each, twice while it grows and once more for NumPy; and the tasks of a frame
/// on several threads may hold many lists, each of up to the limit.
const BYTES_A_PAIR: u64 = 256;

/// As many pairs as a part of the memory that is free now takes, so that a scene of which all boxes meet is an exception and not the end of
/// the process. `None` where the system does not tell.
pub(crate) fn most_pairs() -> Option<usize> {
    let available = available(&std::fs::read_to_string("/proc/meminfo").ok()?)?;
    let free = cgroup_left().map_or(available, |left| left.min(available));
    usize::try_from(free / BYTES_A_PAIR).ok().map(|pairs| pairs.max(1))
}

/// `MemAvailable`, in bytes.
fn available(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// What the control group of this process leaves, where it has a limit (version 2).
fn cgroup_left() -> Option<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let path = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    let read = |file: &str| {
        let text = std::fs::read_to_string(format!("/sys/fs/cgroup{path}/{file}")).ok()?;
        text.trim().parse::<u64>().ok()
    };
    // "max" is no number, and no limit.
    Some(read("memory.max")?.saturating_sub(read("memory.current")?))
}
