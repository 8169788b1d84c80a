//! How well repeated reports of one profile of a machine agree: parameters, crossovers, and what the tuning of one costs on another.

mod common;
mod crossovers;
mod losses;
mod parameters;
mod text;

use crate::data::host;
use crate::report::{Label, Report};
use crate::steadiness::Steadiness;
use anyhow::{Result, bail};
use serde::Serialize;

pub use crossovers::CrossoverSpread;
pub use losses::Losses;
pub use parameters::ParameterSpread;

/// What a comparison finds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    /// Number of reports.
    pub reports: usize,
    /// In sentences, what some of the reports lack, which is not compared.
    pub not_compared: Vec<String>,
    /// Highest share of the CPU that other programs took at half of the points of a report; `None` where it can't be told.
    pub foreign_load: Option<f64>,
    /// The latency between cores over the points of each report, where it is known.
    pub steadiness: Vec<Option<Steadiness>>,
    /// Every measured parameter that all reports have.
    pub parameters: Vec<ParameterSpread>,
    /// Every crossover that lies in at least half of the reports.
    pub crossovers: Vec<CrossoverSpread>,
    /// `None` where the reports hold no timings.
    pub losses: Option<Losses>,
}

impl Comparison {
    /// Compares what all of the reports have, given with the names of their files. They need not be of the same command: a quick report and
    /// a full one share scenarios and algorithms.
    ///
    /// # Errors
    /// When there are fewer than two, or two differ in machine or restriction: then what differs is not the measurement.
    pub fn of(reports: Vec<(String, Report)>) -> Result<Self> {
        let [(first_name, first), rest @ ..] = &reports[..] else { bail!("no report is given") };
        if rest.is_empty() {
            bail!("one report can't be compared; give two or more of the same machine and the same restriction");
        }
        for (name, report) in rest {
            if let Some(difference) = difference(first, report) {
                bail!(
                    "{name} and {first_name} differ in {difference}: give reports of the same machine with the same restriction"
                );
            }
        }
        if let Some((name, _)) = reports.iter().find(|(_, r)| r.is_unfinished()) {
            bail!("{name} was not finished; remove it and measure it again");
        }
        let foreign_load = reports.iter().filter_map(|(_, r)| r.foreign_load()).max_by(f64::total_cmp);
        let steadiness = reports.iter().map(|(_, r)| Steadiness::of(r)).collect();
        let (reports, not_compared) = common::common(reports);
        let all: Vec<&Report> = reports.iter().map(|(_, report)| report).collect();
        Ok(Self {
            reports: all.len(),
            not_compared,
            foreign_load,
            steadiness,
            parameters: parameters::spreads(&all),
            crossovers: crossovers::crossovers(&all),
            losses: losses::losses(&reports),
        })
    }
}

/// Of reports those during which the cores of the machine stayed where they were, in the place where most of these found them, and the
/// names of the others.
#[must_use]
pub fn steady(reports: Vec<(String, Report)>) -> (Vec<(String, Report)>, Vec<String>) {
    let all: Vec<Steadiness> = reports.iter().filter_map(|(_, r)| Steadiness::of(r)).collect();
    let alike = |s: &Steadiness| all.iter().filter(|other| other.is_like(*s)).count();
    let Some(most) = all.iter().copied().max_by_key(|s| alike(s)) else { return (reports, Vec::new()) };
    let (kept, others): (Vec<_>, Vec<_>) =
        reports.into_iter().partition(|(_, r)| Steadiness::of(r).is_some_and(|s| s.is_like(most)));
    (kept, others.into_iter().map(|(name, _)| name).collect())
}

