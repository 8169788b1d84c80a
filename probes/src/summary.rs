//! What a person reads at the end of a probe or a prediction.

use crate::gpus::GpuChoice;
use crate::table::{bytes, columns, count, duration, grouped};
use crate::terminal::{self, Terminal};
use crate::train::{measured_tuning, slice_scenario};
use GpuParameterId::UnifiedMemory;
use sapwise::report::Label;
use sapwise::{Backend, Border, Tuning, GpuHardware, GpuIdentity, Hardware, How, Parameter, Report};
use std::path::Path;

/// The hardware, then the tuning of every scenario that was swept, and the timings of one of them as curves where there is room.
pub(crate) fn report(report: &Report, terminal: Terminal) -> String {
    let mut text = hardware(&report.hardware, terminal);
    for scenario in scenarios(report) {
        match measured_tuning(report, scenario) {
            Ok(measured) => text.push_str(&format!("\n{}", tuning(&measured, terminal))),
            Err(why) => text.push_str(&format!("\n{scenario}: no tuning: {why:#}\n")),
        }
    }
    let chart = terminal::timings(report, slice_scenario(report)).and_then(|chart| chart.draw(terminal));
    text += &chart.map(|chart| format!("\n{chart}")).unwrap_or_default();
    if report.label != Label::RealFull {
        text.push_str(&format!("\nThis report is labelled {}.\n", label(report.label)));
    }
    for remark in &report.remarks {
        text.push_str(&format!("\n{} {remark}\n", terminal.warning("remark:")));
    }
    text
}

/// What to do with a report that was written.
pub(crate) fn next_step(report: &Report, path: &Path) -> String {
    let path = path.display();
    // A report without a sweep, or one that was interrupted early, serves for its hardware only.
    let next = if measured_tuning(report, slice_scenario(report)).is_ok() {
        format!("sapwise run fragmentation --tuning {path}, or sapwise train {path} --out model.json")
    } else {
        format!("sapwise predict --report {path}")
    };
    format!("\nThe report is in {path}. Next: {next}")
}

/// The parameters of a machine, of each of its GPUs and of their groups, as tables.
pub(crate) fn hardware(hardware: &Hardware, terminal: Terminal) -> String {
    let machine = &hardware.machine;
    let mut text = format!(
        "{}, {}, vector instructions: {}\n\n{}",
        machine.cpu,
        machine.arch,
        machine.simd,
        parameters(&hardware.parameters, terminal)
    );
    for GpuHardware { gpu, parameters: list } in &hardware.gpus {
        let GpuIdentity { index, name, driver, api, kind, .. } = gpu;
        text += &format!("\ngpu{index}: {name}, {kind}, {api}, {driver}\n\n{}", parameters(list, terminal));
    }
    for group in &hardware.gpu_groups {
        let name = Backend::Gpu(group.gpus.clone());
        text += &format!("\n{name}, all at the same time\n\n{}", parameters(&group.parameters, terminal));
    }
    text
}

/// What is told of GPUs after a measurement, if anything: that there is none, or which were not taken. What went wrong is
/// told with the remarks.
pub(crate) fn gpus_left_out(
    choice: &GpuChoice,
    hardware: &Hardware,
    left_out: &[GpuIdentity],
    remarks: &[String],
) -> Option<String> {
    let none = !choice.no_gpus && hardware.gpus.is_empty() && left_out.is_empty() && remarks.is_empty();
    none.then(|| "No GPU was found; everything else works on the CPU.".to_owned()).or_else(|| choice.tell(left_out))
}

/// Parameters as a table. Those that are missing for the same reason share a row.
fn parameters(parameters: &[Parameter], terminal: Terminal) -> String {
    let mut rows = vec![["parameter", "value", "spread", "how"].map(str::to_owned).to_vec()];
    let missing = |p: &Parameter| p.how == How::Missing;
    for (k, p) in parameters.iter().enumerate() {
        let alike = |q: &&Parameter| missing(q) && q.source == p.source;
        if missing(p) && parameters[..k].iter().any(|q| alike(&q)) {
            continue;
        }
        let names: Vec<&str> = parameters[k..].iter().filter(alike).map(|q| q.name.as_str()).collect();
        let name = match names.len() {
            0 | 1 => p.name.clone(),
            many => format!("{} and {} more", p.name, many - 1),
        };
        let spread = p.dispersion.map_or(String::new(), |d| format!("{:.1} %", d * 100.0));
        let disturbed = p.foreign_load.filter(|&load| load > 0.05);
        let disturbed = disturbed.map_or(String::new(), |load| format!(", foreign load {:.0} %", load * 100.0));
        let how = match p.how {
            How::Measured => format!("measured, {}{disturbed}", count(p.samples as usize, "sample")),
            How::Reported => "reported".to_owned(),
            How::Published => "published".to_owned(),
            How::Missing => format!("missing: {}", p.source),
        };
        rows.push(vec![name, p.value.map_or("-".to_owned(), |v| value(&p.name, v)), spread, how]);
    }
    terminal.table(&rows)
}

