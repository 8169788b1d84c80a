//! The costs on one machine, from its own report.

use crate::data::Profile;
use crate::fit::designs::{Designs, TrainingSet};
use crate::fit::load_residual::noise_ln;
use crate::fit::model::model;
use crate::fit::rows::{Row, rows};
use crate::paired::{PairedRatio, PairedSamples};
use crate::report::{Label, Point, Report};
use crate::text::count;
use anyhow::{Result, bail};
use sapwise::hardware::{GpuParameterId, ParameterId, Quantity};
use sapwise::{AlgorithmCost, AlgorithmId, Crossover, Entry, Hardware, Load, Model, Parameter, Source, Tuning, tuning};
use sapwise_scenes::Random;

/// Points that a cost needs.
const FEWEST_POINTS: usize = 3;

/// The tuning of the machine that `report` was measured on, with `steps` and `crossovers` for `scenario`.
///
/// The costs are those that `base` predicts for the machine, else, as for algorithms that it does not know, those of a model that is fitted to the
/// report alone; all points of all scenarios correct them. Intervals of crossovers come from the paired samples of `scenario` where both neighbours were
/// timed there.
///
/// # Errors
/// When no point of `scenario`, or no algorithm, has enough timings; names the scenarios there are.
pub fn measured_tuning(report: &Report, scenario: &str, base: Option<&Model>) -> Result<Tuning> {
    let profile = Profile::of("", report);
    let loads = measured_slice(&profile, scenario)?;
    let (costs, warnings) = measured_costs_over(&profile, base);
    let mut tuning = slice_tuning(costs, scenario, &loads)?;
    tuning.warnings = warnings;
    if report.label == Label::Simulated {
        tuning.warnings.push("the report is simulated".to_owned());
    }
    if !report.provenance.optimised {
        tuning.warnings.push("the report was timed by an unoptimised build".to_owned());
    }
    measure_crossovers(&mut tuning, report);
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
        let mut known: Vec<&str> = profile.scenarios().collect();
        known.sort_unstable();
        known.dedup();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        bail!("the report has {} sizes of the scenario {scenario:?}, two are needed; it holds: {known}", loads.len());
    }
    Ok(loads)
}

/// The cost of each algorithm that was timed often enough, by its own report alone, and a sentence for each other one.
pub fn measured_costs(profile: &Profile) -> (Vec<AlgorithmCost>, Vec<String>) {
    measured_costs_over(profile, None)
}

/// The same, corrections of what `base` predicts for the machine where it knows an algorithm.
pub fn measured_costs_over(profile: &Profile, base: Option<&Model>) -> (Vec<AlgorithmCost>, Vec<String>) {
    let all = rows(profile, 0);
    let points = |k: usize| all.iter().filter(|r| usize::from(r.algorithm) == k && !r.floor).count();
    let known: Vec<Entry> = (profile.algorithms.iter().enumerate().filter(|(k, _)| points(*k) >= FEWEST_POINTS))
        .map(|(_, timed)| Entry::new(timed.id.clone(), timed.revision))
        .collect();
    let of_base = base.and_then(|model| model.predict(&profile.hardware, &known).ok());
    let mut costs = of_base.map_or_else(Vec::new, |p| p.costs);
    let unknown: Vec<Entry> = known.into_iter().filter(|e| costs.iter().all(|c| c.algorithm != e.id)).collect();
    if !unknown.is_empty() {
        costs.extend(own_costs(profile, &unknown, base.filter(|_| !costs.is_empty())));
    }
    costs.sort_by_key(|c| profile.position(&c.algorithm));
    let lacking = profile.algorithms.iter().enumerate().filter(|(_, t)| costs.iter().all(|c| c.algorithm != t.id));
    let warning = |(k, timed): (usize, &crate::report::Timed)| match points(k) {
        few if few < FEWEST_POINTS => format!("{} has no cost: it was timed at {} only", timed.id, count(few, "point")),
        _ => format!("{} has no cost: no term explains its time", timed.id),
    };
    let warnings = lacking.map(warning).collect();
    (corrected(&costs, profile, &all), warnings)
}

/// The costs of some algorithms by a model that is fitted to the report alone, known at the places of `base`.
fn own_costs(profile: &Profile, some: &[Entry], base: Option<&Model>) -> Vec<AlgorithmCost> {
    let mut own = profile.clone();
    own.hardware = whole(&own.hardware);
    let profiles = [own];
    let designs = Designs::new(&profiles);
    let training = TrainingSet { places: base.map(|b| &b.places), ..TrainingSet::of(&[true]) };
    // What can't be fitted is told by what lacks a cost.
    let Ok((model, _)) = model(&profiles, &designs, training, "own") else { return Vec::new() };
    model.predict(&profiles[0].hardware, some).map_or_else(|_| Vec::new(), |p| p.costs)
}

