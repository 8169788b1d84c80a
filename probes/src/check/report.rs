//! Checks of a report.

use super::{Finding, Here, privacy};
use crate::gpus::{difference, uses};
use crate::{date, revisions};
use sapwise::algorithm::SimdLevel;
use sapwise_lab::report::{Label, Point, Report};
use sapwise_tune::hardware::ParameterId;
use sapwise_tune::stats::median;
use sapwise_tune::{GpuHardware, Hardware, Parameter};
use std::collections::BTreeSet;

/// Several threads may be up to this factor faster than their number, by a clock that rises between two measurements.
/// Above it, other programs disturbed the measurement of one thread.
const SCALING_TOLERANCE: f64 = 1.1;

/// Above this factor no disturbance explains it.
const IMPOSSIBLE_SCALING: f64 = 2.0;

/// Share of points with foreign load above which a report is doubtful.
const DISTURBED_SHARE: f64 = 0.25;

/// A latency between cores beyond this factor of the usual one is that of another placement of the cores, and the
/// share of points with one above which a report says so.
const MOVED: f64 = 1.5;
const MOVED_SHARE: f64 = 0.1;

impl Here {
    pub(super) fn report(&self, report: &Report, finding: &mut Finding) {
        finding.schema = Some("report/3");
        finding.set_current(revisions::stale_in_report(report, &self.registry), "probe again");
        let impossible = impossible(report);
        finding.sound = impossible.is_empty();
        finding.problems.extend(impossible);
        finding.problems.extend(privacy::revealing(report));
        finding.doubts.extend(doubts(report));
        let same = report.hardware.machine.physical_id == self.machine.physical_id;
        let other_gpus = if same { self.other_gpus(report) } else { Vec::new() };
        finding.applicable = Some(same && other_gpus.is_empty());
        finding.notes.extend(other_gpus);
        let cpu = &report.hardware.machine.cpu;
        finding.notes.push(match (report.label, same) {
            (Label::Published, _) => format!("published parameters without timings, `train` refuses them: {cpu}"),
            (_, true) => "measured on a machine like this one".to_owned(),
            (_, false) => format!("measured on another machine: {cpu}"),
        });
        if !report.provenance.optimised && report.label != Label::Published {
            finding.notes.push("measured by a build without optimisation: `train` refuses it".to_owned());
        }
        finding.notes.extend(moved_cores(report));
        let remarks = report.remarks.iter().filter(|remark| !Report::is_cut_short(remark));
        finding.notes.extend(remarks.map(|r| format!("remark: {r}")));
    }

    /// Returns how the GPUs that a report has timings of differ from those of this machine.
    fn other_gpus(&self, report: &Report) -> Vec<String> {
        let timed: BTreeSet<u32> = report.algorithms.iter().flat_map(|t| uses(&t.id)).copied().collect();
        let there = |k: u32| report.hardware.gpu(k).map(|g| &g.gpu);
        let here = |k: u32| self.gpus().identities.iter().find(|g| g.index == k);
        timed.into_iter().filter_map(|k| difference(there(k), here(k))).collect()
    }
}

/// Returns the figures that are certainly wrong, one sentence each.
fn impossible(report: &Report) -> Vec<String> {
    let hardware = &report.hardware;
    let own = hardware.parameters.iter().chain(hardware.gpus.iter().flat_map(|g| &g.parameters));
    let all = own.chain(hardware.gpu_groups.iter().flat_map(|g| &g.parameters));
    let no_share = all.filter(|p| p.foreign_load.is_some_and(|load| !is_share(load)));
    let mut found: Vec<String> =
        no_share.map(|p| format!("{} has a foreign load of {:?}, which is no share", p.name, p.foreign_load)).collect();
    found.extend(hardware.implausible().map(|why| why.to_string()));
    found.extend(hardware.gpus.iter().filter_map(GpuHardware::implausible).map(|why| why.to_string()));
    found.extend(scaling_beyond_threads(hardware, IMPOSSIBLE_SCALING));
    found.extend(impossible_provenance(report));
    for (k, point) in report.points.iter().enumerate() {
        let at = format!("point {k} ({} at {} objects)", point.scenario, point.load.objects);
        found.extend(impossible_point(hardware, point).map(|what| format!("{at}: {what}")));
    }
    found
}

/// Returns a sentence for each speed-up of several threads that exceeds `tolerance` times their number.
fn scaling_beyond_threads(hardware: &Hardware, tolerance: f64) -> Vec<String> {
    let all = hardware.value(ParameterId::UsableCores);
    let ratios = [(ParameterId::ScalingTwoThreadsRatio, Some(2.0)), (ParameterId::ScalingAllThreadsRatio, all)];
    let beyond = |(id, threads): (ParameterId, Option<f64>)| {
        let threads = threads?;
        let value = hardware.value(id).filter(|value| *value > threads * tolerance)?;
        Some(format!("{id} is {value:.2}, and {threads} threads can't be more than {threads} times as fast as one"))
    };
    ratios.into_iter().filter_map(beyond).collect()
}