/// In what two reports differ that no measurement changes.
fn difference(a: &Report, b: &Report) -> Option<&'static str> {
    let (x, y) = (&a.hardware.machine, &b.hardware.machine);
    let taken = |r: &Report| r.provenance.restriction.as_ref().map_or(Vec::new(), |r| r.kinds.clone());
    let contended = |r: &Report| r.label == Label::RealContended;
    let gpu = |r: &Report, index: u32| r.hardware.gpus.iter().find(|g| g.gpu.index == index).map(|g| g.gpu.clone());
    let other_gpu = |index: u32| gpu(a, index).zip(gpu(b, index)).is_some_and(|(a, b)| a != b);
    let same = [
        (host(&a.hardware) == host(&b.hardware), "the physical machine"),
        (x.simd == y.simd, "the SIMD level"),
        (a.provenance.threads == b.provenance.threads, "the number of threads"),
        (a.provenance.gpu_threads == b.provenance.gpu_threads, "the threads of a software adapter"),
        (taken(a) == taken(b) && contended(a) == contended(b), "what was taken from the machine"),
        (!a.hardware.gpus.iter().any(|g| other_gpu(g.gpu.index)), "the GPUs"),
    ];
    same.into_iter().find(|(same, _)| !same).map(|(_, what)| what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    fn named(report: Report) -> (String, Report) {
        ("r.json".to_owned(), report)
    }

    #[test]
    fn the_same_report_twice_agrees_with_itself() {
        let report = Machine::family()[2].report();
        let comparison = Comparison::of(vec![named(report.clone()), named(report)]).unwrap();
        assert!(!comparison.parameters.is_empty() && !comparison.crossovers.is_empty());
        assert!(comparison.parameters.iter().all(|s| s.low == s.high));
        assert!(
            comparison.crossovers.iter().all(|b| b.largest_deviation == 0.0 && b.own_interval_holds_median == 1.0),
            "{:?}",
            comparison.crossovers
        );
        let losses = comparison.losses.unwrap();
        assert!(losses.own.abs() < 0.02 && (losses.others - losses.own).abs() < 1e-12, "{losses:?}");
    }

    #[test]
    fn reports_of_different_machines_or_restrictions_are_refused() {
        let [a, b] = [0, 1].map(|k| Machine::family()[k].report());
        let error =
            |x: &Report, y: &Report| Comparison::of(vec![named(x.clone()), named(y.clone())]).unwrap_err().to_string();
        assert!(error(&a, &b).contains("the physical machine"));
        let mut fewer = a.clone();
        fewer.provenance.threads = Some(1);
        assert!(error(&a, &fewer).contains("the number of threads"));
        let (mut contended, mut cut) = (a.clone(), a.clone());
        contended.label = Label::RealContended;
        cut.remarks.push("interrupted before the first point".to_owned());
        assert!(error(&a, &contended).contains("what was taken"));
        assert!(error(&a, &cut).contains("not finished"));
        assert!(Comparison::of(vec![named(a)]).unwrap_err().to_string().contains("two or more"));
    }

    #[test]
    fn of_a_quick_and_a_full_report_what_both_have_is_compared() {
        let full = Machine::family()[2].report();
        let mut quick = full.clone();
        quick.provenance.command = "probe --quick".to_owned();
        quick.points.retain(|p| p.scenario == "uniform");
        let sap = |id: &sapwise::AlgorithmId| id.method() == "sap";
        quick.algorithms.retain(|t| !sap(&t.id));
        quick.points.iter_mut().for_each(|p| p.timings.retain(|t| !sap(&t.algorithm)));
        let all = Comparison::of(vec![("full.json".to_owned(), full), ("quick.json".to_owned(), quick)]).unwrap();
        assert!(
            all.crossovers.iter().all(|b| b.scenario == "uniform" && b.largest_deviation == 0.0)
                && !all.crossovers.is_empty()
        );
        assert!(all.crossovers.iter().all(|b| b.below.method() != "sap" && b.above.method() != "sap"));
        let told = all.not_compared.join("\n");
        assert!(told.contains("quick.json lacks the scenario clustered") && told.contains("sap@cpu1"), "{told}");
        assert!(all.losses.unwrap().beyond_own.abs() < 1e-12);
    }

    #[test]
    fn steady_reports_are_those_of_the_commonest_placement() {
        let report = |latency: f64| {
            let mut report = Machine::family()[2].report();
            report.points.iter_mut().for_each(|p| p.core_to_core_ns = Some([latency, latency]));
            report
        };
        let mut moved = report(23.0);
        moved.points.iter_mut().step_by(2).for_each(|p| p.core_to_core_ns = Some([175.0, 175.0]));
        let all = [("a", report(23.0)), ("b", report(170.0)), ("c", moved), ("d", report(25.0))];
        let (kept, others) = steady(all.map(|(name, r)| (name.to_owned(), r)).into());
        assert_eq!(kept.iter().map(|k| k.0.as_str()).collect::<Vec<_>>(), ["a", "d"]);
        assert_eq!(others, ["b", "c"]);
    }

    #[test]
    fn a_machine_that_changed_is_seen_in_all_three() {
        let steady = Machine::family()[2].report();
        let mut changed = steady.clone();
        changed.hardware.parameters.iter_mut().filter_map(|p| p.value.as_mut()).for_each(|v| *v *= 1.2);
        for timing in changed.points.iter_mut().flat_map(|p| &mut p.timings) {
            if timing.algorithm.threads() > 1 {
                timing.samples_ns.iter_mut().for_each(|ns| *ns = *ns * 3 / 2);
            }
        }
        let comparison = Comparison::of(vec![named(steady), named(changed)]).unwrap();
        assert!(comparison.parameters.iter().all(|s| s.high > 1.15 * s.low));
        let moved = comparison.crossovers.iter().filter(|b| b.above.threads() != b.below.threads());
        assert!(moved.map(|b| b.largest_deviation).fold(0.0, f64::max) > 0.1, "{:?}", comparison.crossovers);
        assert!(comparison.losses.unwrap().others > 0.01);
    }
}
