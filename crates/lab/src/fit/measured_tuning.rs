//! The tuning of one machine, from its own report.

use crate::data::Profile;
use crate::fit::measured_costs::{FEWEST_POINTS, measured_costs_over};
use crate::paired::{PairedRatio, PairedSamples};
use crate::report::Report;
use anyhow::{Result, bail};
use sapwise::algorithm::Load;
use sapwise::tuning::{AlgorithmCost, Crossover, Source};
use sapwise::{AlgorithmId, Tuning};
use sapwise_tune::Model;
use std::collections::BTreeSet;

/// Returns the tuning of the machine of a report, with steps and crossovers for `scenario`.
///
/// The costs are those that `base` predicts, or of a model that is fitted to the report alone for algorithms that
/// `base` lacks; the timings of all scenarios correct them. A crossover gets its interval from paired samples if both
/// neighbours were timed in `scenario`.
///
/// # Errors
/// When no point of `scenario`, or no algorithm, has enough timings; names the scenarios there are.
pub fn measured_tuning(report: &Report, scenario: &str, base: Option<&Model>) -> Result<Tuning> {
    let profile = Profile::of("", report);
    let loads = measured_slice(&profile, scenario)?;
    let (costs, warnings) = measured_costs_over(&profile, base);
    let mut tuning = slice_tuning(costs, scenario, &loads)?;
    tuning.warnings = warnings;
    if !report.provenance.optimised {
        tuning.warnings.push("the report was timed by an unoptimised build".to_owned());
    }
    measure_crossovers(&mut tuning, report);
    Ok(tuning)
}

/// Returns the tuning of measured costs, with steps and crossovers through these loads.
///
/// # Errors
/// When there are no costs.
pub fn slice_tuning(costs: Vec<AlgorithmCost>, scenario: &str, loads: &[Load]) -> Result<Tuning> {
    if costs.is_empty() {
        bail!("no algorithm of the report was timed at {FEWEST_POINTS} points; measure again with `sapwise probe`");
    }
    Ok(Tuning::from_costs(Source::Measured, scenario, costs, loads))
}

/// Returns the loads of a scenario, ascending by objects.
///
/// # Errors
/// When there are fewer than two; names the scenarios there are.
pub fn measured_slice(profile: &Profile, scenario: &str) -> Result<Vec<Load>> {
    let loads = profile.slice(scenario);
    if loads.len() < 2 {
        let known = Vec::from_iter(profile.scenarios().collect::<BTreeSet<_>>());
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        bail!("the report has {} sizes of the scenario {scenario:?}, two are needed; it holds: {known}", loads.len());
    }
    Ok(loads)
}

/// Replaces the interval of each crossover by the one from paired samples, if there is one.
fn measure_crossovers(tuning: &mut Tuning, report: &Report) {
    let mut measured = 0;
    for crossover in &mut tuning.crossovers {
        let Some((low, high)) = measured_interval(crossover, report, &tuning.scenario) else { continue };
        (crossover.low, crossover.high) = (Some(low), Some(high));
        measured += 1;
    }
    if measured > 0 {
        tuning.interval_basis = format!(
            "{measured} of {}: 90 % by paired samples, from the size at which the one below is clearly cheaper to the \
             size at which the one above is, or to the last size at which both were timed; the others: {}",
            tuning.crossovers.len(),
            tuning.interval_basis
        );
    }
}