fn impossible_provenance(report: &Report) -> Vec<String> {
    let (provenance, hardware) = (&report.provenance, &report.hardware);
    let mut found = Vec::new();
    if !date::is_day(&provenance.date) {
        found.push(format!("the date {:?} is no day as yyyy-mm-dd", provenance.date));
    }
    if report.label == Label::Published {
        return found;
    }
    let samples = report.points.iter().flat_map(|p| &p.timings).flat_map(|t| &t.samples_ns);
    let sum_s = samples.map(|&ns| ns as f64).sum::<f64>() / 1e9;
    // The time is rounded to a tenth.
    if !provenance.seconds.is_finite() || sum_s > provenance.seconds + 0.1 {
        found.push(format!("its samples add up to {sum_s:.1} s, and it took {} s", provenance.seconds));
    }
    if let (Some(threads), Some(cores)) = (provenance.threads, hardware.value(ParameterId::UsableCores))
        && cores > f64::from(threads)
    {
        found.push(format!("usable_cores is {cores}, and the report is of {threads} threads"));
    }
    if let Some(simd) = provenance.simd.as_ref().filter(|simd| **simd != hardware.machine.simd) {
        found.push(format!("{simd} was forced, and {} was in use", hardware.machine.simd));
    }
    if let (Ok(level), Some(lanes)) =
        (hardware.machine.simd.parse::<SimdLevel>(), hardware.value(ParameterId::SimdLanes))
        && lanes != f64::from(level.lanes())
    {
        found.push(format!("simd_lanes is {lanes}, and {level} has {}", level.lanes()));
    }
    found
}

fn impossible_point(hardware: &Hardware, point: &Point) -> Option<String> {
    if point.foreign_load.is_some_and(|load| !is_share(load)) {
        return Some(format!("a foreign load of {:?}, which is no share", point.foreign_load));
    }
    if point.fingerprint.len() != 16 || !point.fingerprint.bytes().all(|b| b.is_ascii_hexdigit()) {
        return Some(format!("the fingerprint {:?} is not of 16 hex digits", point.fingerprint));
    }
    let objects = u128::from(point.load.objects);
    if u128::from(point.pairs) > objects * objects.saturating_sub(1) / 2 {
        return Some(format!("{} pairs, which is more than there are", point.pairs));
    }
    for (k, timing) in point.timings.iter().enumerate() {
        let id = &timing.algorithm;
        if point.timings[..k].iter().any(|t| t.algorithm == *id) {
            return Some(format!("{id} stands there twice"));
        }
        let count = timing.samples_ns.len();
        if (count == 0) != timing.error.is_some() {
            return Some(format!("{id} has {count} samples and the error {:?}", timing.error));
        }
        if hardware.value(ParameterId::UsableCores).is_some_and(|cores| f64::from(id.threads()) > cores) {
            return Some(format!("{id} ran on more threads than the usable cores"));
        }
    }
    None
}

/// Returns why the figures of a report should not be relied on, one sentence each: it was cut short, or other programs
/// disturbed it.
pub(crate) fn doubts(report: &Report) -> Vec<String> {
    let cut_short = report.remarks.iter().filter(|remark| Report::is_cut_short(remark));
    let mut found: Vec<String> =
        cut_short.map(|remark| format!("it was cut short: {remark}; measure again for all of it")).collect();
    found.extend(hardware_doubts(&report.hardware));
    let loads: Vec<f64> = report.points.iter().filter_map(|p| p.foreign_load).collect();
    let disturbed = loads.iter().filter(|&&load| load > Parameter::SPOILING).count();
    if disturbed as f64 > DISTURBED_SHARE * loads.len() as f64 {
        found.push(format!(
            "other programs took over {:.0} % of the CPU at {disturbed} of {} points ({:.0} %); measure again with \
             nothing else running",
            Parameter::SPOILING * 100.0,
            loads.len(),
            disturbed as f64 / loads.len() as f64 * 100.0
        ));
    }
    found
}

/// Returns why hardware parameters should not be relied on, one sentence each.
pub(crate) fn hardware_doubts(hardware: &Hardware) -> Vec<String> {
    let because = "; other programs or the host disturbed the measurement of one thread: measure again with nothing \
                   else running";
    scaling_beyond_threads(hardware, SCALING_TOLERANCE).iter().map(|what| format!("{what}{because}")).collect()
}

/// Returns a sentence if a hypervisor moved the cores of the machine during the sweep: the speed-up of several threads
/// changes with their distance.
fn moved_cores(report: &Report) -> Option<String> {
    let latencies: Vec<[f64; 2]> = report.points.iter().filter_map(|p| p.core_to_core_ns).collect();
    let usual = median(latencies.as_flattened())?;
    let is_usual = |ns: &f64| *ns <= MOVED * usual && usual <= MOVED * ns;
    let elsewhere = latencies.iter().filter(|both| !both.iter().all(is_usual)).count() as f64 / latencies.len() as f64;
    (elsewhere > MOVED_SHARE).then(|| {
        format!(
            "the cores of the machine moved: the latency between them was not near its usual {usual:.0} ns at {:.0} % \
             of the points; timings of several threads differ with it",
            elsewhere * 100.0
        )
    })
}

fn is_share(load: f64) -> bool {
    (0.0..=1.0).contains(&load)
}
