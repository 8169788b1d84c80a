//! The regression that the paper of Avril, Gouranton and Arnaldi (2011) asks for: positions of crossovers, directly from
//! hardware parameters, and a choice by the number of objects alone. Kept as a baseline.

pub(super) mod regression;

use super::baselines::slice_scenario;
use super::profile::{Profile, is_sound};
use super::yardstick::Chooser;
use super::{GPU_PARAMETERS as ALL_OF_GPU, PARAMETERS as ALL_OF_CPU};
use anyhow::Result;
use regression::{Estimate, Regression};
use sapwise::crossover::{Crossover, Paired, crossover};
use sapwise::hardware::ParameterId;
use sapwise::model::GPU_PREFIX;
use sapwise::report::{Point, Report, Timed};
use sapwise::{AlgorithmId, BackendClass, Hardware};

/// Parameters that a crossover is regressed on by least squares, as logarithms. Few, because there are as few rows as reports.
const PARAMETERS: [&str; 4] = [
    ParameterId::ClockMeasuredGhz,
    ParameterId::SimdLanes,
    ParameterId::ScalingAllThreadsRatio,
    ParameterId::ForkJoinColdNs,
];

/// The same of a border between the CPU and a GPU, or between two methods on GPUs.
const GPU_PARAMETERS: [&str; 4] =
    [ParameterId::ScalingAllThreadsRatio, "gpu/round_trip_ns", "gpu/upload_rate_gb_per_s", "gpu/arithmetic_gflop_per_s"];

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

impl Crossing {
    /// Whether both of its methods are among these algorithms, on their class of processor.
    pub(super) fn is_between(&self, algorithms: &[Timed]) -> bool {
        let there =
            |role: &Role| algorithms.iter().any(|t| t.id.method() == role.method && t.id.backend().class() == role.class);
        there(&self.first) && there(&self.second)
    }
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
    let samples = |p: &'a Point, id: &AlgorithmId| {
        p.timings.iter().find(|t| t.algorithm == *id && is_sound(t)).map(|t| &t.samples_ns[..])
    };
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

/// The direct regression by least squares, applied to a machine: whoever wins most comparisons in pairs is chosen. Adds to
/// `notes` how many of its borders are means because there were too few crossings for a regression, and how many rest on
/// profiles of high leverage.
///
/// # Errors
/// When linfa refuses a fit.
pub(crate) fn direct<'a>(
    training: &[&Profile],
    hardware: &Hardware,
    available: &[AlgorithmId],
    notes: &mut Vec<String>,
) -> Result<Chooser<'a>> {
    chooser(Regression::LeastSquares, training, hardware, available, notes)
}

/// [`direct`] by an elastic net on all parameters by which machines are compared, those of GPUs where a GPU takes part. Its
/// penalty is chosen by leaving out physical machines of the training.
///
/// # Errors
/// When linfa refuses a fit.
pub(crate) fn direct_elastic_net<'a>(
    training: &[&Profile],
    hardware: &Hardware,
    available: &[AlgorithmId],
    notes: &mut Vec<String>,
) -> Result<Chooser<'a>> {
    chooser(Regression::ElasticNet, training, hardware, available, notes)
}

