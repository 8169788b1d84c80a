//! The text at the end of a probe or a prediction.

use crate::gpus::GpuChoice;
use crate::prediction::is_whole_slice;
use crate::shell;
use crate::terminal::Terminal;
use sapwise::Tuning;
use sapwise::algorithm::Backend;
use sapwise::tuning::Crossover;
use sapwise_lab::data::usual_scenario;
use sapwise_lab::fit::measured_tuning;
use sapwise_lab::label_text;
use sapwise_lab::report::{Label, Report};
use sapwise_lab::text::{columns, count, grouped, once};
use sapwise_tune::hardware::{ParameterId, with_unit};
use sapwise_tune::{GpuHardware, GpuIdentity, Hardware, How, Model, Parameter};
use std::path::Path;

/// Describes the hardware, then the tuning of every scenario of the sweep.
pub(crate) fn report(report: &Report, terminal: Terminal) -> String {
    let mut text = hardware(&report.hardware, terminal);
    let base = Model::built_in().ok();
    for scenario in once(report.points.iter().map(|p| p.scenario.as_str())) {
        match measured_tuning(report, scenario, base.as_ref()) {
            Ok(measured) => text.push_str(&format!("\n{}", tuning(&measured, terminal))),
            Err(why) => text.push_str(&format!("\n{scenario}: no tuning: {why:#}\n")),
        }
    }
    if report.label != Label::RealFull {
        text.push_str(&format!(
            "\nThis report is labelled {}: {}.\n",
            label_text::kind(report.label),
            label_text::meaning(report.label)
        ));
    }
    for remark in &report.remarks {
        text.push_str(&format!("\n{} {remark}\n", terminal.warning("remark:")));
    }
    text
}

/// Returns the file of a written report and the next command.
pub(crate) fn next_step(report: &Report, path: &Path, gpus: &GpuChoice) -> String {
    let path = shell::path(path);
    // A report without a sweep, or one that was interrupted early, holds little but the hardware.
    let next = if measured_tuning(report, usual_scenario(report), None).is_ok() {
        format!("run fragmentation --tuning {path}{}", gpus.words())
    } else {
        format!("predict --report {path}{}", gpus.words())
    };
    format!("\nThe report is in {path}.\n{}", shell::next(&next))
}

/// Describes the parameters of a machine, of each of its GPUs and of groups of GPUs, as tables.
pub(crate) fn hardware(hardware: &Hardware, terminal: Terminal) -> String {
    let machine = &hardware.machine;
    let mut text = format!(
        "{}, {}, vector instructions: {}\n\n{}",
        machine.cpu,
        machine.arch,
        machine.simd,
        parameters(&hardware.parameters, terminal)
    );
    for GpuHardware { gpu, parameters: list, .. } in &hardware.gpus {
        let GpuIdentity { index, name, driver, api, kind, .. } = gpu;
        text += &format!("\ngpu{index}: {name}, {kind}, {api}, {driver}\n\n{}", parameters(list, terminal));
    }
    for group in &hardware.gpu_groups {
        let name = Backend::Gpu(group.gpus.clone());
        text += &format!("\n{name}, all at the same time\n\n{}", parameters(&group.parameters, terminal));
    }
    text
}

/// Returns a sentence if no GPU was found or some were not used. Failures are among the remarks.
pub(crate) fn gpus_left_out(
    choice: &GpuChoice,
    hardware: &Hardware,
    left_out: &[GpuIdentity],
    remarks: &[String],
) -> Option<String> {
    let none = !choice.no_gpus && hardware.gpus.is_empty() && left_out.is_empty() && remarks.is_empty();
    none.then(|| "No GPU was found; the algorithms on the CPU are not affected.".to_owned())
        .or_else(|| choice.tell(left_out))
}

/// Describes parameters as a table. Those that are missing for the same reason share a row.
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
        let disturbed = disturbed.map_or(String::new(), |load| format!(", {:.0} % foreign", load * 100.0));
        let how = match p.how {
            How::Measured => format!("{}{disturbed}", count(p.samples as usize, "sample")),
            How::Reported => "reported".to_owned(),
            How::Published => "published".to_owned(),
            How::Missing => format!("missing: {}", p.source),
            _ => p.how.to_string(),
        };
        rows.push(vec![name, p.value.map_or("-".to_owned(), |v| with_unit(&p.name, v)), spread, how]);
    }
    terminal.table(&rows)
}

/// Describes a prediction in at most a dozen lines: the machine, the steps of a slice, and one line on all warnings.
pub(crate) fn prediction(hardware: &Hardware, tuning: &Tuning, terminal: Terminal) -> String {
    let machine = &hardware.machine;
    let cores = hardware.value(ParameterId::UsableCores).unwrap_or(1.0) as usize;
    let mut text = format!("{}, {}, {}\n\n", machine.cpu, count(cores, "core"), machine.simd);
    text += &steps(tuning, terminal, false);
    text += "@cpu1: on one thread. A program chooses anew in each frame, by its own boxes.\n";
    let warning = match &tuning.warnings[..] {
        [] => return text,
        many if tuning.extrapolated => {
            let known = tuning.crossovers.iter().any(|b| b.interval().is_some());
            let so = if known { "" } else { ", so no interval is known" };
            format!("this machine is unlike those of the training{so} ({} by --verbose)", count(many.len(), "warning"))
        }
        [only] => only.clone(),
        [first, more @ ..] => format!("{first} ({} more by --verbose)", more.len()),
    };
    text + &format!("{} {warning}\n", terminal.warning("warning:"))
}

/// Describes the steps of a slice, why there are no intervals, and the warnings.
pub(crate) fn tuning(tuning: &Tuning, terminal: Terminal) -> String {
    let mut text = steps(tuning, terminal, true);
    if !tuning.crossovers.iter().all(|b| b.interval().is_some()) {
        text.push_str(&format!("  {}\n", tuning.interval_basis));
    }
    for warning in &tuning.warnings {
        text.push_str(&format!("  {} {warning}\n", terminal.warning("warning:")));
    }
    text
}

/// Describes the steps of a slice, each with its first size and the interval of that size. Without `all`, leaves out a
/// step that costs about the same as the previous one over the whole slice.
fn steps(tuning: &Tuning, terminal: Terminal, all: bool) -> String {
    let mut rows = Vec::new();
    for step in &tuning.steps {
        // The first step begins at 0 without a crossover.
        let crossover =
            tuning.crossovers.iter().find(|b| b.above == step.algorithm && b.objects as u32 == step.from_objects);
        let interval = match crossover.and_then(Crossover::interval) {
            Some(whole) if is_whole_slice(whole) && !all => continue,
            Some(whole) if is_whole_slice(whole) => " (anywhere: both cost about the same)".to_owned(),
            Some((low, high)) => format!(" ({} to {})", grouped(low.round() as u64), grouped(high.round() as u64)),
            None => String::new(),
        };
        let from = format!("  from {}{interval}", grouped(u64::from(step.from_objects)));
        rows.push(vec![from, step.algorithm.to_string()]);
    }
    let told = |b: &Crossover| b.interval().is_some();
    let with = if tuning.crossovers.iter().any(told) { " (90 % intervals)" } else { "" };
    let head = format!("Fastest by number of objects in the scenario {}{with}", tuning.scenario);
    format!("{}\n{}", terminal.head(&head), columns(&rows))
}
