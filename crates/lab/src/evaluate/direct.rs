//! The regression that the paper of Avril, Gouranton and Arnaldi (2011) asks for: positions of crossovers, directly from
//! hardware parameters, and a choice by the number of objects alone. Kept as a baseline.

use super::regret_table::Strategy;
use crate::data::{Profile, figure};
use crate::fit::columns::Columns;
use crate::paired::{Crossing, PairedRatio, PairedSamples};
use anyhow::{Context, Result};
use linfa::DatasetBase;
use linfa::traits::Fit;
use linfa_linear::LinearRegression;
use ndarray::{Array1, Array2, Axis};
use sapwise::hardware::ParameterId;
use sapwise::stats::mean;
use sapwise::{AlgorithmId, BackendClass, Hardware};

/// Parameters that a crossover is regressed on by least squares, as logarithms. Few, because there are as few rows as reports.
const PARAMETERS: [&str; 4] = [
    ParameterId::ClockMeasuredGhz.as_str(),
    ParameterId::SimdLanes.as_str(),
    ParameterId::ScalingAllThreadsRatio.as_str(),
    ParameterId::ForkJoinColdNs.as_str(),
];

/// The same of a crossover between the CPU and a GPU, or between two methods on GPUs.
const GPU_PARAMETERS: [&str; 4] = [
    ParameterId::ScalingAllThreadsRatio.as_str(),
    "gpu/round_trip_ns",
    "gpu/upload_rate_gb_per_s",
    "gpu/arithmetic_gflop_per_s",
];

/// A method on one thread or on all threads of its machine, on one GPU or on all: counts differ between machines, these do not.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Role {
    class: BackendClass,
    method: String,
    /// All threads, or all GPUs; `false` where there is only one.
    all: bool,
}

impl std::fmt::Display for Role {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let units = match (self.class, self.all) {
            (BackendClass::Cpu, false) => "one thread",
            (BackendClass::Cpu, true) => "all threads",
            (BackendClass::Gpu, false) => "one GPU",
            (BackendClass::Gpu, true) => "all GPUs",
        };
        write!(f, "{} on {units}", self.method)
    }
}

/// Which of two roles is cheaper at which sizes on one machine.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RoleOutcome {
    pub(super) first: Role,
    pub(super) second: Role,
    /// Ascending; none where one of the two is always cheaper.
    crossings: Vec<Crossing>,
    first_is_cheaper: bool,
}

impl RoleOutcome {
    /// Natural logarithm of the objects at the last crossover, and whether the first is the cheaper one below it.
    pub(super) fn last_crossover(&self) -> Option<(f64, bool)> {
        self.crossings.last().map(|c| (c.objects.ln(), c.first_below))
    }

    /// The parameters that its crossover is regressed on.
    pub(super) fn parameters(&self) -> [&'static str; 4] {
        parameters(&self.first, &self.second)
    }
}

fn parameters(a: &Role, b: &Role) -> [&'static str; 4] {
    if [a, b].iter().any(|role| role.class == BackendClass::Gpu) { GPU_PARAMETERS } else { PARAMETERS }
}

