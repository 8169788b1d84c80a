//! Whether what a file tells about algorithms holds for those of this build.

use sapwise::{Fields, Registry, Report};

/// What keeps the timings of a report from holding for this build, one sentence for each method.
pub(crate) fn stale_in_report(report: &Report, registry: &Registry) -> Vec<String> {
    stale(report.algorithms.iter().map(|t| (t.id.method(), t.revision)), registry)
}

/// The same of fields. Those without costs hold no revisions.
pub(crate) fn stale_in_fields(fields: &Fields, registry: &Registry) -> Vec<String> {
    stale(fields.costs.iter().map(|c| (c.algorithm.method(), c.revision)), registry)
}

/// The methods whose revision is not that of this build.
pub(crate) fn stale<'a>(used: impl Iterator<Item = (&'a str, u32)>, registry: &Registry) -> Vec<String> {
    let mut stale = Vec::new();
    for (method, revision) in used {
        // Every thread count of a method has the same revision, and a machine with other counts has other ids.
        let ours = registry.entries().iter().find(|e| e.id.method() == method).map(|e| e.revision);
        match ours {
            Some(ours) if ours == revision => {}
            Some(ours) => stale.push(format!("{method} has revision {revision} there and {ours} in this build")),
            None => stale.push(format!("{method} is not in this build")),
        }
    }
    stale.sort_unstable();
    stale.dedup();
    stale
}
