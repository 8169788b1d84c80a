//! How well repeated reports of one profile of a machine agree: parameters, borders, and what the tuning of one lose on another.

mod borders;
mod losses;
mod parameters;

use crate::steadiness::Steadiness;
use anyhow::{Result, bail};
use sapwise::Report;
use serde::Serialize;

pub(crate) use borders::{Border, STEEP};
pub(crate) use losses::Losses;
pub(crate) use parameters::Spread;

/// What a comparison finds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Comparison {
    /// Number of reports.
    pub(crate) reports: usize,
    /// Highest share of the CPU that other programs took at half of the points of a report; `None` where it can't be told.
    pub(crate) foreign_load: Option<f64>,
    /// The latency between cores over the points of each report, where it is known.
    pub(crate) steadiness: Vec<Option<Steadiness>>,
    /// Every measured parameter that all reports have.
    pub(crate) parameters: Vec<Spread>,
    /// Every border that lies in at least half of the reports.
    pub(crate) borders: Vec<Border>,
    /// `None` where the reports hold no timings.
    pub(crate) losses: Option<Losses>,
}

impl Comparison {
    /// Compares reports, given with the names of their files.
    ///
    /// # Errors
    /// When there are fewer than two, or two differ in machine or restriction: then what differs is not the measurement.
    pub(crate) fn of(reports: &[(String, Report)]) -> Result<Self> {
        let [(first_name, first), rest @ ..] = reports else { bail!("no report is given") };
        if rest.is_empty() {
            bail!("one report can't be compared; give two or more of the same machine and the same restriction");
        }
        for (name, report) in rest {
            if let Some(difference) = difference(first, report) {
                bail!(
                    "{name} and {first_name} differ in {difference}: give reports that were made by the same command on the same machine"
                );
            }
        }
        if let Some((name, _)) = reports.iter().find(|(_, r)| is_unfinished(r)) {
            bail!("{name} was not finished; remove it and measure it again");
        }
        let all: Vec<&Report> = reports.iter().map(|(_, report)| report).collect();
        Ok(Self {
            reports: all.len(),
            foreign_load: all.iter().filter_map(|r| load(r)).max_by(f64::total_cmp),
            steadiness: all.iter().map(|r| Steadiness::of(r)).collect(),
            parameters: parameters::spreads(&all),
            borders: borders::borders(&all),
            losses: losses::losses(reports),
        })
    }
}

/// Of reports those during which the cores of the machine stayed where they were, in the place where most of these found them, and the
/// names of the others.
pub(crate) fn steady(reports: Vec<(String, Report)>) -> (Vec<(String, Report)>, Vec<String>) {
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
    let same = [
        (x.physical_id == y.physical_id, "the physical machine"),
        (x.simd == y.simd, "the SIMD level"),
        (a.provenance.threads == b.provenance.threads, "the number of threads"),
        (a.provenance.gpu_threads == b.provenance.gpu_threads, "the threads of a GPU that is a program"),
        (without_seed(a) == without_seed(b), "the command"),
        (a.hardware.gpus.iter().map(|g| &g.gpu).eq(b.hardware.gpus.iter().map(|g| &g.gpu)), "the GPUs"),
    ];
    same.into_iter().find(|(same, _)| !same).map(|(_, what)| what)
}

/// The words of the command; another seed is another measurement of the same.
fn without_seed(report: &Report) -> Vec<&str> {
    let words: Vec<&str> = report.provenance.command.split_whitespace().collect();
    let seed = words.iter().position(|w| *w == "--seed");
    let kept = |k: &usize| seed.is_none_or(|seed| *k != seed && *k != seed + 1);
    (0..words.len()).filter(kept).map(|k| words[k]).collect()
}

/// Whether a report was cut short, as its remarks say.
fn is_unfinished(report: &Report) -> bool {
    report.remarks.iter().any(|r| r.starts_with("unfinished") || r.starts_with("interrupted"))
}

/// The foreign load at half of the points, or that of the parameters where there are none.
fn load(report: &Report) -> Option<f64> {
    let mut loads: Vec<f64> = report.points.iter().filter_map(|p| p.foreign_load).collect();
    if loads.is_empty() {
        loads = report.hardware.parameters.iter().filter_map(|p| p.foreign_load).collect();
    }
    sapwise::stats::median(&loads)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::synthetic::Machine;

    fn named(report: Report) -> (String, Report) {
        ("r.json".to_owned(), report)
    }

    #[test]
    fn the_same_report_twice_agrees_with_itself() {
        let report = Machine::family()[2].report();
        let comparison = Comparison::of(&[named(report.clone()), named(report)]).unwrap();
        assert!(!comparison.parameters.is_empty() && !comparison.borders.is_empty());
        assert!(comparison.parameters.iter().all(|s| s.low == s.high));
        assert!(comparison.borders.iter().all(|b| b.spread == 0.0 && b.within == 1.0), "{:?}", comparison.borders);
        let losses = comparison.losses.unwrap();
        assert!(losses.own.abs() < 0.02 && (losses.others - losses.own).abs() < 1e-12, "{losses:?}");
    }

    #[test]
    fn reports_of_different_machines_or_restrictions_are_refused() {
        let [a, b] = [0, 1].map(|k| Machine::family()[k].report());
        let error = |x: &Report, y: &Report| Comparison::of(&[named(x.clone()), named(y.clone())]).unwrap_err().to_string();
        assert!(error(&a, &b).contains("the physical machine"));
        let mut fewer = a.clone();
        fewer.provenance.threads = Some(1);
        assert!(error(&a, &fewer).contains("the number of threads"));
        let (mut seeded, mut quick, mut cut) = (a.clone(), a.clone(), a.clone());
        seeded.provenance.command = "probe --seed 7".to_owned();
        quick.provenance.command = "probe --quick --seed 7".to_owned();
        cut.remarks.push("interrupted before the first point".to_owned());
        assert!(error(&seeded, &quick).contains("the command"));
        assert!(error(&a, &cut).contains("not finished"));
        quick.provenance.command = "probe --seed 8".to_owned();
        assert!(Comparison::of(&[named(seeded), named(quick)]).is_ok());
        assert!(Comparison::of(&[named(a)]).unwrap_err().to_string().contains("two or more"));
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
        let comparison = Comparison::of(&[named(steady), named(changed)]).unwrap();
        assert!(comparison.parameters.iter().all(|s| s.high > 1.15 * s.low));
        let moved = comparison.borders.iter().filter(|b| b.above.threads() != b.below.threads());
        assert!(moved.map(|b| b.spread).fold(0.0, f64::max) > 0.1, "{:?}", comparison.borders);
        assert!(comparison.losses.unwrap().others > 0.01);
    }
}
