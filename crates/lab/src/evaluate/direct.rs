//! The regression that the paper of Avril, Gouranton and Arnaldi (2011) asks for: positions of crossovers, directly
//! from hardware parameters, and a choice by the number of objects alone.

use super::regret_table::Strategy;
use super::role::{Role, roles};
use crate::data::{Profile, Spot, figure};
use crate::fit::columns::Columns;
use crate::paired::{Crossing, PairedRatio};
use anyhow::{Context, Result};
use linfa::DatasetBase;
use linfa::traits::Fit;
use linfa_linear::LinearRegression;
use ndarray::{Array1, Array2};
use sapwise::AlgorithmId;
use sapwise::algorithm::BackendClass;
use sapwise_tune::Hardware;
use sapwise_tune::hardware::ParameterId;
use sapwise_tune::stats::mean;

/// Parameters whose logarithms a crossover is regressed on. Few, because there are only as many rows as reports.
const PARAMETERS: [&str; 4] = [
    ParameterId::ClockMeasuredGhz.as_str(),
    ParameterId::SimdLanes.as_str(),
    ParameterId::ScalingAllThreadsRatio.as_str(),
    ParameterId::ForkJoinColdNs.as_str(),
];

/// The same for a crossover between the CPU and a GPU, or between two methods on GPUs.
const GPU_PARAMETERS: [&str; 4] = [
    ParameterId::ScalingAllThreadsRatio.as_str(),
    "gpu/round_trip_ns",
    "gpu/upload_rate_gb_per_s",
    "gpu/arithmetic_gflop_per_s",
];

/// Which of two roles is cheaper at which sizes, on one machine.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RoleOutcome {
    first: Role,
    second: Role,
    /// Ascending; none if one of the two is always cheaper.
    crossings: Vec<Crossing>,
    first_is_cheaper: bool,
}

fn parameters(a: &Role, b: &Role) -> [&'static str; 4] {
    if [a, b].iter().any(|role| role.class == BackendClass::Gpu) { GPU_PARAMETERS } else { PARAMETERS }
}

/// Compares each two roles of a profile in its scenario `uniform`, or its first one.
pub(super) fn role_outcomes(profile: &Profile) -> Vec<RoleOutcome> {
    let scenario = profile.usual_scenario();
    let ids: Vec<AlgorithmId> = profile.algorithms.iter().map(|t| t.id.clone()).collect();
    let roles = roles(&ids);
    let within = || profile.points.iter().filter(|p| p.scenario == scenario);
    let mut outcomes = Vec::new();
    for (a, (first, first_id)) in roles.iter().enumerate() {
        for (second, second_id) in &roles[a + 1..] {
            let ratio = |spot: &Spot| {
                let [a, b] = [first_id, second_id].map(|id| spot.with_error(profile.position(id)?));
                let ((a, a_error), (b, b_error)) = a.zip(b)?;
                Some((spot.load.objects, (a / b).ln(), a_error.hypot(b_error)))
            };
            if let Some(ratio) = PairedRatio::of_ratios(within().filter_map(ratio)) {
                outcomes.push(RoleOutcome {
                    first: first.clone(),
                    second: second.clone(),
                    crossings: ratio.crossings(),
                    first_is_cheaper: ratio.first_is_cheaper(),
                });
            }
        }
    }
    outcomes
}

/// The predicted crossover of a pair of roles.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Prediction {
    /// Infinite if one of the two always wins.
    ln_objects: f64,
    /// Whether the first one wins with fewer objects.
    first_below: bool,
}

