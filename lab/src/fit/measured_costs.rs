//! The measured cost curves of one machine, from its own report.

use crate::data::Profile;
use crate::fit::min_of_two::MinOfTwo;
use crate::fit::robust::{Problem, weighted_median};
use crate::fit::rows::{Row, rows};
use crate::fit::terms::{fallback_method, terms_of_one_machine};
use crate::paired::{PairedComparison, PairedSamples};
use crate::report::{Label, Point, Report, Timed};
use anyhow::{Result, bail};
use ndarray::Array2;
use sapwise::hardware::ParameterId;
use sapwise::stats::robust_deviation;
use sapwise::{AlgorithmCost, AlgorithmId, CostCurve, CostTerm, Crossover, Knot, Load, Source, Term, Tuning};

/// Distance of the knots of a correction, in octaves of the number of objects.
const KNOT_STEP: f64 = 0.5;
/// Residuals within this many octaves of a knot enter it, with a weight that falls linearly to zero.
const KNOT_REACH: f64 = 0.75;
/// Points that a curve needs: below that its terms and its correction can't be told apart.
const FEWEST_POINTS: usize = 3;

/// The tuning of the machine that `report` was measured on, with `steps` and `crossovers` for `scenario`.
///
/// The cost curves are fitted to the points of all scenarios of the report. Intervals of crossovers come from the paired
/// samples of `scenario` where both neighbours were timed there.
///
/// # Errors
/// When no point of `scenario`, or no algorithm, has enough timings; names the scenarios there are.
pub fn measured_tuning(report: &Report, scenario: &str) -> Result<Tuning> {
    let mut tuning = profile_tuning(&Profile::of("", report), scenario)?;
    if report.label == Label::Simulated {
        tuning.warnings.push("the report is simulated".to_owned());
    }
    if !report.provenance.optimised {
        tuning.warnings.push("the report was timed by an unoptimised build".to_owned());
    }
    measure_crossovers(&mut tuning, report);
    Ok(tuning)
}

/// The same without intervals from paired samples, which a profile does not hold.
fn profile_tuning(profile: &Profile, scenario: &str) -> Result<Tuning> {
    let loads = measured_slice(profile, scenario)?;
    let (costs, warnings) = measured_costs(profile);
    let mut tuning = slice_tuning(costs, scenario, &loads)?;
    tuning.warnings = warnings;
    Ok(tuning)
}

/// Measured tuning with the slice through these loads.
///
/// # Errors
/// When there are no costs.
pub fn slice_tuning(costs: Vec<AlgorithmCost>, scenario: &str, loads: &[Load]) -> Result<Tuning> {
    if costs.is_empty() {
        bail!("no algorithm of the report was timed at {FEWEST_POINTS} points; measure again with `sapwise probe`");
    }
    Ok(Tuning::from_costs(Source::Measured, scenario, costs, loads))
}

/// The loads of a scenario, ascending by objects.
///
/// # Errors
/// When there are fewer than two; names the scenarios there are.
pub fn measured_slice(profile: &Profile, scenario: &str) -> Result<Vec<Load>> {
    let loads = profile.slice(scenario);
    if loads.len() < 2 {
        let mut known: Vec<&str> = profile.points.iter().map(|p| p.scenario.as_str()).collect();
        known.sort_unstable();
        known.dedup();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        bail!("the report has {} sizes of the scenario {scenario:?}, two are needed; it holds: {known}", loads.len());
    }
    Ok(loads)
}

/// The cost curve of each algorithm that was timed often enough, and a sentence for each other one.
pub fn measured_costs(profile: &Profile) -> (Vec<AlgorithmCost>, Vec<String>) {
    let rows = rows(profile, 0);
    let cache_bytes = profile.hardware.value(ParameterId::CacheLlcBytes).unwrap_or(0.0);
    let (mut costs, mut warnings) = (Vec::new(), Vec::new());
    let mut order: Vec<(usize, &Timed)> = profile.algorithms.iter().enumerate().collect();
    // What falls back to another method comes after that.
    order.sort_by_key(|(_, timed)| fallback_method(timed.id.method()).is_some());
    for (k, timed) in order {
        let own: Vec<&Row> = rows.iter().filter(|r| usize::from(r.algorithm) == k).collect();
        let points = own.iter().filter(|r| !r.floor).count();
        let other = fallback_method(timed.id.method()).and_then(|other| {
            let same = |c: &&AlgorithmCost| c.algorithm.method() == other && c.algorithm.backend() == timed.id.backend();
            costs.iter().find(same).map(|c: &AlgorithmCost| c.curve.clone())
        });
        let fitted = (points >= FEWEST_POINTS).then(|| curve(&terms_of(timed), &own, cache_bytes, other.as_ref()));
        match fitted.filter(|(curve, _)| curve.defect().is_none()) {
            Some((curve, spread_ln)) => {
                costs.push(AlgorithmCost::new(timed.id.clone(), timed.revision, curve, spread_ln));
            }
            None => warnings.push(format!("{} has no cost curve: it was timed at {points} points only", timed.id)),
        }
    }
    costs.sort_by_key(|c: &AlgorithmCost| profile.position(&c.algorithm));
    (costs, warnings)
}

