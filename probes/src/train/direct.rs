//! The regression that the paper of Avril, Gouranton and Arnaldi (2011) asks for: positions of crossovers, directly from
//! hardware parameters, and a choice by the number of objects alone. Kept as a baseline.

use super::baselines::slice_scenario;
use super::columns::Columns;
use super::figure;
use super::profile::Profile;
use super::yardstick::{Chooser, average};
use anyhow::{Context, Result};
use linfa::DatasetBase;
use linfa::traits::Fit;
use linfa_linear::LinearRegression;
use ndarray::{Array1, Array2};
use sapwise::crossover::{Crossover, Paired, crossover};
use sapwise::hardware::parameter;
use sapwise::report::{Point, Report};
use sapwise::{AlgorithmId, BackendClass, Hardware};

/// Parameters that a crossover is regressed on, as logarithms. Few, because there are as few rows as reports.
const PARAMETERS: [&str; 4] = [
    parameter::CLOCK_MEASURED_GHZ,
    parameter::SIMD_LANES,
    parameter::SCALING_ALL_THREADS_RATIO,
    parameter::FORK_JOIN_COLD_NS,
];

/// The same of a border between the CPU and a GPU, or between two methods on GPUs.
const GPU_PARAMETERS: [&str; 4] =
    [parameter::SCALING_ALL_THREADS_RATIO, "gpu/round_trip_ns", "gpu/upload_rate_gb_per_s", "gpu/arithmetic_gflop_per_s"];

/// A method on one thread or on all threads of its machine, on one GPU or on all: counts differ between machines, these do not.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Role {
    class: BackendClass,
    method: String,
    /// All threads, or all GPUs; `false` where there is only one.
    all: bool,
}

/// A measured crossover of two roles.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Crossing {
    first: Role,
    second: Role,
    found: Crossover,
}

/// The crossovers between the roles of a report in its scenario `uniform`, or its first one.
pub(super) fn crossings(report: &Report) -> Vec<Crossing> {
    let scenario = slice_scenario(report);
    let points: Vec<&Point> = report.points.iter().filter(|p| p.scenario == scenario).collect();
    let ids: Vec<AlgorithmId> = report.algorithms.iter().map(|t| t.id.clone()).collect();
    let roles = roles(&ids);
    let mut crossings = Vec::new();
    for (k, (a, first)) in roles.iter().enumerate() {
        for (b, second) in &roles[k + 1..] {
            if let Some(found) = crossover(&common(&points, first, second)) {
                crossings.push(Crossing { first: a.clone(), second: b.clone(), found });
            }
        }
    }
    crossings
}

/// Points at which both were timed.
fn common<'a>(points: &[&'a Point], first: &AlgorithmId, second: &AlgorithmId) -> Vec<Paired<'a>> {
    let samples = |p: &'a Point, id: &AlgorithmId| p.timings.iter().find(|t| t.algorithm == *id).map(|t| &t.samples_ns[..]);
    let pair = |p: &&'a Point| {
        Some(Paired { objects: p.load.objects, first_ns: samples(p, first)?, second_ns: samples(p, second)? })
    };
    points.iter().filter_map(pair).collect()
}

/// The roles that algorithms play on a machine, in order. Of several single GPUs the first plays.
fn roles(ids: &[AlgorithmId]) -> Vec<(Role, AlgorithmId)> {
    let mut roles: Vec<(Role, AlgorithmId)> = Vec::new();
    for id in ids {
        let (class, width) = (id.backend().class(), id.backend().width());
        let alike = |o: &&AlgorithmId| o.method() == id.method() && o.backend().class() == class;
        let most = ids.iter().filter(alike).map(|o| o.backend().width()).max();
        let role = Role { class, method: id.method().to_owned(), all: width > 1 };
        if (width == 1 || Some(width) == most) && roles.iter().all(|r| r.0 != role) {
            roles.push((role, id.clone()));
        }
    }
    roles.sort();
    roles
}

/// What is predicted for a pair of roles.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Border {
    Always { first: bool },
    At { ln_objects: f64, first_below: bool },
}

impl Border {
    fn first_wins(self, ln_objects: f64) -> bool {
        match self {
            Self::Always { first } => first,
            Self::At { ln_objects: at, first_below } => (ln_objects < at) == first_below,
        }
    }
}

/// The direct regression, applied to a machine: whoever wins most comparisons in pairs is chosen. Adds to `notes` how many
/// of its borders are means because there were too few crossings for a regression.
///
/// # Errors
/// When linfa refuses a fit.
pub(crate) fn direct<'a>(
    training: &[&Profile],
    hardware: &Hardware,
    available: &[AlgorithmId],
    notes: &mut Vec<String>,
) -> Result<Chooser<'a>> {
    let roles = roles(available);
    let mut borders = Vec::new();
    let mut means = 0;
    for a in 0..roles.len() {
        for b in a + 1..roles.len() {
            if let Some((border, mean)) = border(training, hardware, &roles[a].0, &roles[b].0)? {
                means += usize::from(mean);
                borders.push((a, b, border));
            }
        }
    }
    if means > 0 {
        notes.push(format!(
            "direct regression: {means} of {} borders are means, there being no more crossings than parameters",
            borders.len()
        ));
    }
    Ok(Box::new(move |load| {
        let ln_objects = f64::from(load.objects.max(1)).ln();
        let mut wins = vec![0; roles.len()];
        for &(a, b, border) in &borders {
            wins[if border.first_wins(ln_objects) { a } else { b }] += 1;
        }
        let most = wins.iter().max()?;
        wins.iter().position(|w| w == most).map(|k| roles[k].1.clone())
    }))
}

