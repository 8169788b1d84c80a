//! Reports of one kind, and how far their times agree.

use crate::data::host;
use crate::report::{Label, Report};
use sapwise::AlgorithmId;
use sapwise_tune::ParameterId;
use sapwise_tune::stats::{median, quantile};
use serde::Serialize;
use std::collections::BTreeMap;

/// A host under a profile. Reports of one kind repeat each other, whether of one machine or of several alike.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[non_exhaustive]
pub struct Kind {
    /// Identity by CPU model, caches and host clock, from [`host`].
    pub host: String,
    /// Name of the CPU.
    pub cpu: String,
    /// Usable cores.
    pub cores: u32,
    /// SIMD level in use.
    pub simd: String,
    /// Names of the GPUs.
    pub gpus: Vec<String>,
    /// Threads of a software adapter, if they were set.
    pub gpu_threads: Option<u32>,
}

impl Kind {
    /// Returns the kind of a report.
    pub fn of(report: &Report) -> Self {
        let (hardware, provenance) = (&report.hardware, &report.provenance);
        let cores = provenance.threads.or_else(|| hardware.value(ParameterId::UsableCores).map(|cores| cores as u32));
        Self {
            host: host(hardware),
            cpu: hardware.machine.cpu.clone(),
            cores: cores.unwrap_or(0),
            simd: hardware.machine.simd.clone(),
            gpus: hardware.gpus.iter().map(|g| g.gpu.name.clone()).collect(),
            gpu_threads: provenance.gpu_threads,
        }
    }
}

/// Returns why a report can't represent the machines of its kind: it is published, was cut short, has gaps or was
/// disturbed.
pub fn unusable(report: &Report) -> Option<&'static str> {
    if report.label == Label::Published {
        Some("it holds published parameters")
    } else if report.is_unfinished() {
        Some("it was cut short")
    } else if report.has_gaps() {
        Some("it has gaps or wrong answers")
    } else if report.label == Label::RealContended {
        Some("other programs disturbed it")
    } else {
        None
    }
}

/// The median times of a report in nanoseconds, by scenario, number of objects and algorithm.
#[derive(Debug, Clone, PartialEq)]
pub struct Times(BTreeMap<(String, u32, AlgorithmId), f64>);

/// The times of a report over the median times of the other reports of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Agreement {
    /// Median of the ratios.
    pub median: f64,
    /// Their lower and upper quartile.
    pub quartiles: [f64; 2],
    /// Number of ratios.
    pub timings: usize,
}

impl Times {
    /// Returns the times of a report.
    pub fn of(report: &Report) -> Self {
        let mut samples: BTreeMap<(String, u32, AlgorithmId), Vec<f64>> = BTreeMap::new();
        for point in &report.points {
            for timing in &point.timings {
                let key = (point.scenario.clone(), point.load.objects, timing.algorithm.clone());
                samples.entry(key).or_default().extend(timing.samples_ns.iter().map(|&ns| ns as f64));
            }
        }
        Self(samples.into_iter().filter_map(|(key, ns)| Some((key, median(&ns)?))).collect())
    }

    /// Compares these times with those of other reports. `None` if the others share no timing with it.
    pub fn over(&self, others: &[&Self]) -> Option<Agreement> {
        let ratio = |(key, ns): (&(String, u32, AlgorithmId), &f64)| {
            let theirs: Vec<f64> = others.iter().filter_map(|other| other.0.get(key).copied()).collect();
            Some(ns / median(&theirs)?)
        };
        let ratios: Vec<f64> = self.0.iter().filter_map(ratio).collect();
        let quartiles = [quantile(&ratios, 0.25)?, quantile(&ratios, 0.75)?];
        Some(Agreement { median: median(&ratios)?, quartiles, timings: ratios.len() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    fn scaled(report: &Report, by: f64) -> Report {
        let mut report = report.clone();
        let samples = report.points.iter_mut().flat_map(|p| &mut p.timings).flat_map(|t| &mut t.samples_ns);
        samples.for_each(|ns| *ns = (*ns as f64 * by) as u64);
        report
    }

    #[test]
    fn a_kind_is_a_host_under_a_profile() {
        let [a, b] = [0, 2].map(|k| Machine::family()[k].report());
        let mut one_thread = a.clone();
        one_thread.provenance.threads = Some(1);
        assert_eq!(Kind::of(&a), Kind::of(&scaled(&a, 2.0)));
        assert!(Kind::of(&a) != Kind::of(&b) && Kind::of(&a) != Kind::of(&one_thread));
    }

    #[test]
    fn times_are_held_against_the_median_of_the_others() {
        let report = Machine::family()[0].report();
        let [own, alike, slow] = [1.0, 1.02, 1.5].map(|by| Times::of(&scaled(&report, by)));
        let found = slow.over(&[&own, &alike]).unwrap();
        assert!((found.median - 1.5 / 1.01).abs() < 0.01 && found.quartiles[0] > 1.4, "{found:?}");
        assert_eq!(own.over(&[&own]).unwrap().quartiles, [1.0, 1.0]);
        assert_eq!(own.over(&[]), None);
    }

    #[test]
    fn what_was_cut_short_or_disturbed_stands_for_no_machine() {
        let whole = Machine::family()[1].report();
        let [mut cut, mut disturbed, mut published] = [(); 3].map(|()| whole.clone());
        cut.remarks.push("interrupted after 3 of 9 scenarios".to_owned());
        disturbed.label = Label::RealContended;
        published.label = Label::Published;
        assert_eq!(unusable(&whole), None);
        assert!([cut, disturbed, published].iter().all(|report| unusable(report).is_some()));
    }
}
