//! Figures of a report that are impossible, doubtful or suspicious.

use crate::date;
use sapwise::hardware::{ParameterId, with_unit};
use sapwise::measure::Watch;
use sapwise::stats::median;
use sapwise::{GpuHardware, Hardware, How, Parameter, SimdLevel};
use sapwise_lab::report::{Label, Point, Report, Restricted};
use std::collections::BTreeMap;

/// How far several threads may exceed their number, by a clock that rises between two measurements. Beyond that the one thread was disturbed, which a
/// guest does not always see.
const SCALING_TOLERANCE: f64 = 1.1;

/// How far no disturbance takes them.
const IMPOSSIBLE_SCALING: f64 = 2.0;

/// Share of the points with foreign load that is worth a word.
const DISTURBED_SHARE: f64 = 0.25;

/// Dispersion that is worth a word.
const WIDE: f64 = 0.2;

/// What is certain to be wrong, one sentence each.
pub(super) fn impossible(report: &Report) -> Vec<String> {
    let mut found = Vec::new();
    for (of, parameter) in parameters(&report.hardware) {
        found.extend(impossible_parameter(report, &of, parameter));
    }
    found.extend(report.hardware.implausible().map(|why| why.to_string()));
    found.extend(report.hardware.gpus.iter().filter_map(GpuHardware::implausible).map(|why| why.to_string()));
    found.extend(impossible_provenance(report));
    for (k, point) in report.points.iter().enumerate() {
        let at = format!("point {k} ({} at {} objects)", point.scenario, point.load.objects);
        found.extend(impossible_point(report, point).map(|what| format!("{at}: {what}")));
    }
    found.extend(rounds(&report.points));
    found
}

/// Every parameter, with what it is of.
fn parameters(hardware: &Hardware) -> impl Iterator<Item = (String, &Parameter)> {
    let cpu = hardware.parameters.iter().map(|p| (String::new(), p));
    let gpus = hardware.gpus.iter().flat_map(|g| g.parameters.iter().map(|p| (format!(" of gpu{}", g.gpu.index), p)));
    let groups = hardware.gpu_groups.iter();
    let groups = groups.flat_map(|g| g.parameters.iter().map(|p| (format!(" of the GPUs {:?}", g.gpus), p)));
    cpu.chain(gpus).chain(groups)
}

fn impossible_parameter(report: &Report, of: &str, p: &Parameter) -> Option<String> {
    let name = format!("{}{of}", p.name);
    if p.foreign_load.is_some_and(|load| !is_share(load)) {
        return Some(format!("{name} has a foreign load of {:?}, which is no share", p.foreign_load));
    }
    if p.dispersion.is_some_and(|d| !d.is_finite() || d < 0.0) {
        return Some(format!("{name} has a dispersion of {:?}", p.dispersion));
    }
    let value = p.value?;
    let is_rate = p.name.ends_with("_per_s") || p.name.ends_with("_ghz");
    if is_rate && value == 0.0 && p.how == How::Measured {
        return Some(format!("{name} is 0"));
    }
    if p.name == ParameterId::UsableCores && value.fract() != 0.0 {
        return Some(format!("{name} is {value}"));
    }
    scaling_beyond_threads(&report.hardware, p, IMPOSSIBLE_SCALING).map(|what| format!("{what}{of}"))
}

/// What several threads gain over one, where that is more than `tolerance` times their number.
fn scaling_beyond_threads(hardware: &Hardware, p: &Parameter, tolerance: f64) -> Option<String> {
    let threads = match p.name.parse().ok()? {
        ParameterId::ScalingTwoThreadsRatio => 2.0,
        ParameterId::ScalingAllThreadsRatio => hardware.value(ParameterId::UsableCores)?,
        _ => return None,
    };
    let value = p.value.filter(|value| *value > threads * tolerance)?;
    Some(format!("{} is {value:.2}, and {threads} threads can't be more than {threads} times as fast as one", p.name))
}

fn impossible_provenance(report: &Report) -> Vec<String> {
    let (provenance, hardware) = (&report.provenance, &report.hardware);
    let mut found = Vec::new();
    if !date::is_day(&provenance.date) {
        found.push(format!("the date {:?} is no day as yyyy-mm-dd", provenance.date));
    }
    if !is_measured(report) {
        return found;
    }
    let samples = || report.points.iter().flat_map(|p| &p.timings).flat_map(|t| &t.samples_ns);
    let sum_s = samples().map(|&ns| ns as f64).sum::<f64>() / 1e9;
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
    for kind in provenance.restriction.iter().flat_map(|r| &r.kinds) {
        let is_told = match kind {
            Restricted::Threads => provenance.threads.is_some(),
            Restricted::Simd => provenance.simd.is_some(),
            Restricted::ContendedMemory | Restricted::ContendedCache => report.label == Label::RealContended,
            Restricted::GpuThreads => provenance.gpu_threads.is_some(),
        };
        found.extend((!is_told).then(|| format!("the restriction {kind} is not in the rest of its provenance")));
    }
    for proof in provenance.restriction.iter().flat_map(|r| &r.proof) {
        let of_gpu = |k| hardware.gpu(k).and_then(|g| g.value_named(&proof.parameter));
        let own = proof.gpu.map_or_else(|| hardware.value_named(&proof.parameter), of_gpu);
        if proof.with != own {
            let (name, with) = (&proof.parameter, proof.with);
            found.push(format!("the proof of {} has {name} as {with:?}, and the report as {own:?}", proof.kind));
        }
    }
    found
}

fn impossible_point(report: &Report, point: &Point) -> Option<String> {
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
        let cores = report.hardware.value(ParameterId::UsableCores).filter(|_| is_measured(report));
        if cores.is_some_and(|cores| f64::from(id.threads()) > cores) {
            return Some(format!("{id} ran on more threads than the usable cores"));
        }
    }
    None
}

