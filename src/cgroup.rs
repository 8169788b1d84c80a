//! The CPU quota of the cgroup that holds this process.

/// Returns whether a quota allows less time than the CPUs on which this thread may run. Always false except on Linux.
pub(crate) fn has_cpu_quota() -> bool {
    // Linux: the least of affinity and quota, the quota rounded down.
    let allowed = std::thread::available_parallelism().map_or(usize::MAX, usize::from);
    cfg!(target_os = "linux") && allowed < core_affinity::get_core_ids().map_or(0, |cpus| cpus.len())
}
