//! What intervals are made of: fits without some of the machines, and their errors on those.

use super::fit::Designs;
use super::partition::Partition;
use super::profile::{Profile, Spot, machines};
use anyhow::Result;
use rayon::prelude::*;
use sapwise::model::{FEWEST_MACHINES, Fold, FoldMethod, LnErrors, MethodModel, ModelTerm, QUANTILES, Role, RoleErrors};
use sapwise::{AlgorithmId, Hardware, Load};
use std::collections::BTreeMap;

/// Folds at most. With as many machines or fewer each fold is one machine, which is the jackknife+; with more it is CV+.
const MOST_FOLDS: usize = 10;

/// Profiles of a fold whose errors are kept at most: of thousands, others would only repeat them.
const MOST_HELD_OUT: usize = 40;

/// A profile of a machine that was left out: for each of its points the load and the median times in nanoseconds.
struct HeldOut<'a> {
    hardware: &'a Hardware,
    points: Vec<(Load, Vec<(&'a AlgorithmId, f64)>)>,
}

/// A fit, and profiles of the machines that were left out of it.
struct Fit<'a> {
    methods: Vec<MethodModel>,
    held_out: Vec<HeldOut<'a>>,
}

/// Errors by physical machine.
type ByMachine = BTreeMap<usize, Vec<f64>>;

/// The folds of a model of these profiles, each without some of the physical machines. None with fewer machines than an interval
/// needs.
///
/// # Errors
/// When the regression of a residual fails.
pub(crate) fn folds(profiles: &[Profile], designs: &Designs<'_>) -> Result<Vec<Fold>> {
    let enough = machines(profiles).len() >= FEWEST_MACHINES as usize;
    let partition = Partition::of_machines(profiles, MOST_FOLDS).filter(|_| enough);
    let without = |left_out: &Vec<usize>| {
        let mut chosen = vec![true; profiles.len()];
        left_out.iter().for_each(|&k| chosen[k] = false);
        let (methods, _) = designs.fit(&chosen)?;
        let every = left_out.len().div_ceil(MOST_HELD_OUT);
        let held_out = left_out.iter().step_by(every).map(|&k| HeldOut::of(&profiles[k])).collect();
        Ok(fold(&Fit { methods, held_out }))
    };
    partition.map_or_else(|| Ok(Vec::new()), |p| p.folds.par_iter().map(without).collect())
}

impl<'a> HeldOut<'a> {
    fn of(profile: &'a Profile) -> Self {
        let medians = |s: &'a Spot| s.medians.iter().map(|&(k, ns)| (profile.id(k), ns)).collect();
        Self { hardware: &profile.hardware, points: profile.points.iter().map(|s| (s.load, medians(s))).collect() }
    }
}

fn fold(fit: &Fit<'_>) -> Fold {
    let mut machines: Vec<&str> = Vec::new();
    let mut own: BTreeMap<Role, ByMachine> = BTreeMap::new();
    let mut between: BTreeMap<(Role, Role), ByMachine> = BTreeMap::new();
    for profile in &fit.held_out {
        let id = profile.hardware.machine.physical_id.as_str();
        let machine = machines.iter().position(|m| *m == id).unwrap_or_else(|| {
            machines.push(id);
            machines.len() - 1
        });
        let errors = Errors::of(&fit.methods, profile);
        for point in &errors.points {
            for (k, &(first, error)) in point.iter().enumerate() {
                let first = &errors.roles[first];
                own.entry(first.clone()).or_default().entry(machine).or_default().push(error.abs());
                for &(second, other) in &point[k + 1..] {
                    let second = &errors.roles[second];
                    let pair =
                        if first <= second { (first.clone(), second.clone()) } else { (second.clone(), first.clone()) };
                    between.entry(pair).or_default().entry(machine).or_default().push((error - other).abs());
                }
            }
        }
    }
    let roles: Vec<Role> = own.keys().cloned().collect();
    let errors = own.into_iter().map(|(role, by_machine)| {
        let beside = between.iter().filter(|((first, _), _)| *first == role);
        let against = beside.filter_map(|((_, second), by_machine)| {
            let position = roles.iter().position(|r| r == second)?;
            Some((position as u32, by_machine.len() as u32, quantiles(by_machine)))
        });
        let against = against.collect();
        RoleErrors { machines: by_machine.len() as u32, ln_errors: quantiles(&by_machine), against, role }
    });
    Fold { machines: machines.len() as u32, errors: errors.collect(), methods: fit.methods.iter().map(method).collect() }
}

/// Logarithms of measured over predicted time.
struct Errors {
    /// The role of each algorithm.
    roles: Vec<Role>,
    /// For each point the position of each algorithm's role, and its error.
    points: Vec<Vec<(usize, f64)>>,
}

impl Errors {
    /// Of what the methods predict of a profile; an algorithm that they don't predict is left out.
    fn of(methods: &[MethodModel], profile: &HeldOut<'_>) -> Self {
        let mut algorithms: Vec<&AlgorithmId> = Vec::new();
        for (_, medians) in &profile.points {
            for (id, _) in medians {
                if !algorithms.contains(id) {
                    algorithms.push(id);
                }
            }
        }
        let curve = |id: &&AlgorithmId| {
            let of = |m: &&MethodModel| m.method == id.method() && m.backend == id.backend().class();
            methods.iter().find(of)?.curve(profile.hardware, id.backend()).ok()
        };
        let curves: Vec<_> = algorithms.iter().map(curve).collect();
        let points = profile.points.iter().map(|(load, medians)| {
            let error = |(id, ns): &(&AlgorithmId, f64)| {
                let k = algorithms.iter().position(|a| a == id)?;
                let error = (ns / curves[k].as_ref()?.cost_ns(load)).ln();
                error.is_finite().then_some((k, error))
            };
            medians.iter().filter_map(error).collect()
        });
        Self { points: points.collect(), roles: algorithms.iter().map(|id| Role::of(id)).collect() }
    }
}

/// The quantiles of the errors of all machines, each of which weighs the same, rounded up to a thousandth.
fn quantiles(by_machine: &ByMachine) -> LnErrors {
    let mut all: Vec<(f64, f64)> =
        by_machine.values().flat_map(|e| e.iter().map(|x| (*x, 1.0 / (e.len() * by_machine.len()) as f64))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sum = 0.0;
    let reached: Vec<(f64, f64)> = all
        .iter()
        .map(|(error, weight)| {
            sum += weight;
            (sum, *error)
        })
        .collect();
    // The weights add up to one but for rounding.
    QUANTILES.map(|share| {
        let k = reached.partition_point(|r| r.0 < share - 1e-9).min(reached.len() - 1);
        (reached[k].1 * 1000.0).ceil() / 1000.0
    })
}

/// What the curve of a method is made of, to six digits.
fn method(m: &MethodModel) -> FoldMethod {
    let six = |x: f64| format!("{x:.5e}").parse().unwrap_or(x);
    let term = |t: &ModelTerm| (t.term, t.scale, six(t.unit));
    let centred: f64 = m.residual.iter().map(|r| r.slope * r.centre).sum();
    FoldMethod {
        method: m.method.clone(),
        backend: m.backend,
        objects: (m.min_objects, m.max_objects),
        terms: m.terms.iter().map(term).collect(),
        fallback_terms: m.fallback_terms.iter().map(term).collect(),
        intercept: six(m.residual_intercept - centred),
        slopes: m.residual.iter().map(|r| (r.feature, six(r.slope))).collect(),
    }
}

#[cfg(test)]
mod tests;
