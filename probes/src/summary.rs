//! What a person reads at the end of a probe or a prediction.

use crate::table::{bytes, columns, duration, grouped};
use crate::train::{measured_fields, slice_scenario};
use sapwise::report::Label;
use sapwise::{Fields, Hardware, How, Report};
use std::path::Path;

/// The hardware, then the fields of every scenario that was swept.
pub(crate) fn report(report: &Report) -> String {
    let mut text = hardware(&report.hardware);
    for scenario in scenarios(report) {
        match measured_fields(report, scenario) {
            Ok(measured) => text.push_str(&format!("\n{}", fields(&measured))),
            Err(why) => text.push_str(&format!("\n{scenario}: no fields: {why:#}\n")),
        }
    }
    if report.label != Label::RealFull {
        text.push_str(&format!("\nThis report is labelled {}.\n", label(report.label)));
    }
    for remark in &report.remarks {
        text.push_str(&format!("\nremark: {remark}\n"));
    }
    text
}

/// What to do with a report that was written.
pub(crate) fn next_step(report: &Report, path: &Path) -> String {
    let path = path.display();
    // A report without a sweep, or one that was interrupted early, serves for its hardware only.
    let next = if measured_fields(report, slice_scenario(report)).is_ok() {
        format!("sapwise run fragmentation --fields {path}, or sapwise train {path} --out model.json")
    } else {
        format!("sapwise predict --report {path}")
    };
    format!("\nThe report is in {path}. Next: {next}")
}

/// The parameters of a machine as a table.
pub(crate) fn hardware(hardware: &Hardware) -> String {
    let machine = &hardware.machine;
    let mut rows = vec![["parameter", "value", "spread", "how"].map(str::to_owned).to_vec()];
    for p in &hardware.parameters {
        let spread = p.dispersion.map_or(String::new(), |d| format!("{:.1} %", d * 100.0));
        let disturbed = p.foreign_load.filter(|&load| load > 0.05);
        let disturbed = disturbed.map_or(String::new(), |load| format!(", foreign load {:.0} %", load * 100.0));
        let how = match p.how {
            How::Measured => format!("measured, {} samples{disturbed}", p.samples),
            How::Reported => "reported".to_owned(),
            How::Missing => format!("missing: {}", p.source),
        };
        rows.push(vec![p.name.clone(), p.value.map_or("-".to_owned(), |v| value(&p.name, v)), spread, how]);
    }
    format!("{}, {}, vector instructions: {}\n\n{}", machine.cpu, machine.arch, machine.simd, columns(&rows))
}

/// The steps of a slice, with where each begins and how sure that is.
pub(crate) fn fields(fields: &Fields) -> String {
    let mut rows = Vec::new();
    for step in &fields.steps {
        // The first step begins at 0 without a border.
        let border = fields.crossovers.iter().find(|b| b.above == step.algorithm && b.objects as u32 == step.from_objects);
        let interval = border
            .map_or(String::new(), |b| format!("{} to {}", grouped(b.low.round() as u64), grouped(b.high.round() as u64)));
        let from = format!("  from {}", grouped(u64::from(step.from_objects)));
        rows.push(vec![from, step.algorithm.to_string(), interval]);
    }
    let mut text = format!("{}: the fastest algorithm by number of objects, with 90 % intervals\n", fields.scenario);
    text.push_str(&columns(&rows));
    for warning in &fields.warnings {
        text.push_str(&format!("  warning: {warning}\n"));
    }
    text
}

/// A value with the unit that the end of its name says.
fn value(name: &str, value: f64) -> String {
    match name {
        _ if name.ends_with("_gb_per_s") => format!("{value:.1} GB/s"),
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

/// The label as it stands in the file, and what it means.
fn label(label: Label) -> &'static str {
    match label {
        Label::RealFull => "real_full: a whole machine, undisturbed",
        Label::RealRestricted => "real_restricted: fewer cores or a lower level of vector instructions than the machine has",
        Label::RealContended => "real_contended: other programs took part of the machine",
        Label::RealSoftwareGpu => "real_software_gpu: the GPU is a program on the CPU",
        Label::Simulated => "simulated: made up from a specification",
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
    }
}