/// The steps of a slice, with where each begins and how sure that is.
pub(crate) fn tuning(tuning: &Tuning, terminal: Terminal) -> String {
    let mut rows = Vec::new();
    for step in &tuning.steps {
        // The first step begins at 0 without a border.
        let border = tuning.crossovers.iter().find(|b| b.above == step.algorithm && b.objects as u32 == step.from_objects);
        let interval = border.and_then(Border::interval).map_or(String::new(), |(low, high)| {
            format!("{} to {}", grouped(low.round() as u64), grouped(high.round() as u64))
        });
        let from = format!("  from {}", grouped(u64::from(step.from_objects)));
        rows.push(vec![from, step.algorithm.to_string(), interval]);
    }
    let told = |b: &Border| b.interval().is_some();
    let with = if tuning.crossovers.iter().any(told) { ", with 90 % intervals" } else { "" };
    let head = format!("{}: the fastest algorithm by number of objects{with}", tuning.scenario);
    let mut text = format!("{}\n", terminal.head(&head));
    text.push_str(&columns(&rows));
    if !tuning.crossovers.iter().all(told) {
        text.push_str(&format!("  {}\n", tuning.interval_basis));
    }
    if !tuning.samples.is_empty() {
        text.push_str(&format!("\nsamples by which the prediction was corrected\n{}", samples(tuning, terminal)));
    }
    for warning in &tuning.warnings {
        text.push_str(&format!("  {} {warning}\n", terminal.warning("warning:")));
    }
    text
}

/// What was timed, beside what had been predicted.
fn samples(tuning: &Tuning, terminal: Terminal) -> String {
    let mut rows = vec![["  algorithm", "objects", "predicted", "measured"].map(str::to_owned).to_vec()];
    rows.extend(tuning.samples.iter().map(|s| {
        let algorithm = format!("  {}", s.algorithm);
        vec![algorithm, grouped(u64::from(s.objects)), duration(s.predicted_ns), duration(s.measured_ns)]
    }));
    terminal.table(&rows)
}

/// A value with the unit that the end of its name says.
pub(crate) fn value(name: &str, value: f64) -> String {
    match name {
        _ if name.ends_with("_gb_per_s") => format!("{value:.1} GB/s"),
        _ if name.ends_with("_gflop_per_s") => format!("{value:.0} GFLOP/s"),
        _ if name.ends_with("_g_per_s") => format!("{value:.2} G/s"),
        _ if name == UNIFIED_MEMORY => if value > 0.0 { "yes" } else { "no" }.to_owned(),
        _ if name.ends_with("_bytes") => bytes(value),
        _ if name.ends_with("_ghz") => format!("{value:.2} GHz"),
        _ if name.ends_with("_ns") && value < 1000.0 => format!("{value:.1} ns"),
        _ if name.ends_with("_ns") => duration(value),
        _ if name.ends_with("_ratio") => format!("{value:.2} x"),
        _ => format!("{value}"),
    }
}

fn scenarios(report: &Report) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for point in &report.points {
        if !names.contains(&point.scenario.as_str()) {
            names.push(&point.scenario);
        }
    }
    names
}

/// The label as it stands in the file.
pub(crate) fn kind(of: Label) -> &'static str {
    label(of).split_once(':').map_or_else(|| label(of), |(kind, _)| kind)
}

/// The label as it stands in the file, and what it means.
fn label(label: Label) -> &'static str {
    match label {
        Label::RealFull => "real_full: a whole machine, undisturbed",
        Label::RealRestricted => "real_restricted: fewer cores or a lower level of vector instructions than the machine has",
        Label::RealContended => "real_contended: other programs took part of the machine",
        Label::RealSoftwareGpu => "real_software_gpu: the GPU is a program on the CPU",
        Label::Simulated => "simulated: made up from a specification",
        Label::Published => "published: parameters from a publication, without timings",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_unit_of_their_name() {
        assert_eq!(value("cache_l2_bytes", 2_097_152.0), "2 MiB");
        assert_eq!(value("bandwidth_one_thread_gb_per_s", 12.345), "12.3 GB/s");
        assert_eq!(value("latency_16_kib_ns", 1.26), "1.3 ns");
        assert_eq!(value("fork_join_cold_ns", 12_500.0), "12.50 us");
        assert_eq!(value("scaling_two_threads_ratio", 1.9), "1.90 x");
        assert_eq!(value("usable_cores", 2.0), "2");
        assert_eq!(value("arithmetic_gflop_per_s", 51_234.5), "51234 GFLOP/s");
        assert_eq!(value("atomic_g_per_s", 0.25), "0.25 G/s");
        assert_eq!(value("unified_memory", 1.0), "yes");
    }
}