/// The border of a pair, and whether it is a mean only. `None` where no machine of the training has both.
///
/// Where most machines have a crossing it is regressed over those, the last of several; the others are not used, which is
/// the weakness of this method. Where most have none, the more frequent winner always wins.
fn border(training: &[&Profile], hardware: &Hardware, a: &Role, b: &Role) -> Result<Option<(Border, bool)>> {
    let found: Vec<(&Hardware, &Crossover)> = training
        .iter()
        .filter_map(|t| t.crossings.iter().find(|c| c.first == *a && c.second == *b).map(|c| (&t.hardware, &c.found)))
        .collect();
    let crossed: Vec<_> = found.iter().filter_map(|(h, c)| c.positions().last().map(|p| (*h, p))).collect();
    if found.is_empty() {
        return Ok(None);
    }
    if 2 * crossed.len() <= found.len() {
        let firsts = found.iter().filter(|(_, c)| **c == Crossover::AlwaysFirst).count();
        let seconds = found.iter().filter(|(_, c)| **c == Crossover::AlwaysSecond).count();
        return Ok(Some((Border::Always { first: firsts >= seconds }, false)));
    }
    let first_below = 2 * crossed.iter().filter(|(_, p)| p.first_below).count() >= crossed.len();
    let rows: Vec<_> = crossed.into_iter().filter(|(_, p)| p.first_below == first_below).collect();
    let machines: Vec<&Hardware> = rows.iter().map(|r| r.0).collect();
    let ln_objects: Vec<f64> = rows.iter().map(|r| r.1.objects.ln()).collect();
    let on_gpu = [a, b].iter().any(|role| role.class == BackendClass::Gpu);
    let names = if on_gpu { GPU_PARAMETERS } else { PARAMETERS };
    let (ln_objects, mean) = regress(&names, &machines, &ln_objects, hardware)?;
    Ok(Some((Border::At { ln_objects, first_below }, mean)))
}

/// Ordinary least squares of values on the logarithms of the parameters, evaluated for a machine; the mean, and `true`, when
/// there are not more rows than coefficients. Parameters that are missing anywhere or say nothing of their own are not used.
fn regress(names: &[&str], machines: &[&Hardware], values: &[f64], hardware: &Hardware) -> Result<(f64, bool)> {
    let logarithm = |h: &Hardware, name: &str| figure(h, name).filter(|v| *v > 0.0).map(f64::ln);
    let there = |name: &&str| machines.iter().chain([&hardware]).all(|h| logarithm(h, name).is_some());
    let names: Vec<&str> = names.iter().copied().filter(there).collect();
    let table =
        Array2::from_shape_fn((machines.len(), names.len()), |(k, j)| logarithm(machines[k], names[j]).unwrap_or_default());
    let columns = Columns::new(&table, &vec![1.0; machines.len()]);
    if machines.len() <= columns.kept.len() + 1 {
        return Ok((average(values), true));
    }
    let data = DatasetBase::new(columns.values.clone(), Array1::from(values.to_vec()));
    let fitted = LinearRegression::new().fit(&data).context("the direct regression of crossovers failed")?;
    let mut prediction = fitted.intercept();
    for (j, slope) in fitted.params().iter().enumerate() {
        let own = logarithm(hardware, names[columns.kept[j]]).unwrap_or_default();
        prediction += slope * (own - columns.centres[j]) / columns.scales[j];
    }
    Ok((prediction, false))
}

#[cfg(test)]
mod tests {
    use super::super::baselines::available;
    use super::super::synthetic::Machine;
    use super::super::yardstick::Yardstick;
    use super::*;

    #[test]
    fn a_power_law_is_found_and_too_few_rows_give_the_mean() {
        let machines: Vec<Hardware> = Machine::family().iter().map(Machine::hardware).collect();
        let border = |h: &Hardware| 5.0 - 0.7 * h.value(parameter::SIMD_LANES).unwrap().ln();
        let values: Vec<f64> = machines.iter().map(border).collect();
        let known: Vec<&Hardware> = machines[..6].iter().collect();
        let (predicted, mean) = regress(&PARAMETERS, &known, &values[..6], &machines[6]).unwrap();
        assert!((predicted - values[6]).abs() < 1e-6 && !mean, "{predicted}");
        let (predicted, mean) = regress(&PARAMETERS, &known[..3], &values[..3], &machines[6]).unwrap();
        assert!((predicted - average(&values[..3])).abs() < 1e-12 && mean);
    }

    #[test]
    fn it_chooses_better_than_nothing_on_a_machine_it_has_not_seen() {
        let profiles: Vec<Profile> = Machine::family().into_iter().map(|m| Profile::of("", &m.report())).collect();
        let training: Vec<&Profile> = profiles[..6].iter().collect();
        let mut notes = Vec::new();
        let available = available(&profiles[6]);
        let choose = direct(&training, &profiles[6].hardware, &available, &mut notes).unwrap();
        let regret = Yardstick::new(&profiles[6]).regret(&profiles[6], &choose).mean;
        assert!(regret < 1.0, "{regret} {notes:?}");
    }
}