/// What is found for each two roles of a profile in its scenario `uniform`, or its first one.
pub(super) fn role_outcomes(profile: &Profile) -> Vec<RoleOutcome> {
    let scenario = profile.usual_scenario();
    let ids: Vec<AlgorithmId> = profile.algorithms.iter().map(|t| t.id.clone()).collect();
    let roles = roles(&ids);
    let medians = |id: &AlgorithmId| -> Vec<Option<[u64; 1]>> {
        let own = profile.position(id);
        let within = profile.points.iter().filter(|p| p.scenario == scenario);
        // In picoseconds: only ratios count, and short times would lose digits as whole nanoseconds.
        within.map(|p| p.of_position(own?).map(|ns| [(1e3 * ns).round() as u64])).collect()
    };
    let objects: Vec<u32> = profile.points.iter().filter(|p| p.scenario == scenario).map(|p| p.load.objects).collect();
    let timed: Vec<Vec<Option<[u64; 1]>>> = roles.iter().map(|(_, id)| medians(id)).collect();
    let mut outcomes = Vec::new();
    for a in 0..roles.len() {
        for b in a + 1..roles.len() {
            let both = objects.iter().zip(timed[a].iter().zip(&timed[b]));
            let points: Vec<PairedSamples<'_>> = both
                .filter_map(|(&objects, (first, second))| {
                    Some(PairedSamples { objects, first_ns: first.as_ref()?, second_ns: second.as_ref()? })
                })
                .collect();
            if let Some(ratio) = PairedRatio::new(&points) {
                outcomes.push(RoleOutcome {
                    first: roles[a].0.clone(),
                    second: roles[b].0.clone(),
                    crossings: ratio.crossings(),
                    first_is_cheaper: ratio.first_is_cheaper(),
                });
            }
        }
    }
    outcomes
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
enum Prediction {
    Always { first: bool },
    At { ln_objects: f64, first_below: bool },
}

impl Prediction {
    fn first_wins(self, ln_objects: f64) -> bool {
        match self {
            Self::Always { first } => first,
            Self::At { ln_objects: at, first_below } => (ln_objects < at) == first_below,
        }
    }
}

/// The direct regression by least squares, applied to a machine: the winner of most comparisons in pairs is chosen. `training` are profiles
/// with what was found for their roles. Adds to `notes` how many of its crossovers are means because there were too few for a
/// regression, and how many rest on profiles of high leverage.
///
/// # Errors
/// When linfa refuses a fit.
pub(super) fn direct<'a>(
    training: &[(&Profile, &[RoleOutcome])],
    hardware: &Hardware,
    available: &[AlgorithmId],
    notes: &mut Vec<String>,
) -> Result<Strategy<'a>> {
    let roles = roles(available);
    let mut predictions = Vec::new();
    let (mut means, mut far) = (0, 0);
    for a in 0..roles.len() {
        for b in a + 1..roles.len() {
            if let Some((prediction, estimate)) = predict(training, hardware, &roles[a].0, &roles[b].0)? {
                means += usize::from(estimate.is_some_and(|e| e.mean));
                far += usize::from(estimate.is_some_and(|e| e.far_rows > 0));
                predictions.push((a, b, prediction));
            }
        }
    }
    let count = predictions.len();
    if means > 0 {
        notes.push(format!(
            "direct regression: {means} of {count} crossovers are means, there being no more crossings than parameters"
        ));
    }
    if far > 0 {
        notes.push(format!(
            "direct regression: {far} of {count} crossovers rest on a profile with over twice the mean leverage"
        ));
    }
    Ok(Box::new(move |load| {
        let ln_objects = f64::from(load.objects.max(1)).ln();
        let mut wins = vec![0; roles.len()];
        for &(a, b, prediction) in &predictions {
            wins[if prediction.first_wins(ln_objects) { a } else { b }] += 1;
        }
        let most = wins.iter().max()?;
        wins.iter().position(|w| w == most).map(|k| roles[k].1.clone())
    }))
}

/// What is predicted for a pair, and the estimate behind it where it is regressed. `None` where no machine of the training has both.
///
/// Where most machines have a crossover it is regressed over those, the last of several; the others are not used, which is
/// the weakness of this method. Where most have none, the more frequent winner always wins.
fn predict(
    training: &[(&Profile, &[RoleOutcome])],
    hardware: &Hardware,
    a: &Role,
    b: &Role,
) -> Result<Option<(Prediction, Option<Estimate>)>> {
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
        return Ok(Some((Prediction::Always { first: firsts >= seconds }, None)));
    }
    let first_below = 2 * crossed.iter().filter(|(_, p)| p.first_below).count() >= crossed.len();
    let rows: Vec<_> = crossed.into_iter().filter(|(_, p)| p.first_below == first_below).collect();
    let machines: Vec<&Hardware> = rows.iter().map(|r| r.0).collect();
    let ln_objects: Vec<f64> = rows.iter().map(|r| r.1.objects.ln()).collect();
    let estimate = estimate(&parameters(a, b), &machines, &ln_objects, hardware)?;
    Ok(Some((Prediction::At { ln_objects: estimate.value, first_below }, Some(estimate))))
}

/// What a regression says of a machine.
#[derive(Debug, Clone, Copy)]
struct Estimate {
    value: f64,
    /// There was too little for a regression: it is the mean.
    mean: bool,
    /// Rows of high leverage, see [`Columns::far_rows`].
    far_rows: usize,
}

/// Values on the logarithms of the parameters, evaluated for a machine. Parameters that are missing anywhere or say nothing of their own are
/// not used; fewer of them where one row alone would decide a coefficient. The mean where there are not more rows than coefficients.
///
/// # Errors
/// When linfa refuses a fit.
fn estimate(names: &[&str], machines: &[&Hardware], values: &[f64], hardware: &Hardware) -> Result<Estimate> {
    let logarithm = |h: &Hardware, name: &str| figure(h, name).filter(|v| *v > 0.0).map(f64::ln);
    let there = |name: &&str| machines.iter().chain([&hardware]).all(|h| logarithm(h, name).is_some());
    let names: Vec<&str> = names.iter().copied().filter(there).collect();
    let row = |h: &Hardware| names.iter().map(|name| logarithm(h, name).unwrap_or_default()).collect::<Vec<f64>>();
    let table = Array2::from_shape_fn((machines.len(), names.len()), |(k, j)| {
        logarithm(machines[k], names[j]).unwrap_or_default()
    });
    let (line, far_rows) = Line::least_squares(&table, values)?;
    Ok(Estimate { value: line.at(&row(hardware)), mean: line.columns.kept.is_empty(), far_rows })
}