/// The rounds of a scenario end with different frames, but one fingerprint stands for one set of pairs.
fn rounds(points: &[Point]) -> Vec<String> {
    let mut seen: BTreeMap<(&str, usize, &str), u64> = BTreeMap::new();
    let mut found = Vec::new();
    for point in points {
        let objects = point.load.objects as usize;
        let before = *seen.entry((&point.scenario, objects, &point.fingerprint)).or_insert(point.pairs);
        if before != point.pairs {
            let (scenario, pairs, fingerprint) = (&point.scenario, point.pairs, &point.fingerprint);
            found.push(format!(
                "{scenario} at {objects} objects has {before} and {pairs} pairs with one fingerprint, {fingerprint}"
            ));
        }
    }
    found
}

/// How the doubt begins in a report whose measurement ended before its time.
pub(super) const CUT_SHORT: &str = "it was cut short";

/// Why the figures of a report should not be relied on, one sentence each: an end before its time, disturbed points, and a scaling that no machine has.
pub(crate) fn doubts(report: &Report) -> Vec<String> {
    let cut_short = report.remarks.iter().filter(|remark| Report::is_cut_short(remark));
    let mut found: Vec<String> =
        cut_short.map(|remark| format!("{CUT_SHORT}: {remark}; measure again for all of it")).collect();
    found.extend(hardware_doubts(&report.hardware));
    let loads: Vec<f64> = report.points.iter().filter_map(|p| p.foreign_load).collect();
    let disturbed = loads.iter().filter(|&&load| load > Watch::SPOILING).count();
    // Contention that the user asked for is not foreign; what made the label without it is.
    let wanted = report.provenance.command.contains("--contended");
    if !wanted && disturbed as f64 > DISTURBED_SHARE * loads.len() as f64 {
        let share = disturbed as f64 / loads.len() as f64 * 100.0;
        let over = Watch::SPOILING * 100.0;
        let label = if report.label == Label::RealFull { ", although it is labelled real_full" } else { "" };
        found.push(format!(
            "other programs took over {over:.0} % of the CPU at {disturbed} of {} points ({share:.0} %){label}; measure again \
             with nothing else running",
            loads.len()
        ));
    }
    found
}

/// The same of hardware parameters alone.
pub(crate) fn hardware_doubts(hardware: &Hardware) -> Vec<String> {
    let own = hardware.parameters.iter();
    let beyond = own.filter_map(|p| scaling_beyond_threads(hardware, p, SCALING_TOLERANCE));
    beyond
        .map(|what| {
            format!(
                "{what}; other programs or the host disturbed the measurement of one thread: measure again with nothing else running"
            )
        })
        .collect()
}

/// In a sentence that other programs took a share of the CPU while the hardware was measured, if they did.
pub(crate) fn hardware_disturbed(hardware: &Hardware) -> Option<String> {
    let loads: Vec<f64> = hardware.parameters.iter().filter_map(|p| p.foreign_load).collect();
    let load = median(&loads).filter(|&load| load > Watch::SPOILING)?;
    Some(format!(
        "other programs took {:.0} % of the CPU while the hardware was measured (the median over its parameters); predict again when \
         the machine is idle",
        load * 100.0
    ))
}

/// What a maintainer should ask about, one sentence each.
pub(super) fn suspicious(report: &Report) -> Vec<String> {
    let mut found = Vec::new();
    let wide = |(of, p): &(String, &Parameter)| {
        let dispersion = p.dispersion.filter(|&d| d > WIDE)?;
        Some(format!("{}{of} ({:.0} %)", p.name, dispersion * 100.0))
    };
    let wide: Vec<String> = parameters(&report.hardware).filter_map(|p| wide(&p)).collect();
    if !wide.is_empty() {
        found.push(format!("dispersion over {:.0} %: {}", WIDE * 100.0, wide.join(", ")));
    }
    found.extend(contradictions(&report.hardware));
    found
}

/// Pairs of parameters of which one may be in another unit than its name says.
fn contradictions(hardware: &Hardware) -> Vec<String> {
    let [(_, smallest), .., (_, largest)] = ParameterId::LATENCIES;
    // The first is at most so many times the second.
    let most = [
        (ParameterId::CacheL1dBytes, ParameterId::CacheL2Bytes, 1.0),
        (ParameterId::CacheL2Bytes, ParameterId::CacheLlcBytes, 1.0),
        (ParameterId::CacheLlcBytes, ParameterId::MemoryBytes, 1.0),
        (smallest, largest, 1.0),
        (ParameterId::ClockMeasuredGhz, ParameterId::ClockReportedGhz, 10.0),
        (ParameterId::ClockReportedGhz, ParameterId::ClockMeasuredGhz, 10.0),
        (ParameterId::ForkJoinWarmNs, ParameterId::ForkJoinColdNs, 10.0),
    ];
    let contradicts = |&(a, b, factor): &(ParameterId, ParameterId, f64)| {
        let (x, y) = (hardware.value(a)?, hardware.value(b)?);
        (x > y * factor).then(|| {
            let (x, y) = (with_unit(a.as_str(), x), with_unit(b.as_str(), y));
            format!("{a} is {x} and {b} is {y}: one of them may be in another unit")
        })
    };
    most.iter().filter_map(contradicts).collect()
}

/// Whether a machine was measured for it.
fn is_measured(report: &Report) -> bool {
    use Label::{RealContended, RealFull, RealRestricted, RealSoftwareGpu};
    [RealFull, RealRestricted, RealContended, RealSoftwareGpu].contains(&report.label)
}

fn is_share(load: f64) -> bool {
    (0.0..=1.0).contains(&load)
}