/// What an algorithm's time consists of on one machine: the terms that its report names, else the usual ones.
fn terms_of(timed: &Timed) -> Vec<Term> {
    let mut terms: Vec<Term> = Vec::new();
    for term in timed.terms.iter().map(|t| t.term) {
        if !terms.contains(&term) {
            terms.push(term);
        }
    }
    if terms.is_empty() { terms_of_one_machine(timed.id.method(), timed.id.backend().class()) } else { terms }
}

/// The curve of one algorithm on one machine, and its spread. `other` is that of the algorithm that it falls back to, if it does.
fn curve(terms: &[Term], rows: &[&Row], cache_bytes: f64, other: Option<&CostCurve>) -> (CostCurve, f64) {
    let problem = Problem {
        terms: Array2::from_shape_fn((rows.len(), terms.len()), |(k, j)| terms[j].count(&rows[k].load, cache_bytes)),
        ns: rows.iter().map(|r| r.ns).collect(),
        weights: vec![1.0; rows.len()],
        floors: rows.iter().map(|r| r.floor).collect(),
        groups: vec![0; rows.len()],
    };
    let (units, fallback_terms) = match other {
        None => (problem.units(), Vec::new()),
        Some(other) => {
            let ns: Vec<f64> = rows.iter().map(|r| other.cost_ns(&r.load)).collect();
            let found = MinOfTwo::fit(&problem, &ns);
            let fallback_terms = other.terms.iter().map(|t| CostTerm { unit_ns: t.unit_ns * found.factor, ..*t }).collect();
            (found.units, fallback_terms)
        }
    };
    let terms = terms.iter().zip(units).filter(|(_, u)| *u > 0.0).map(|(&term, unit_ns)| CostTerm { term, unit_ns });
    let mut curve = CostCurve::new(terms.collect()).with_fallback(fallback_terms).with_cache(cache_bytes);
    if curve.defect().is_some() {
        return (curve, 0.0);
    }
    // A bound that the terms break is evidence like a measurement: what is hopeless in one scenario and timed on in
    // another would pass for cheap in both.
    let floors = residuals(&curve, rows, true);
    let mut evidence = residuals(&curve, rows, false);
    let largest = evidence.iter().map(|r| r.0).fold(0.0, f64::max);
    evidence.extend(floors.iter().filter(|f| f.0 <= largest && f.1 > 0.0));
    curve.correction = correction(&evidence, &floors);
    let spread_ln =
        robust_deviation(&residuals(&curve, rows, false).into_iter().map(|r| r.1).collect::<Vec<f64>>()).unwrap_or(0.0);
    (curve, spread_ln)
}

/// Base-2 logarithm of the objects and natural logarithm of measured over modelled time, of the floors or of the others.
fn residuals(curve: &CostCurve, rows: &[&Row], floors: bool) -> Vec<(f64, f64)> {
    let of = |r: &&Row| (f64::from(r.load.objects).log2(), (r.ns / curve.cost_ns(&r.load)).ln());
    rows.iter().filter(|r| r.floor == floors).map(of).collect()
}

/// Local medians of the residuals, and beyond the largest of them at least what keeps the cost above every floor.
///
/// Medians, because a host that slows down spoils all samples of a point at once, and one such point among those of several
/// scenarios must not bend the curve.
fn correction(measured: &[(f64, f64)], floors: &[(f64, f64)]) -> Vec<Knot> {
    let low = measured.iter().map(|r| r.0).fold(f64::INFINITY, f64::min);
    let high = measured.iter().map(|r| r.0).fold(0.0, f64::max);
    let (first, last) = ((low / KNOT_STEP).floor() as u32, (high / KNOT_STEP).ceil() as u32);
    let mut knots = Vec::new();
    for k in first..=last {
        let log2_objects = f64::from(k) * KNOT_STEP;
        let weight = |x: f64| (1.0 - (x - log2_objects).abs() / KNOT_REACH).max(0.0);
        let near = measured.iter().map(|r| (r.1, weight(r.0))).filter(|r| r.1 > 0.0).collect();
        if let Some(ln_factor) = weighted_median(near) {
            knots.push(Knot { log2_objects, ln_factor });
        }
    }
    let mut beyond: Vec<(f64, f64)> = floors.iter().filter(|f| f.0 > f64::from(last) * KNOT_STEP).copied().collect();
    beyond.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (log2_objects, needed) in beyond {
        let Some(outer) = knots.last_mut() else { break };
        if outer.log2_objects == log2_objects {
            outer.ln_factor = outer.ln_factor.max(needed);
        } else {
            let ln_factor = outer.ln_factor.max(needed);
            knots.push(Knot { log2_objects, ln_factor });
        }
    }
    knots
}