/// Applies the direct regression to a machine: the winner of most pairwise comparisons is chosen. `training` are
/// profiles with the outcomes of their roles.
///
/// # Errors
/// When linfa refuses a fit.
pub(super) fn direct<'a>(
    training: &[(&Profile, &[RoleOutcome])],
    hardware: &Hardware,
    available: &[AlgorithmId],
) -> Result<Strategy<'a>> {
    let roles = roles(available);
    let mut predictions = Vec::new();
    for a in 0..roles.len() {
        for b in a + 1..roles.len() {
            let prediction = predict(training, hardware, &roles[a].0, &roles[b].0)?;
            predictions.extend(prediction.map(|prediction| (a, b, prediction)));
        }
    }
    Ok(Box::new(move |load| {
        let ln_objects = f64::from(load.objects.max(1)).ln();
        let mut wins = vec![0; roles.len()];
        for &(a, b, Prediction { ln_objects: at, first_below }) in &predictions {
            wins[if (ln_objects < at) == first_below { a } else { b }] += 1;
        }
        let most = wins.iter().max()?;
        wins.iter().position(|w| w == most).map(|k| roles[k].1.clone())
    }))
}

/// Predicts a pair of roles; `None` when no machine of the training has both.
///
/// If most machines have a crossover, the last one of each is regressed; the machines without are not used, which is
/// the weakness of this method. If most have none, the more frequent winner always wins.
fn predict(
    training: &[(&Profile, &[RoleOutcome])],
    hardware: &Hardware,
    a: &Role,
    b: &Role,
) -> Result<Option<Prediction>> {
    let of_pair = |outcomes: &'_ [RoleOutcome]| outcomes.iter().position(|c| c.first == *a && c.second == *b);
    let found: Vec<(&Hardware, &RoleOutcome)> = training
        .iter()
        .filter_map(|(profile, outcomes)| Some((&profile.hardware, &outcomes[of_pair(outcomes)?])))
        .collect();
    let crossed: Vec<_> = found.iter().filter_map(|(h, c)| c.crossings.last().map(|p| (*h, p))).collect();
    if found.is_empty() {
        return Ok(None);
    }
    if 2 * crossed.len() <= found.len() {
        let always = |c: &RoleOutcome, first: bool| c.crossings.is_empty() && c.first_is_cheaper == first;
        let [firsts, seconds] = [true, false].map(|first| found.iter().filter(|(_, c)| always(c, first)).count());
        return Ok(Some(Prediction { ln_objects: f64::INFINITY, first_below: firsts >= seconds }));
    }
    let first_below = 2 * crossed.iter().filter(|(_, p)| p.first_below).count() >= crossed.len();
    let rows: Vec<_> = crossed.into_iter().filter(|(_, p)| p.first_below == first_below).collect();
    let machines: Vec<&Hardware> = rows.iter().map(|r| r.0).collect();
    let ln_objects: Vec<f64> = rows.iter().map(|r| r.1.objects.ln()).collect();
    Ok(Some(Prediction { ln_objects: estimate(&parameters(a, b), &machines, &ln_objects, hardware)?, first_below }))
}

/// Regresses values on the logarithms of parameters and evaluates the line for a machine. Skips parameters that are
/// missing on any machine or that depend on others, and fits the mean when there are not more rows than coefficients.
///
/// # Errors
/// When linfa refuses a fit.
fn estimate(names: &[&str], machines: &[&Hardware], values: &[f64], hardware: &Hardware) -> Result<f64> {
    let logarithm = |h: &Hardware, name: &str| figure(h, name).filter(|v| *v > 0.0).map(f64::ln);
    let there = |name: &&str| machines.iter().chain([&hardware]).all(|h| logarithm(h, name).is_some());
    let names: Vec<&str> = names.iter().copied().filter(there).collect();
    let row = |h: &Hardware| names.iter().map(|name| logarithm(h, name).unwrap_or_default()).collect::<Vec<f64>>();
    let table = Array2::from_shape_fn((machines.len(), names.len()), |(k, j)| {
        logarithm(machines[k], names[j]).unwrap_or_default()
    });
    regressed(&table, values, &row(hardware))
}

