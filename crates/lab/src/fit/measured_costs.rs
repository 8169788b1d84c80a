//! The costs of algorithms on one machine, from its own report.

use crate::data::Profile;
use crate::fit::correction::corrected;
use crate::fit::designs::Designs;
use crate::fit::model::model;
use crate::fit::rows::rows;
use crate::report::Timed;
use crate::text::count;
use sapwise::algorithm::Entry;
use sapwise::tuning::AlgorithmCost;
use sapwise_tune::hardware::{GpuParameterId, ParameterId, Quantity};
use sapwise_tune::{Hardware, Model, Parameter};
use std::sync::Arc;

/// Fewest points that a cost is fitted to.
pub(super) const FEWEST_POINTS: usize = 3;

/// Returns the cost of each algorithm that was timed often enough, from the report alone, and a sentence for each
/// other one.
pub fn measured_costs(profile: &Profile) -> (Vec<AlgorithmCost>, Vec<String>) {
    measured_costs_over(profile, None)
}

/// Returns the same. For algorithms that `base` knows, the costs are its predictions, corrected by the timings.
pub(super) fn measured_costs_over(profile: &Profile, base: Option<&Model>) -> (Vec<AlgorithmCost>, Vec<String>) {
    let all = rows(profile, 0, None);
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
    let warning = |(k, timed): (usize, &Timed)| match points(k) {
        few if few < FEWEST_POINTS => format!("{} has no cost: it was timed at {} only", timed.id, count(few, "point")),
        _ => format!("{} has no cost: no term explains its time", timed.id),
    };
    let warnings = lacking.map(warning).collect();
    (corrected(costs, profile, &all), warnings)
}

/// Predicts some algorithms by a model that is fitted to the report alone, with its residual at the places of `base`.
fn own_costs(profile: &Profile, some: &[Entry], base: Option<&Model>) -> Vec<AlgorithmCost> {
    let mut own = profile.clone();
    own.hardware = completed(&own.hardware);
    let profiles = [own];
    let designs = base.map_or_else(|| Designs::new(&profiles), |b| Designs::at(&profiles, None, Arc::clone(&b.places)));
    // The caller reports the algorithms that could not be fitted.
    let Ok((model, _)) = model(&designs, &[true], "own") else { return Vec::new() };
    model.predict(&profiles[0].hardware, some).map_or_else(|_| Vec::new(), |p| p.costs)
}

/// Returns the cost of each algorithm from one of several profiles alone, without the scenario that `designs` leave
/// out. Algorithms whose hardware parameters are missing, or that have too few timings, have none.
pub(crate) fn costs_of_one(designs: &Designs<'_>, k: usize) -> Vec<AlgorithmCost> {
    let (profile, mut chosen) = (&designs.profiles[k], vec![false; designs.profiles.len()]);
    chosen[k] = true;
    let Ok((model, _)) = model(designs, &chosen, "own") else { return Vec::new() };
    let costs = model.predict(&profile.hardware, &profile.with_revisions(&profile.available()));
    costs.map_or_else(|_| Vec::new(), |p| corrected(p.costs, profile, &rows(profile, 0, designs.without)))
}

/// Adds a value for each missing parameter that a model reads. Any value will do when all timings are of one machine:
/// only its product with the fitted unit counts.
fn completed(hardware: &Hardware) -> Hardware {
    let mut completed = hardware.clone();
    let add = |list: &mut Vec<Parameter>, quantity: Quantity, name: &str| {
        let missing = list.iter().all(|p| p.name != name || p.value.is_none());
        let Some(bounds) = quantity.bounds.filter(|_| quantity.read_by_model && missing) else { return };
        list.retain(|p| p.name != name);
        list.push(Parameter::reported(
            name,
            (bounds.least * bounds.most).sqrt(),
            "stands in for what was not measured",
        ));
    };
    ParameterId::ALL.iter().for_each(|id| add(&mut completed.parameters, id.quantity(), id.as_str()));
    for gpu in &mut completed.gpus {
        // Without the parameters of a group the rates of its GPUs are added up.
        let own = GpuParameterId::ALL.iter().filter(|id| !id.as_str().starts_with("group_"));
        own.for_each(|id| add(&mut gpu.parameters, id.quantity(), id.as_str()));
    }
    completed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{Machine, load};
    use sapwise::tuning::Source;
    use sapwise::{AlgorithmId, Tuning};

    #[test]
    fn what_was_timed_in_small_scenes_only_is_not_cheap_in_large_ones() {
        // Small sizes show the cost of a call only: without lower bounds brute force would be the cheapest in all
        // large scenes.
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
    fn a_report_without_hardware_parameters_has_costs() {
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
        let mut base = model(&designs, &[true], "base").unwrap().0;
        base.methods.retain(|m| m.method != "sap");
        let (costs, warnings) = measured_costs_over(&own, Some(&base));
        assert!(warnings.is_empty() && costs.len() == own.algorithms.len(), "{warnings:?}");
        assert_eq!(Tuning::from_costs(Source::Measured, "", costs, &[]).defect(), None);
    }
}
