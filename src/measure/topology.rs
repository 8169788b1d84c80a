//! Cores and SIMD lanes.

use std::collections::HashSet;

use super::Options;
use crate::SimdLevel;
use crate::hardware::{Parameter, ParameterId};

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let restricted = if options.threads.is_some() { ", lowered by the caller" } else { "" };
    let source = format!("std::thread::available_parallelism{restricted}");
    vec![
        Parameter::reported(ParameterId::UsableCores, options.usable_cores() as f64, &source),
        physical_cores(),
        Parameter::reported(ParameterId::SimdLanes, f64::from(SimdLevel::in_use().lanes()), "SimdLevel::in_use"),
    ]
}

fn physical_cores() -> Parameter {
    let name = ParameterId::PhysicalCores;
    if let Some(count) = count_sibling_lists(sibling_lists()) {
        return Parameter::reported(name, count as f64, "/sys/devices/system/cpu/cpu*/topology");
    }
    let count = sysinfo::System::physical_core_count().ok();
    let Some(count) = count.filter(|&count| count > 0) else {
        return Parameter::missing(name, "neither sysfs nor sysinfo tells");
    };
    // Some hypervisors report the host's cores to a guest that has fewer.
    let logical = sysinfo::System::new().map_or(0, |mut system| {
        system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
        system.cpus().len()
    });
    if logical > 0 && count > logical {
        let source = format!("sysinfo; {count} cores reported, lowered to the number of threads");
        return Parameter::reported(name, logical as f64, &source);
    }
    Parameter::reported(name, count as f64, "sysinfo")
}

/// For each CPU of Linux the list of hyper-threads that share its core, itself included. Off-line CPUs have none.
fn sibling_lists() -> Vec<String> {
    let Ok(entries) = std::fs::read_dir("/sys/devices/system/cpu") else { return Vec::new() };
    let is_cpu =
        |name: &str| name.strip_prefix("cpu").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    entries
        .filter_map(Result::ok)
        .filter(|entry| entry.file_name().to_str().is_some_and(is_cpu))
        .filter_map(|entry| std::fs::read_to_string(entry.path().join("topology/thread_siblings_list")).ok())
        .collect()
}

/// Cores are as many as there are different lists: core numbers alone repeat from socket to socket.
fn count_sibling_lists(lists: Vec<String>) -> Option<usize> {
    let distinct: HashSet<&str> = lists.iter().map(|list| list.trim()).filter(|list| !list.is_empty()).collect();
    (!distinct.is_empty()).then_some(distinct.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(lists: &[&str]) -> Option<usize> {
        count_sibling_lists(lists.iter().map(|l| (*l).to_owned()).collect())
    }

    #[test]
    fn hyper_threads_count_once() {
        assert_eq!(count(&["0,4\n", "1,5\n", "0,4\n", "1,5\n"]), Some(2));
        assert_eq!(count(&["0\n", "1\n"]), Some(2));
        assert_eq!(count(&["\n"]), None);
        assert_eq!(count(&[]), None);
    }
}
