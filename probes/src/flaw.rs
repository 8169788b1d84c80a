//! Flaws for which an existing report is measured again.

use crate::revisions;
use sapwise::Registry;
use sapwise_lab::report::{Label, Report};

/// Returns why a report is not worth keeping, whichever command measured it.
pub(crate) fn flaw(report: &Report, registry: &Registry) -> Option<String> {
    let provenance = &report.provenance;
    if !provenance.optimised && !cfg!(debug_assertions) {
        return Some("it was measured by a build without optimisation".to_owned());
    }
    if let Some(stale) = revisions::stale_in_report(report, registry).first() {
        return Some(format!("it is stale: {stale}"));
    }
    let hardware_only = provenance.command.split(' ').any(|word| word == "--hardware-only");
    if report.points.is_empty() && !hardware_only || report.has_gaps() {
        return Some("it is incomplete".to_owned());
    }
    (report.label == Label::RealContended).then(|| "other programs disturbed it".to_owned())
}