/// Returns the interval of a crossover of the cost curves, from the points of its scenario at which both neighbours
/// were timed.
///
/// The position of the crossover stays that of the curves, which are fitted to all scenarios. If the samples cross
/// elsewhere, the interval reaches over their crossing; if they don't cross, to the last size. `None` with fewer than
/// three sizes, or a crossover beyond them.
fn measured_interval(crossover: &Crossover, report: &Report, scenario: &str) -> Option<(f64, f64)> {
    let points = report.points.iter().filter(|p| p.scenario == scenario).filter_map(|point| {
        let samples = |id: &AlgorithmId| Some(&point.timings.iter().find(|t| t.algorithm == *id)?.samples_ns[..]);
        let (first_ns, second_ns) = (samples(&crossover.below)?, samples(&crossover.above)?);
        Some(PairedSamples { objects: point.load.objects, first_ns, second_ns })
    });
    PairedRatio::new(&points.collect::<Vec<_>>())?.interval(crossover.objects)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{Point, Timing};
    use crate::synthetic::{Machine, load};

    #[test]
    fn choosing_by_the_curves_loses_little_and_never_what_left_the_race() {
        for machine in Machine::family() {
            let report = machine.report();
            let tuning = measured_tuning(&report, "uniform", None).unwrap();
            assert_eq!(tuning.defect(), None);
            let profile = Profile::of("", &report);
            let mut regret = 0.0;
            for spot in &profile.points {
                let chosen = &tuning.costs[tuning.cheapest(&spot.load, |_| true).unwrap().0].algorithm;
                let ns = profile.position(chosen).and_then(|k| spot.of_position(k));
                let ns = ns.expect("chose one that had left the race");
                regret += ns / spot.best().unwrap() - 1.0;
            }
            regret /= profile.points.len() as f64;
            assert!(regret < 0.02, "{}: {regret}", machine.name);
            for objects in [200_000.0, 1e6, 8e6] {
                for scenario in ["uniform", "clustered"] {
                    let best = tuning.cheapest(&load(scenario, objects), |_| true).unwrap().0;
                    assert_ne!(tuning.costs[best].algorithm.method(), "brute");
                }
            }
        }
    }

    #[test]
    fn what_left_one_scenario_is_not_cheap_there_because_of_another() {
        // On two threads as fast as on one in one scenario, and eight times slower when it left the other.
        let mut report = Machine::family()[0].clone().exact().report();
        let from = |p: &Point| p.scenario == "clustered" && p.load.objects > 5000;
        for point in &mut report.points {
            let one =
                point.timings.iter().find(|t| t.algorithm.to_string() == "grid-sap@cpu1").unwrap().samples_ns.clone();
            let two = point.timings.iter_mut().find(|t| t.algorithm.to_string() == "grid-sap@cpu2").unwrap();
            let slower = if point.scenario == "clustered" && point.load.objects > 3000 { 8 } else { 1 };
            two.samples_ns = one.iter().map(|ns| ns * slower + ns / 50).collect();
        }
        for point in report.points.iter_mut().filter(|p| from(p)) {
            point.timings.retain(|t| t.algorithm.to_string() != "grid-sap@cpu2");
        }
        let tuning = measured_tuning(&report, "uniform", None).unwrap();
        for point in report.points.iter().filter(|p| from(p)) {
            let chosen = &tuning.costs[tuning.cheapest(&point.load, |_| true).unwrap().0].algorithm;
            assert_ne!(chosen.to_string(), "grid-sap@cpu2", "{:?}", point.load);
        }
    }

    #[test]
    fn crossovers_get_intervals_from_paired_frames() {
        let report = Machine::family()[2].report();
        let tuning = measured_tuning(&report, "uniform", None).unwrap();
        assert!(!tuning.crossovers.is_empty() && tuning.interval_basis.contains("paired samples"), "{tuning:?}");
        for b in &tuning.crossovers {
            let (low, high) = b.interval().unwrap();
            assert!(low <= b.objects && b.objects <= high && high / low < 8.0, "{b:?}");
        }
    }

    /// A report of `brute@cpu1` and `grid-sap@cpu1` whose ratio is `(n / crossing) ^ 0.5` in `uniform`, and a
    /// crossover at 1000.
    fn crossed_at(crossing: f64) -> (Report, Crossover) {
        let mut report = Machine::family()[0].clone().exact().report();
        let [below, above] = ["brute@cpu1", "grid-sap@cpu1"].map(|id| id.parse::<AlgorithmId>().unwrap());
        for point in &mut report.points {
            // In the other scenario they never cross.
            let to = if point.scenario == "uniform" { crossing } else { 1e9 };
            let n = f64::from(point.load.objects);
            let timing = |id: &AlgorithmId, exponent: f64| Timing {
                algorithm: id.clone(),
                samples_ns: (-2..=2)
                    .map(|k| (1e6 * n * ((n / to).powf(exponent) + 0.01 * f64::from(k))) as u64)
                    .collect(),
                error: None,
            };
            point.timings = vec![timing(&above, 0.0), timing(&below, 0.5)];
        }
        let tuning = measured_tuning(&Machine::family()[0].report(), "uniform", None).unwrap();
        let mut crossover = tuning.crossovers[0].clone();
        (crossover.below, crossover.above) = (below, above);
        (crossover.objects, crossover.low, crossover.high) = (1000.0, Some(900.0), Some(1100.0));
        (report, crossover)
    }

    #[test]
    fn the_interval_holds_the_crossover_and_the_crossing_of_the_samples() {
        for crossing in [300.0, 1000.0, 4000.0] {
            let (report, crossover) = crossed_at(crossing);
            let (low, high) = measured_interval(&crossover, &report, "uniform").unwrap();
            let (least, most) = (f64::min(crossing, 1000.0), f64::max(crossing, 1000.0));
            assert!(low <= least * 1.001 && most <= high * 1.001, "{crossing}: {low} to {high}");
            assert!(low > 0.8 * least && high < 1.25 * most, "{crossing}: {low} to {high}");
        }
    }

    #[test]
    fn a_scenario_that_was_not_measured_is_an_error_that_names_the_others() {
        let error = measured_tuning(&Machine::family()[0].report(), "dunes", None).unwrap_err().to_string();
        assert!(error.contains("clustered, uniform"), "{error}");
    }
}
