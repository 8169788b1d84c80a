//! What a person reads at the end of a probe.

use crate::sweep::median;
use crate::table::{bytes, columns, duration, grouped};
use sapwise::report::{Label, Point};
use sapwise::{How, Parameter, Report};
use std::path::Path;

/// The hardware, then where each algorithm was the fastest.
pub(crate) fn text(report: &Report) -> String {
    let machine = &report.hardware.machine;
    let mut text = format!("{}, {}, vector instructions: {}\n\n", machine.cpu, machine.arch, machine.simd);
    text.push_str(&hardware(&report.hardware.parameters));
    for scenario in scenarios(&report.points) {
        text.push_str(&format!("\n{scenario}: the fastest algorithm by number of objects\n"));
        text.push_str(&fastest(&report.points, scenario));
    }
    if report.label != Label::RealFull {
        text.push_str(&format!("\nThis report is labelled {}.\n", label(report.label)));
    }
    for remark in &report.remarks {
        text.push_str(&format!("\nremark: {remark}\n"));
    }
    text
}

/// What to do with the report.
pub(crate) fn next_step(report: &Report, path: &Path) -> String {
    let path = path.display();
    let next = if report.points.is_empty() { "predict --report" } else { "train --out model.json" };
    format!("\nThe report is in {path}. Next: sapwise {next} {path}")
}

fn hardware(parameters: &[Parameter]) -> String {
    let mut rows = vec![["parameter", "value", "spread", "how"].map(str::to_owned).to_vec()];
    for p in parameters {
        let spread = p.dispersion.map_or(String::new(), |d| format!("{:.1} %", d * 100.0));
        let how = match p.how {
            How::Measured => format!("measured, {} samples", p.samples),
            How::Reported => "reported".to_owned(),
            How::Missing => format!("missing: {}", p.source),
        };
        rows.push(vec![p.name.clone(), p.value.map_or("-".to_owned(), |v| value(&p.name, v)), spread, how]);
    }
    columns(&rows)
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

fn scenarios(points: &[Point]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for point in points {
        if !names.contains(&point.scenario.as_str()) {
            names.push(&point.scenario);
        }
    }
    names
}

/// One row for each run of sizes with the same fastest algorithm.
fn fastest(points: &[Point], scenario: &str) -> String {
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut before: Option<String> = None;
    for point in points.iter().filter(|p| p.scenario == scenario) {
        let timed = point.timings.iter().filter_map(|t| Some((&t.algorithm, median(&t.samples_ns)?)));
        let Some((best, ns)) = timed.min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        if before.as_deref() != Some(best.to_string().as_str()) {
            before = Some(best.to_string());
            let from = format!("  from {}", grouped(u64::from(point.load.objects)));
            rows.push(vec![from, best.to_string(), format!("{} there", duration(ns))]);
        }
    }
    columns(&rows)
}

/// The label as it stands in the file.
fn label(label: Label) -> &'static str {
    match label {
        Label::RealFull => "real_full",
        Label::RealRestricted => "real_restricted: fewer cores or a lower level of vector instructions than the machine has",
        Label::RealContended => "real_contended: other programs took part of the machine",
        Label::RealSoftwareGpu => "real_software_gpu: the GPU is a program on the CPU",
        Label::Simulated => "simulated",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_unit_of_their_name() {
        assert_eq!(value("cache_l2_bytes", 2_097_152.0), "2 MiB");
        assert_eq!(value("bandwidth_one_thread_gb_per_s", 12.345), "12.3 GB/s");
        assert_eq!(value("latency_16_kib_ns", 1.25), "1.2 ns");
        assert_eq!(value("fork_join_cold_ns", 12_500.0), "12.50 us");
        assert_eq!(value("scaling_two_threads_ratio", 1.9), "1.90 x");
        assert_eq!(value("usable_cores", 2.0), "2");
    }
}