/// Fits ordinary least squares to a table of shape (rows, columns), and evaluates the line at a row; the mean when
/// there are not more rows than coefficients.
///
/// # Errors
/// When linfa refuses the fit.
fn regressed(table: &Array2<f64>, values: &[f64], row: &[f64]) -> Result<f64> {
    let columns = Columns::new(table, &vec![1.0; values.len()]);
    if values.len() <= columns.kept.len() + 1 {
        return Ok(mean(values));
    }
    let c = columns.without_lone_rows();
    if c.kept.is_empty() {
        return Ok(mean(values));
    }
    let data = DatasetBase::new(c.values.clone(), Array1::from(values.to_vec()));
    let fitted = LinearRegression::new().fit(&data).context("the direct regression of crossovers failed")?;
    let term = |j: usize| fitted.params()[j] * (row[c.kept[j]] - c.centres[j]) / c.scales[j];
    Ok(fitted.intercept() + (0..c.kept.len()).map(term).sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::RegretTable;
    use crate::synthetic::Machine;
    use linfa::traits::Predict;
    use sapwise_scenes::Random;

    #[test]
    fn it_chooses_better_than_nothing_on_a_machine_it_has_not_seen() {
        for machines in [Machine::family(), Machine::family_with_gpus()] {
            let profiles: Vec<Profile> = machines.into_iter().map(|m| Profile::of("", &m.report())).collect();
            let outcomes: Vec<Vec<RoleOutcome>> = profiles.iter().map(role_outcomes).collect();
            let training: Vec<(&Profile, &[RoleOutcome])> =
                profiles.iter().zip(&outcomes).take(6).map(|(p, o)| (p, &o[..])).collect();
            let choose = direct(&training, &profiles[6].hardware, &profiles[6].available()).unwrap();
            let regret = RegretTable::new(&profiles[6]).regret(&profiles[6], &choose).mean;
            assert!(regret < 1.0, "{regret}");
        }
    }

    #[test]
    fn least_squares_find_a_power_law_and_too_few_rows_give_the_mean() {
        // A crossover that goes down with the lanes.
        let machines: Vec<Hardware> = Machine::family().iter().map(Machine::hardware).collect();
        let values: Vec<f64> =
            machines.iter().map(|h| 5.0 - 0.7 * h.value(ParameterId::SimdLanes).unwrap().ln()).collect();
        let known: Vec<&Hardware> = machines[..6].iter().collect();
        let of = |count: usize| estimate(&PARAMETERS, &known[..count], &values[..count], &machines[6]).unwrap();
        assert!((of(6) - values[6]).abs() < 1e-6, "{}", of(6));
        assert!((of(3) - mean(&values[..3])).abs() < 1e-12, "{}", of(3));
    }

    #[test]
    fn a_parameter_of_one_machine_only_is_not_used() {
        // Nine machines of which only the last has other lanes; its crossover is far off for another reason.
        let mut random = Random::named(23, &[]);
        let table = Array2::from_shape_fn((9, 2), |(k, j)| if j == 0 { random.normal() } else { f64::from(k == 8) });
        let values: Vec<f64> = (0..9).map(|k| 5.0 + table[[k, 0]] + if k == 8 { 4.0 } else { 0.0 }).collect();
        let [same, other] = [0.0, 1.0].map(|lanes| regressed(&table, &values, &[0.5, lanes]).unwrap());
        assert_eq!(same, other);
    }

    #[test]
    fn plain_arithmetic_predicts_what_linfa_does() {
        let mut random = Random::named(29, &[]);
        let table = Array2::from_shape_fn((30, 4), |(_, j)| [3.0, 0.1, 40.0, 7.0][j] * (2.0 + random.normal()));
        let values: Vec<f64> =
            table.rows().into_iter().map(|r| 2.0 + 0.3 * r[0] - 5.0 * r[1] + 0.1 * random.normal()).collect();
        let columns = Columns::new(&table, &[1.0; 30]);
        let data = DatasetBase::new(columns.values.clone(), Array1::from(values.clone()));
        let linfa = LinearRegression::new().fit(&data).unwrap().predict(&columns.values);
        for k in 0..30 {
            let own = regressed(&table, &values, &table.row(k).to_vec()).unwrap();
            assert!((own - linfa[k]).abs() < 1e-9, "{own} {}", linfa[k]);
        }
    }
}