/// The hardware with a figure for each parameter that a model reads. Which one does not matter where all timings are of that machine: a fit finds
/// so many of its units.
fn whole(hardware: &Hardware) -> Hardware {
    let mut whole = hardware.clone();
    let missing = |list: &[Parameter], name: &str| list.iter().all(|p| p.name != name || p.value.is_none());
    let stand_in = |quantity: Quantity, name: &str| {
        let bounds = quantity.bounds.filter(|_| quantity.read_by_model)?;
        Some(Parameter::reported(name, (bounds.least * bounds.most).sqrt(), "stands in for what was not measured"))
    };
    let add = |list: &mut Vec<Parameter>, quantity: Quantity, name: &str| {
        if missing(list, name)
            && let Some(figure) = stand_in(quantity, name)
        {
            list.retain(|p| p.name != name);
            list.push(figure);
        }
    };
    ParameterId::ALL.iter().for_each(|id| add(&mut whole.parameters, id.quantity(), id.as_str()));
    for gpu in &mut whole.gpus {
        // Those of groups stay as they are: without them rates are added up.
        let own = GpuParameterId::ALL.iter().filter(|id| !id.as_str().starts_with("group_"));
        own.for_each(|id| add(&mut gpu.parameters, id.quantity(), id.as_str()));
    }
    whole
}

/// The costs after all timings of the report.
fn corrected(costs: &[AlgorithmCost], profile: &Profile, all: &[Row]) -> Vec<AlgorithmCost> {
    let position = |row: &Row| costs.iter().position(|c| c.algorithm == *profile.id(row.algorithm));
    let rows: Vec<(usize, &Row)> = all.iter().filter(|r| !r.floor).filter_map(|r| Some((position(r)?, r))).collect();
    // At random: those of one scenario in a row would look like a machine that changes.
    let shuffled = Random::named(1, &["observations"]).shuffled(rows.len());
    let timing = |k: usize| (rows[k].0, rows[k].1.load, rows[k].1.ns, noise_ln(rows[k].1.behind));
    tuning::corrected(costs, shuffled.into_iter().map(timing))
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
    PairedRatio::new(&points)?.interval(crossover.objects)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Timing;
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
            let tuning = measured_tuning(&report, "uniform", None).unwrap();
            for objects in [200_000.0, 1e6, 8e6] {
                for scenario in ["uniform", "clustered"] {
                    let best = tuning.rank(&load(scenario, objects), |_| true).unwrap().best;
                    assert_ne!(tuning.costs[best].algorithm.method(), "brute");
                }
            }
        }
    }

    #[test]
    fn what_was_timed_in_small_scenes_only_is_not_cheap_in_large_ones() {
        // Only the call shows at small sizes: without floors brute force would be the cheapest of all large scenes.
        let mut report = Machine::family()[0].clone().exact().report();
        let brute: AlgorithmId = "brute@cpu1".parse().unwrap();
        for point in &mut report.points {
            let objects = point.load.objects;
            point.timings.retain(|t| t.algorithm != brute || objects <= 64);
            point.timings.iter_mut().filter(|t| t.algorithm == brute).for_each(|t| t.samples_ns.fill(9000));
        }
        let costs = measured_costs(&Profile::of("", &report)).0;
        let cost = costs.iter().find(|c| c.algorithm == brute).unwrap();
        for objects in [4096.0, 262_144.0, 4e6] {
            let load = load("uniform", objects);
            let least = costs.iter().map(|c| c.curve.cost_ns(&load)).fold(f64::INFINITY, f64::min);
            assert!(cost.curve.cost_ns(&load) > 1.5 * least, "{objects}");
        }
        let small = cost.curve.cost_ns(&load("uniform", 32.0));
        assert!((small / 9000.0).ln().abs() < 0.5, "{small}");
    }

    #[test]
    fn a_report_without_hardware_parameters_has_costs_all_the_same() {
        let mut report = Machine::family_with_gpus()[1].clone().exact().report();
        report.hardware.parameters.clear();
        report.hardware.gpus.iter_mut().for_each(|g| g.parameters.clear());
        let profile = Profile::of("", &report);
        let (costs, warnings) = measured_costs(&profile);
        assert!(warnings.is_empty() && costs.len() == profile.algorithms.len(), "{warnings:?}");
    }

    #[test]
    fn a_model_is_the_base_for_what_it_knows() {
        let [other, own] = [3, 0].map(|k| Profile::of("", &Machine::family()[k].report()));
        let designs = Designs::new(std::slice::from_ref(&other));
        let mut base = model(std::slice::from_ref(&other), &designs, TrainingSet::of(&[true]), "base").unwrap().0;
        base.methods.retain(|m| m.method != "sap");
        let (costs, warnings) = measured_costs_over(&own, Some(&base));
        assert!(warnings.is_empty() && costs.len() == own.algorithms.len(), "{warnings:?}");
        assert_eq!(Tuning::from_costs(Source::Measured, "", costs, &[]).defect(), None);
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
            let chosen = &tuning.costs[tuning.rank(&point.load, |_| true).unwrap().best].algorithm;
            assert_ne!(chosen.to_string(), "grid-sap@cpu2", "{:?}", point.load);
        }
    }

    #[test]
    fn crossovers_get_intervals_from_paired_frames() {
        let report = Machine::family()[2].report();
        let tuning = measured_tuning(&report, "uniform", None).unwrap();
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
                samples_ns: (-2..=2)
                    .map(|k| (1e6 * n * ((n / to).powf(exponent) + 0.01 * f64::from(k))) as u64)
                    .collect(),
                error: None,
            };
            point.timings = vec![timing(&above, 0.0), timing(&below, 0.5)];
        }
        let mut crossover =
            measured_tuning(&Machine::family()[0].report(), "uniform", None).unwrap().crossovers.remove(0);
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
        let error = measured_tuning(&Machine::family()[0].report(), "dunes", None).unwrap_err().to_string();
        assert!(error.contains("clustered, uniform"), "{error}");
    }
}