fn chooser<'a>(
    regression: Regression,
    training: &[&Profile],
    hardware: &Hardware,
    available: &[AlgorithmId],
    notes: &mut Vec<String>,
) -> Result<Chooser<'a>> {
    let roles = roles(available);
    let mut borders = Vec::new();
    let (mut means, mut far) = (0, 0);
    for a in 0..roles.len() {
        for b in a + 1..roles.len() {
            if let Some((border, estimate)) = border(regression, training, hardware, &roles[a].0, &roles[b].0)? {
                means += usize::from(estimate.is_some_and(|e| e.mean));
                far += usize::from(estimate.is_some_and(|e| e.far_rows > 0));
                borders.push((a, b, border));
            }
        }
    }
    let (name, too_few) = match regression {
        Regression::LeastSquares => ("direct regression", "there being no more crossings than parameters"),
        Regression::ElasticNet => ("direct elastic net", "there being fewer than three crossings"),
    };
    if means > 0 {
        notes.push(format!("{name}: {means} of {} borders are means, {too_few}", borders.len()));
    }
    if far > 0 {
        let count = borders.len();
        notes.push(format!("{name}: {far} of {count} borders rest on a profile with over twice the mean leverage"));
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

/// The border of a pair, and its estimate where it is regressed. `None` where no machine of the training has both.
///
/// Where most machines have a crossing it is regressed over those, the last of several; the others are not used, which is
/// the weakness of this method. Where most have none, the more frequent winner always wins.
fn border(
    regression: Regression,
    training: &[&Profile],
    hardware: &Hardware,
    a: &Role,
    b: &Role,
) -> Result<Option<(Border, Option<Estimate>)>> {
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
        return Ok(Some((Border::Always { first: firsts >= seconds }, None)));
    }
    let first_below = 2 * crossed.iter().filter(|(_, p)| p.first_below).count() >= crossed.len();
    let rows: Vec<_> = crossed.into_iter().filter(|(_, p)| p.first_below == first_below).collect();
    let machines: Vec<&Hardware> = rows.iter().map(|r| r.0).collect();
    let ln_objects: Vec<f64> = rows.iter().map(|r| r.1.objects.ln()).collect();
    let names = names(regression, [a, b].iter().any(|role| role.class == BackendClass::Gpu));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let estimate = regression.estimate(&names, &machines, &ln_objects, hardware)?;
    Ok(Some((Border::At { ln_objects: estimate.value, first_below }, Some(estimate))))
}

/// The parameters that a border is regressed on.
fn names(regression: Regression, on_gpu: bool) -> Vec<String> {
    let of_gpu = ALL_OF_GPU.map(|name| format!("{GPU_PREFIX}{name}"));
    match regression {
        Regression::LeastSquares => if on_gpu { GPU_PARAMETERS } else { PARAMETERS }.map(str::to_owned).to_vec(),
        Regression::ElasticNet => {
            ALL_OF_CPU.map(str::to_owned).into_iter().chain(of_gpu.into_iter().filter(|_| on_gpu)).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::baselines::available;
    use super::super::synthetic::Machine;
    use super::super::yardstick::Yardstick;
    use super::*;

    #[test]
    fn both_choose_better_than_nothing_on_a_machine_they_have_not_seen() {
        for machines in [Machine::family(), Machine::family_with_gpus()] {
            let profiles: Vec<Profile> = machines.into_iter().map(|m| Profile::of("", &m.report())).collect();
            let training: Vec<&Profile> = profiles[..6].iter().collect();
            let available = available(&profiles[6]);
            let hardware = &profiles[6].hardware;
            let mut notes = Vec::new();
            let ways = [
                direct(&training, hardware, &available, &mut notes).unwrap(),
                direct_elastic_net(&training, hardware, &available, &mut notes).unwrap(),
            ];
            for choose in &ways {
                let regret = Yardstick::new(&profiles[6]).regret(&profiles[6], choose).mean;
                assert!(regret < 1.0, "{regret} {notes:?}");
            }
        }
    }

    #[test]
    fn the_elastic_net_takes_the_parameters_of_gpus_where_one_takes_part() {
        assert_eq!(names(Regression::ElasticNet, false).len(), ALL_OF_CPU.len());
        let all = names(Regression::ElasticNet, true);
        assert_eq!(all.len(), ALL_OF_CPU.len() + ALL_OF_GPU.len());
        let gpu = &Machine::family_with_gpus()[0].hardware();
        assert!(all.iter().filter(|n| n.starts_with(GPU_PREFIX)).any(|n| super::super::figure(gpu, n).is_some()));
    }
}
