//! Checks of a report.

use super::{Finding, Here, figures, privacy};
use crate::gpus::{difference, uses};
use crate::{date, revisions};
use sapwise_lab::report::{Label, Report};

/// Most bytes of a report that goes into datasets/, which every clone of the repository takes along.
const MOST_BYTES: u64 = 1_000_000;

/// The share of one algorithm in that. A machine of many cores has one for each number of threads, and needs the space.
const MOST_BYTES_EACH: u64 = 125_000;

impl Here {
    pub(super) fn report(&self, report: &Report, bytes: u64, finding: &mut Finding) {
        finding.schema = Some("report/2");
        finding.set_current(revisions::stale_in_report(report, &self.registry), "probe again");
        let impossible = figures::impossible(report);
        finding.sound = impossible.is_empty();
        finding.problems.extend(impossible);
        finding.problems.extend(privacy::revealing(report));
        let most = MOST_BYTES.max(report.algorithms.len() as u64 * MOST_BYTES_EACH);
        if bytes > most {
            finding
                .problems
                .push(format!("it has {bytes} bytes, more than the {most} that a report of so many algorithms may have; measure fewer scenarios"));
        }
        let same = report.hardware.machine.physical_id == self.machine.physical_id;
        let other_gpus = if same { self.other_gpus(report) } else { Vec::new() };
        finding.applicable = Some(same && other_gpus.is_empty());
        finding.notes.extend(other_gpus);
        let cpu = &report.hardware.machine.cpu;
        finding.notes.push(match report.label {
            Label::Simulated => format!("simulated: no evidence of accuracy; {cpu}"),
            Label::Published => format!("published parameters without timings, `train` refuses them: {cpu}"),
            _ if same => "measured on a machine like this one".to_owned(),
            _ => format!("measured on another machine: {cpu}"),
        });
        if !report.provenance.optimised && report.label != Label::Published {
            finding.notes.push("measured by a build without optimisation: `train` refuses it".to_owned());
        }
        // Days as text are in the order of the calendar. A clock may be wrong, so this is no problem.
        if date::is_day(&report.provenance.date) && report.provenance.date > date::today() {
            finding.notes.push(format!("its date is to come: {}", report.provenance.date));
        }
        finding.doubts.extend(figures::doubts(report));
        finding.notes.extend(figures::suspicious(report));
        let remarks = report.remarks.iter().filter(|remark| !Report::is_cut_short(remark));
        finding.notes.extend(remarks.map(|r| format!("remark: {r}")));
    }

    /// How the GPUs that a report has timings of differ from those of this machine.
    fn other_gpus(&self, report: &Report) -> Vec<String> {
        let mut timed: Vec<u32> = report.algorithms.iter().flat_map(|t| uses(&t.id)).copied().collect();
        timed.sort_unstable();
        timed.dedup();
        let there = |k: u32| report.hardware.gpu(k).map(|g| &g.gpu);
        let here = |k: u32| self.gpus().identities.iter().find(|g| g.index == k);
        timed.into_iter().filter_map(|k| difference(there(k), here(k))).collect()
    }
}