/// A fitted linear function of a row of figures.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) columns: Columns,
    /// The value where every figure is at its mean.
    pub(super) intercept: f64,
    /// One for each kept column, against its standardised figures.
    pub(super) slopes: Vec<f64>,
}

impl Line {
    /// Ordinary least squares over a table of shape (rows, figures), and how many rows have a high leverage; the mean when
    /// there are not more rows than coefficients.
    pub(super) fn least_squares(table: &Array2<f64>, values: &[f64]) -> Result<(Self, usize)> {
        let columns = Columns::new(table, &vec![1.0; values.len()]);
        if values.len() <= columns.kept.len() + 1 {
            return Ok((Self::mean(table, values), 0));
        }
        let columns = columns.without_lone_rows();
        if columns.kept.is_empty() {
            return Ok((Self::mean(table, values), 0));
        }
        let data = DatasetBase::new(columns.values.clone(), Array1::from(values.to_vec()));
        let fitted = LinearRegression::new().fit(&data).context("the direct regression of crossovers failed")?;
        let far_rows = columns.far_rows();
        Ok((Self { columns, intercept: fitted.intercept(), slopes: fitted.params().to_vec() }, far_rows))
    }

    fn mean(table: &Array2<f64>, values: &[f64]) -> Self {
        let columns = Columns::new(&table.select(Axis(1), &[]), &vec![1.0; values.len()]);
        Self { columns, intercept: mean(values), slopes: Vec::new() }
    }

    /// The value at a row with as many figures as the table has.
    pub(super) fn at(&self, figures: &[f64]) -> f64 {
        let c = &self.columns;
        let term = |j: usize| self.slopes[j] * (figures[c.kept[j]] - c.centres[j]) / c.scales[j];
        self.intercept + (0..self.slopes.len()).map(term).sum::<f64>()
    }
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
            let mut notes = Vec::new();
            let choose = direct(&training, &profiles[6].hardware, &profiles[6].available(), &mut notes).unwrap();
            let regret = RegretTable::new(&profiles[6]).regret(&profiles[6], &choose).mean;
            assert!(regret < 1.0, "{regret} {notes:?}");
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
        let found = of(6);
        assert!((found.value - values[6]).abs() < 1e-6 && !found.mean, "{found:?}");
        let found = of(3);
        assert!((found.value - mean(&values[..3])).abs() < 1e-12 && found.mean, "{found:?}");
    }

    #[test]
    fn a_parameter_of_one_machine_only_is_not_used() {
        // Nine machines of which only the last has other lanes; its crossover is far off for another reason.
        let mut random = Random::named(23, &[]);
        let table = Array2::from_shape_fn((9, 2), |(k, j)| if j == 0 { random.normal() } else { f64::from(k == 8) });
        let values: Vec<f64> = (0..9).map(|k| 5.0 + table[[k, 0]] + if k == 8 { 4.0 } else { 0.0 }).collect();
        let (line, far_rows) = Line::least_squares(&table, &values).unwrap();
        assert_eq!(line.columns.kept, [0]);
        assert!(far_rows <= 1);
    }

    #[test]
    fn plain_arithmetic_predicts_what_linfa_does() {
        let mut random = Random::named(29, &[]);
        let table = Array2::from_shape_fn((30, 4), |(_, j)| [3.0, 0.1, 40.0, 7.0][j] * (2.0 + random.normal()));
        let values: Vec<f64> =
            table.rows().into_iter().map(|r| 2.0 + 0.3 * r[0] - 5.0 * r[1] + 0.1 * random.normal()).collect();
        let columns = Columns::new(&table, &[1.0; 30]);
        let data = DatasetBase::new(columns.values.clone(), Array1::from(values.clone()));
        let line = Line::least_squares(&table, &values).unwrap().0;
        let linfa = LinearRegression::new().fit(&data).unwrap().predict(&columns.values);
        for k in 0..30 {
            let own = line.at(&table.row(k).to_vec());
            assert!((own - linfa[k]).abs() < 1e-9, "{own} {}", linfa[k]);
        }
    }
}
