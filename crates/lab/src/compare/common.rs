//! What all of some reports have: the scenarios and algorithms that can be compared.

use crate::Report;
use sapwise::AlgorithmId;
use std::collections::BTreeSet;

/// The reports without the scenarios and algorithms that one of them lacks, and in sentences what that is.
pub(super) fn common(mut reports: Vec<(String, Report)>) -> (Vec<(String, Report)>, Vec<String>) {
    let mut told = Vec::new();
    // A report of the hardware alone has neither, and is compared by its parameters.
    if reports.iter().any(|(_, r)| r.points.is_empty()) {
        for (name, _) in reports.iter().filter(|(_, r)| r.points.is_empty()) {
            told.push(format!("{name} has no timings: parameters alone are compared"));
        }
        reports.iter_mut().for_each(|(_, r)| r.points.clear());
        return (reports, told);
    }
    let scenarios = |r: &Report| r.points.iter().map(|p| p.scenario.clone()).collect();
    let kept = shared(&reports, "scenario", scenarios, &mut told);
    reports.iter_mut().for_each(|(_, r)| r.points.retain(|p| kept.contains(&p.scenario)));
    // Another revision is another algorithm under the same name.
    let algorithms = |r: &Report| {
        let name = |id: &AlgorithmId, revision: u32| format!("{id} (revision {revision})");
        r.algorithms.iter().map(|t| name(&t.id, t.revision)).collect()
    };
    let kept = shared(&reports, "algorithm", algorithms, &mut told);
    for (_, report) in &mut reports {
        report.algorithms.retain(|t| kept.contains(&format!("{} (revision {})", t.id, t.revision)));
        let ids: BTreeSet<&AlgorithmId> = report.algorithms.iter().map(|t| &t.id).collect();
        report.points.iter_mut().for_each(|p| p.timings.retain(|t| ids.contains(&t.algorithm)));
    }
    (reports, told)
}

/// What all reports have of something; what a report lacks of the others is told.
fn shared(
    reports: &[(String, Report)],
    what: &str,
    of: impl Fn(&Report) -> BTreeSet<String>,
    told: &mut Vec<String>,
) -> BTreeSet<String> {
    let each: Vec<BTreeSet<String>> = reports.iter().map(|(_, r)| of(r)).collect();
    let any: BTreeSet<String> = each.iter().flatten().cloned().collect();
    for ((name, _), own) in reports.iter().zip(&each) {
        let lacking: Vec<&str> = any.difference(own).map(String::as_str).collect();
        let plural = if lacking.len() == 1 { "" } else { "s" };
        if !lacking.is_empty() {
            told.push(format!("{name} lacks the {what}{plural} {}: not compared", lacking.join(", ")));
        }
    }
    any.into_iter().filter(|x| each.iter().all(|own| own.contains(x))).collect()
}