/// Replaces the interval of each crossover by the one from paired samples, where there is one.
fn measure_crossovers(tuning: &mut Tuning, report: &Report) {
    let mut measured = 0;
    for crossover in &mut tuning.crossovers {
        let Some((low, high)) = measured_interval(crossover, report, &tuning.scenario) else { continue };
        (crossover.low, crossover.high) = (Some(low), Some(high));
        measured += 1;
    }
    if measured > 0 {
        let all = tuning.crossovers.len();
        tuning.interval_basis = format!(
            "{measured} of {all}: 90 % by the paired samples, from where they tell that the one below is cheaper to where they tell \
             that the one above is, or to the last size at which both were timed; the others: {}",
            tuning.interval_basis
        );
    }
}

/// The interval of a crossover of the cost curves, from the points of its scenario at which both neighbours were timed.
///
/// The crossover itself stays: the curves know all scenarios, and a choice by them changes there. Where the samples cross
/// elsewhere the interval reaches from the crossover over their crossing, and where they don't cross to the last size. `None` where
/// fewer than three sizes have both, or the crossover lies beyond them.
fn measured_interval(crossover: &Crossover, report: &Report, scenario: &str) -> Option<(f64, f64)> {
    let samples = |point: &'_ Point, id: &AlgorithmId| point.timings.iter().position(|t| t.algorithm == *id);
    let mut points = Vec::new();
    for point in report.points.iter().filter(|p| p.scenario == scenario) {
        let (Some(a), Some(b)) = (samples(point, &crossover.below), samples(point, &crossover.above)) else { continue };
        points.push(PairedSamples {
            objects: point.load.objects,
            first_ns: &point.timings[a].samples_ns,
            second_ns: &point.timings[b].samples_ns,
        });
    }
    PairedComparison::new(&points)?.interval(crossover.objects, true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Timing;
    use crate::synthetic::{Machine, load};
    use sapwise::BackendClass;

    #[test]
    fn choosing_by_the_curves_loses_little_and_never_what_left_the_race() {
        for machine in Machine::family() {
            let report = machine.report();
            let tuning = measured_tuning(&report, "uniform").unwrap();
            assert_eq!(tuning.defect(), None);
            let profile = Profile::of("", &report);
            let mut regret = 0.0;
            for spot in &profile.points {
                let chosen = &tuning.costs[tuning.rank(&spot.load, |_| true).unwrap().best].algorithm;
                let ns = profile.medians(spot).find(|m| m.0 == chosen).expect("chose one that had left the race").1;
                regret += ns / spot.best().unwrap() - 1.0;
            }
            regret /= profile.points.len() as f64;
            assert!(regret < 0.02, "{}: {regret}", machine.name);
        }
    }

    #[test]
    fn what_left_the_race_stays_behind_beyond_all_sizes() {
        for machine in Machine::family() {
            let report = machine.report();
            let tuning = measured_tuning(&report, "uniform").unwrap();
            for objects in [200_000.0, 1e6, 8e6] {
                for scenario in ["uniform", "clustered"] {
                    let best = tuning.rank(&load(scenario, objects), |_| true).unwrap().best;
                    assert_ne!(tuning.costs[best].algorithm.method(), "brute");
                }
            }
        }
    }

    #[test]
    fn a_flat_curve_that_left_the_race_is_lifted() {
        // Only the call shows at small sizes: without floors this would be the cheapest of all large scenes.
        let row = |objects: u32, ns: f64, floor: bool| Row {
            profile: 0,
            algorithm: 0,
            load: load("uniform", f64::from(objects)),
            core_to_core_ns: None,
            ns,
            behind: 1.0,
            floor,
        };
        let mut rows: Vec<Row> = [16, 23, 32, 45].map(|n| row(n, 9000.0, false)).into();
        rows.extend([64, 1024, 16_384, 262_144].map(|n| row(n, 100.0 * f64::from(n) * 2.0, true)));
        let rows: Vec<&Row> = rows.iter().collect();
        let (curve, _) = curve(&terms_of_one_machine("brute", BackendClass::Cpu), &rows, 1e6, None);
        assert_eq!(curve.defect(), None);
        for r in rows.iter().filter(|r| r.floor) {
            assert!(curve.cost_ns(&r.load) > 0.99 * r.ns, "{curve:?}");
        }
        assert!(curve.cost_ns(&load("uniform", 4e6)) > 100.0 * 4e6);
        assert!((curve.cost_ns(&rows[0].load) / 9000.0 - 1.0).abs() < 0.05);
    }

    #[test]
    fn what_left_one_scenario_is_not_cheap_there_because_of_another() {
        // On two threads as fast as on one in one scenario, and eight times slower when it left the other.
        let mut report = Machine::family()[0].clone().exact().report();
        let from = |p: &Point| p.scenario == "clustered" && p.load.objects > 5000;
        for point in &mut report.points {
            let one = point.timings.iter().find(|t| t.algorithm.to_string() == "grid-sap@cpu1").unwrap().samples_ns.clone();
            let two = point.timings.iter_mut().find(|t| t.algorithm.to_string() == "grid-sap@cpu2").unwrap();
            let slower = if point.scenario == "clustered" && point.load.objects > 3000 { 8 } else { 1 };
            two.samples_ns = one.iter().map(|ns| ns * slower + ns / 50).collect();
        }
        for point in report.points.iter_mut().filter(|p| from(p)) {
            point.timings.retain(|t| t.algorithm.to_string() != "grid-sap@cpu2");
        }
        let tuning = measured_tuning(&report, "uniform").unwrap();
        for point in report.points.iter().filter(|p| from(p)) {
            let chosen = &tuning.costs[tuning.rank(&point.load, |_| true).unwrap().best].algorithm;
            assert_ne!(chosen.to_string(), "grid-sap@cpu2", "{:?}", point.load);
        }
    }

    #[test]
    fn crossovers_get_intervals_from_paired_frames() {
        let report = Machine::family()[2].report();
        let tuning = measured_tuning(&report, "uniform").unwrap();
        assert!(
            !tuning.crossovers.is_empty() && tuning.interval_basis.contains("paired samples"),
            "{}",
            tuning.interval_basis
        );
        for b in &tuning.crossovers {
            let (low, high) = b.interval().unwrap();
            assert!(low <= b.objects && b.objects <= high && high / low < 8.0, "{b:?}");
        }
    }

    /// A report of `brute@cpu1` and `grid-sap@cpu1` whose ratio is `(n / crossing) ^ 0.5` in `uniform`, and a crossover at 1000.
    fn crossed_at(crossing: f64) -> (Report, Crossover) {
        let mut report = Machine::family()[0].clone().exact().report();
        let [below, above] = ["brute@cpu1", "grid-sap@cpu1"].map(|id| id.parse::<AlgorithmId>().unwrap());
        for point in &mut report.points {
            // In the other scenario they never cross.
            let to = if point.scenario == "uniform" { crossing } else { 1e9 };
            let n = f64::from(point.load.objects);
            let timing = |id: &AlgorithmId, exponent: f64| Timing {
                algorithm: id.clone(),
                // Spread by 2 % to either side, and the other way round for the other.
                samples_ns: (-2..=2).map(|k| (1e6 * n * ((n / to).powf(exponent) + 0.01 * f64::from(k))) as u64).collect(),
                error: None,
            };
            point.timings = vec![timing(&above, 0.0), timing(&below, 0.5)];
        }
        let mut crossover = measured_tuning(&Machine::family()[0].report(), "uniform").unwrap().crossovers.remove(0);
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
    fn where_the_samples_do_not_cross_the_interval_goes_on_to_the_last_size_of_both() {
        let (mut report, mut crossover) = crossed_at(1e9);
        assert_eq!(measured_interval(&crossover, &report, "uniform").unwrap().0, 1000.0);
        // Whoever left the race has no samples there.
        report.points.iter_mut().filter(|p| p.load.objects > 20_000).for_each(|p| p.timings.truncate(1));
        let last = report.points.iter().filter(|p| p.timings.len() == 2).map(|p| p.load.objects).max().unwrap();
        let (low, high) = measured_interval(&crossover, &report, "uniform").unwrap();
        assert!(low == 1000.0 && (high / f64::from(last) - 1.0).abs() < 1e-9, "{low} to {high}");
        // And a crossover beyond keeps the interval of the curves.
        crossover.objects = 50_000.0;
        assert_eq!(measured_interval(&crossover, &report, "uniform"), None);
        report.points.iter_mut().for_each(|p| p.timings.truncate(1));
        crossover.objects = 1000.0;
        assert_eq!(measured_interval(&crossover, &report, "uniform"), None);
    }

    #[test]
    fn a_scenario_that_was_not_measured_is_told() {
        let error = measured_tuning(&Machine::family()[0].report(), "dunes").unwrap_err().to_string();
        assert!(error.contains("clustered, uniform"), "{error}");
    }
}
