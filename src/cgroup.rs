//! The limits that Linux control groups put on this process.

use std::path::PathBuf;

/// A limit: the controller that has it, and its file in version 2 and in version 1 of control groups.
struct Limit {
    controller: &'static str,
    file: &'static str,
    old_file: &'static str,
}

const CPU: Limit = Limit { controller: "cpu", file: "cpu.max", old_file: "cpu.cfs_quota_us" };
#[cfg(feature = "measure")]
const MEMORY: Limit = Limit { controller: "memory", file: "memory.max", old_file: "memory.limit_in_bytes" };

/// Whether a control group that holds this process limits its time on the CPUs, whichever those are. `false` without one, where that can't
/// be told, and elsewhere than on Linux.
///
/// How many threads such a quota is worth needs no code here: `std::thread::available_parallelism` respects it.
pub(crate) fn has_cpu_quota() -> bool {
    CPU.texts().iter().any(|text| is_quota(text))
}

/// The lowest memory limit of the control groups that hold this process, in bytes. `None` without one, and elsewhere than on Linux.
#[cfg(feature = "measure")]
pub(crate) fn memory_limit() -> Option<u64> {
    MEMORY.texts().iter().filter_map(|text| parse_limit(text)).min()
}

impl Limit {
    /// What stands in the files of the limit.
    fn texts(&self) -> Vec<String> {
        let membership = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
        self.files(&membership).iter().filter_map(|path| std::fs::read_to_string(path).ok()).collect()
    }

    /// Where the limit may stand, given the text of `/proc/self/cgroup`: the group itself and every ancestor up to the root.
    ///
    /// A container without a namespace of its own sees the host's path there, which does not exist inside it; its own limit then
    /// stands in the root. Looking only at the named group would miss it.
    fn files(&self, membership: &str) -> Vec<PathBuf> {
        let mut files = Vec::new();
        for line in membership.lines() {
            let mut fields = line.splitn(3, ':');
            let (Some(_), Some(controllers), Some(group)) = (fields.next(), fields.next(), fields.next()) else {
                continue;
            };
            let (mounts, name) = if controllers.is_empty() {
                (vec!["", "unified"], self.file)
            } else if controllers == self.controller {
                (vec![controllers], self.old_file)
            } else if controllers.split(',').any(|c| c == self.controller) {
                // Mounted under all their names, and most often linked to from each of them.
                (vec![controllers, self.controller], self.old_file)
            } else {
                continue;
            };
            for mount in mounts {
                let mut relative = group.trim_matches('/');
                loop {
                    files.push(
                        ["/sys/fs/cgroup", mount, relative, name].iter().filter(|part| !part.is_empty()).collect(),
                    );
                    if relative.is_empty() {
                        break;
                    }
                    relative = relative.rsplit_once('/').map_or("", |(parent, _)| parent);
                }
            }
        }
        files
    }
}

/// Whether the text of `cpu.max` or `cpu.cfs_quota_us` is a quota: they say `max` or -1 where there is none.
fn is_quota(text: &str) -> bool {
    text.split_whitespace().next().and_then(|quota| quota.parse::<i64>().ok()).is_some_and(|quota| quota > 0)
}

/// A limit in bytes from the text of `memory.max` or `memory.limit_in_bytes`.
///
/// `None` for `max`, and for what version 1 writes instead: the largest multiple of a page in 63 bits.
#[cfg(feature = "measure")]
fn parse_limit(text: &str) -> Option<u64> {
    text.trim().parse().ok().filter(|bytes| (1..1 << 60).contains(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MEMORY: Limit = Limit { controller: "memory", file: "memory.max", old_file: "memory.limit_in_bytes" };

    fn paths(limit: &Limit, membership: &str) -> Vec<String> {
        limit.files(membership).iter().map(|p| p.to_string_lossy().replace('\\', "/")).collect()
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
        assert_eq!(paths(&MEMORY, "0::/user.slice/a\n"), expected);
    }

    #[test]
    fn version_one_takes_the_controller_of_the_limit_only() {
        let membership = "9:cpu,cpuacct:/docker\n4:hugetlb,memory:/docker\n3:cpuset:/\n1:name=systemd:/memory";
        let at = |mounts: [&str; 2], name: &str| -> Vec<String> {
            let of =
                |mount| [format!("/sys/fs/cgroup/{mount}/docker/{name}"), format!("/sys/fs/cgroup/{mount}/{name}")];
            mounts.into_iter().flat_map(of).collect()
        };
        assert_eq!(paths(&MEMORY, membership), at(["hugetlb,memory", "memory"], "memory.limit_in_bytes"));
        assert_eq!(paths(&CPU, membership), at(["cpu,cpuacct", "cpu"], "cpu.cfs_quota_us"));
        assert_eq!(paths(&CPU, "1:cpu:/\n"), ["/sys/fs/cgroup/cpu/cpu.cfs_quota_us"]);
    }

    #[test]
    fn text_that_is_no_membership() {
        assert!(paths(&MEMORY, "").is_empty());
        assert!(paths(&MEMORY, "memory\n4:memory\n").is_empty());
    }

    #[test]
    fn quotas() {
        for text in ["50000 100000\n", "400000 100000", "20000\n"] {
            assert!(is_quota(text), "{text}");
        }
        for text in ["max 100000\n", "-1\n", "", "0"] {
            assert!(!is_quota(text), "{text}");
        }
    }

    #[cfg(feature = "measure")]
    #[test]
    fn limits() {
        assert_eq!(parse_limit("536870912\n"), Some(536_870_912));
        assert_eq!(parse_limit("max\n"), None);
        assert_eq!(parse_limit("9223372036854771712\n"), None);
        assert_eq!(parse_limit("0"), None);
        assert_eq!(parse_limit(""), None);
    }
}
