//! The memory limit that a Linux control group puts on this process.

use std::path::PathBuf;

/// The lowest memory limit of the control groups that hold this process, in bytes. `None` without one, and elsewhere than on Linux.
///
/// The CPU quota needs no code here: `std::thread::available_parallelism` respects it.
pub(super) fn memory_limit() -> Option<u64> {
    let membership = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    limit_files(&membership).iter().filter_map(|path| parse_limit(&std::fs::read_to_string(path).ok()?)).min()
}

/// Where the limits may stand, given the text of `/proc/self/cgroup`: the group itself and every ancestor up to the root.
///
/// A container without a namespace of its own sees the host's path there, which does not exist inside it; its own limit then
/// stands in the root. Looking only at the named group would miss it.
fn limit_files(membership: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for line in membership.lines() {
        let mut tuning = line.splitn(3, ':');
        let (Some(_), Some(controllers), Some(group)) = (tuning.next(), tuning.next(), tuning.next()) else { continue };
        let (mounts, name): (&[&str], _) = if controllers.is_empty() {
            (&["/sys/fs/cgroup", "/sys/fs/cgroup/unified"], "memory.max")
        } else if controllers.split(',').any(|c| c == "memory") {
            (&["/sys/fs/cgroup/memory"], "memory.limit_in_bytes")
        } else {
            continue;
        };
        for mount in mounts {
            let mut relative = group.trim_matches('/');
            loop {
                let mut path = PathBuf::from(mount);
                path.push(relative);
                files.push(path.join(name));
                if relative.is_empty() {
                    break;
                }
                relative = relative.rsplit_once('/').map_or("", |(parent, _)| parent);
            }
        }
    }
    files
}

/// A limit in bytes from the text of `memory.max` or `memory.limit_in_bytes`.
///
/// `None` for `max`, and for what version 1 writes instead: the largest multiple of a page in 63 bits.
fn parse_limit(text: &str) -> Option<u64> {
    text.trim().parse().ok().filter(|bytes| (1..1 << 60).contains(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(membership: &str) -> Vec<String> {
        limit_files(membership).iter().map(|p| p.to_string_lossy().replace('\\', "/")).collect()
    }

    #[test]
    fn version_two_walks_up_to_the_root() {
        let expected = [
            "/sys/fs/cgroup/user.slice/a/memory.max",
            "/sys/fs/cgroup/user.slice/memory.max",
            "/sys/fs/cgroup/memory.max",
            "/sys/fs/cgroup/unified/user.slice/a/memory.max",
            "/sys/fs/cgroup/unified/user.slice/memory.max",
            "/sys/fs/cgroup/unified/memory.max",
        ];
        assert_eq!(paths("0::/user.slice/a\n"), expected);
    }

    #[test]
    fn version_one_takes_the_memory_controller_only() {
        let expected = ["/sys/fs/cgroup/memory/docker/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.limit_in_bytes"];
        assert_eq!(paths("9:cpu,cpuacct:/docker\n4:hugetlb,memory:/docker\n1:name=systemd:/memory"), expected);
    }

    #[test]
    fn text_that_is_no_membership() {
        assert!(paths("").is_empty());
        assert!(paths("memory\n4:memory\n").is_empty());
    }

    #[test]
    fn limits() {
        assert_eq!(parse_limit("536870912\n"), Some(536_870_912));
        assert_eq!(parse_limit("max\n"), None);
        assert_eq!(parse_limit("9223372036854771712\n"), None);
        assert_eq!(parse_limit("0"), None);
        assert_eq!(parse_limit(""), None);
    }
}
