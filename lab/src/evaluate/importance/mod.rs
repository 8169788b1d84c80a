//! Which hardware parameters matter for which border, judged on machines that were left out.

mod borders;
mod figure;
mod interval;
mod judge;
#[cfg(test)]
mod tests;
mod verdict;

use super::fit::Designs;
use super::model::model;
use super::partition::Partition;
use super::profile::{Profile, machines};
use super::yardstick::average;
use crate::progress::Progress;
use sapwise_scenes::Random;
use anyhow::{Context, Result};
use figure::Figure;
use judge::{Judge, Outcome, Shifts, What};
use rayon::prelude::*;
use sapwise::Model;
use sapwise::stats::median;
use serde::Serialize;
use std::collections::BTreeMap;
use verdict::FEWEST_MACHINES;

pub(crate) use borders::measured_borders;
pub(crate) use interval::Interval;
pub(crate) use verdict::{Effect, Verdict};

/// Folds of whole machines. Each costs a fit of everything for each parameter, and of ten machines or more a sixth tells little more
/// than a tenth.
const MOST_FOLDS: usize = 6;
/// Machines that are looked at, at most, evenly taken: intervals over more say little more, and each of their profiles is predicted
/// anew for each parameter and order.
const MOST_MACHINES: usize = 60;
/// Orders in which the machines exchange the values of a parameter.
const PERMUTATIONS: usize = 8;
/// Seed of these orders.
const SEED: u64 = 1;
/// A rise of the mean regret that matters: half a percentage point.
const LEAST_REGRET: f64 = 0.005;
/// A shift of a border that matters, in octaves: 7 % more objects.
const LEAST_OCTAVES: f64 = 0.1;
/// A rise of the distance between predicted and measured times that matters: 2 %.
const LEAST_LN: f64 = 0.02;

/// What each hardware parameter is worth to predictions of machines that were left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Importance {
    /// What is left out together, in words.
    pub(crate) held_out: String,
    /// Physical machines.
    pub(crate) physical_machines: usize,
    /// Reports of them.
    pub(crate) profiles: usize,
    /// Orders in which the machines exchanged values.
    pub(crate) permutations: usize,
    /// Mean regret with every parameter as it is, of these folds, each machine counting the same; none of too few machines.
    pub(crate) mean_regret: Option<f64>,
    /// In the order of a report: those of the machine, then those of its GPUs.
    pub(crate) parameters: Vec<OfParameter>,
    /// For each method on a class of processor and each physical machine the mean logarithm of measured over predicted time when it
    /// was left out, with every parameter as it is: what predictions leave.
    pub(crate) left_ln: BTreeMap<String, BTreeMap<String, f64>>,
    /// In sentences, what the figures don't say.
    pub(crate) notes: Vec<String>,
}

/// What one parameter is worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct OfParameter {
    /// Its name in the ranges of a model.
    pub(crate) parameter: String,
    /// Physical machines that have it: only they count.
    pub(crate) physical_machines: usize,
    /// Standard deviation of its base-2 logarithm over them.
    pub(crate) deviation_octaves: f64,
    /// Rise of the mean regret.
    pub(crate) regret_rise: Effect,
    /// The algorithms, each method on a class of processor.
    pub(crate) algorithms: Vec<OfAlgorithm>,
    /// The borders between pairs of algorithms.
    pub(crate) borders: Vec<OfBorder>,
}

/// What one parameter is worth to the predicted times of one method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct OfAlgorithm {
    /// The method and its class of processor.
    pub(crate) algorithm: String,
    /// Physical machines that have the parameter and timings of it.
    pub(crate) physical_machines: usize,
    /// Rise of the mean distance between predicted and measured times, as the absolute value of a natural logarithm.
    pub(crate) distance_rise_ln: Effect,
}

/// What one parameter is worth to one border in the slice of the usual scenario. A border that is not there counts as lying at
/// an end of the slice.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct OfBorder {
    /// The two sides.
    pub(crate) border: String,
    /// Physical machines that have the parameter and both sides.
    pub(crate) physical_machines: usize,
    /// How far the predicted border moves with the value of another machine, to either side.
    pub(crate) permuted_moves_octaves: Option<Interval>,
    /// Rise of the distance between the predicted and the measured border.
    pub(crate) error_rise_octaves: Effect,
}

/// Looks at one parameter after the other: on machines left out it is given the values of others (permutation, after Breiman 2001),
/// and everything is fitted anew with one value of it for all machines.
///
/// The two differ where parameters go together: a model may rely on one that another would stand in for. Of fewer than five
/// physical machines nothing is told, and nothing is computed.
///
/// # Errors
/// When a model can't be fitted without a fold.
pub(crate) fn importance(profiles: &[Profile]) -> Result<Importance> {
    let all = machines(profiles);
    let step = all.len().div_ceil(MOST_MACHINES).max(1);
    if step == 1 {
        return of_machines(profiles, &all);
    }
    let kept: Vec<&str> = all.iter().step_by(step).copied().collect();
    let some: Vec<Profile> = profiles.iter().filter(|p| kept.contains(&p.machine())).cloned().collect();
    let mut found = of_machines(&some, &kept)?;
    found.notes.insert(0, format!("{} of {} physical machines are looked at here, evenly taken", kept.len(), all.len()));
    Ok(found)
}

fn of_machines(profiles: &[Profile], machines: &[&str]) -> Result<Importance> {
    let partition = Partition::of_machines(profiles, MOST_FOLDS).filter(|_| machines.len() >= FEWEST_MACHINES);
    let mut found = Importance {
        held_out: String::new(),
        physical_machines: machines.len(),
        profiles: profiles.len(),
        permutations: PERMUTATIONS,
        mean_regret: None,
        parameters: Vec::new(),
        left_ln: BTreeMap::new(),
        notes: Vec::new(),
    };
    let Some(partition) = partition else {
        found.notes.push(format!(
            "nothing is told: there are {} physical machines, and it takes {FEWEST_MACHINES}; add reports of other machines",
            machines.len()
        ));
        found.parameters = Figure::ALL
            .into_iter()
            .map(|figure| of_parameter(figure, machines, profiles, &Shifts::default(), &Shifts::default()))
            .collect();
        return Ok(found);
    };
    found.held_out = partition.held_out.clone();
    let progress = Progress::new((partition.folds.len() * (Figure::ALL.len() + 1)) as u64);
    progress.message("fitting without each parameter");
    let fits = |profiles: &[Profile]| -> Result<Vec<Model>> {
        let designs = Designs::new(profiles);
        let fitted = partition.folds.par_iter().map(|fold| {
            let chosen: Vec<bool> = (0..profiles.len()).map(|k| !fold.contains(&k)).collect();
            let model = model(profiles, &designs, &chosen, "importance").map(|m| m.0);
            progress.advance(1);
            model.with_context(|| format!("no importance is told when {} is left out", profiles[fold[0]].file))
        });
        fitted.collect()
    };
    let fold_of = |k: usize| partition.folds.iter().position(|fold| fold.contains(&k)).unwrap_or_default();
    let judges: Vec<Judge<'_>> = profiles.par_iter().map(Judge::new).collect();
    let models = fits(profiles)?;
    let outcomes: Vec<Outcome> =
        (0..profiles.len()).into_par_iter().map(|k| judges[k].outcome(&models[fold_of(k)], &profiles[k].hardware)).collect();
    let position = |k: usize| machines.binary_search(&profiles[k].machine()).unwrap_or_default();
    let one = |figure: Figure| -> Result<OfParameter> {
        let values = values(figure, profiles, machines);
        let Some(middle) = median(&values.values().copied().collect::<Vec<f64>>()) else {
            return Ok(of_parameter(figure, machines, profiles, &Shifts::default(), &Shifts::default()));
        };
        let with: Vec<usize> = (0..profiles.len()).filter(|&k| values.contains_key(&position(k))).collect();
        let donors = donors(&values);
        let permuted = with.par_iter().map(|&k| {
            let mut shifts = Shifts::default();
            for donors in &donors {
                let factor = values[&donors[&position(k)]] / values[&position(k)];
                let other = figure.times(&profiles[k].hardware, factor);
                shifts.add(position(k), &judges[k], &outcomes[k], &judges[k].outcome(&models[fold_of(k)], &other));
            }
            shifts
        });
        let permuted = permuted.reduce(Shifts::default, Shifts::and);
        let without: Vec<Profile> = profiles.iter().map(|p| figure.replaced(p, middle)).collect();
        let models = fits(&without)?;
        let refitted = with.par_iter().map(|&k| {
            let mut shifts = Shifts::default();
            let outcome = judges[k].outcome(&models[fold_of(k)], &without[k].hardware);
            shifts.add(position(k), &judges[k], &outcomes[k], &outcome);
            shifts
        });
        let refitted = refitted.reduce(Shifts::default, Shifts::and);
        Ok(of_parameter(figure, machines, profiles, &permuted, &refitted))
    };
    found.parameters = Figure::ALL.into_par_iter().map(one).collect::<Result<_>>()?;
    found.left_ln = left(profiles, &outcomes);
    let mut regrets: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    outcomes.iter().enumerate().for_each(|(k, o)| regrets.entry(position(k)).or_default().push(o.regret));
    found.mean_regret = Some(average(&regrets.values().map(|r| average(r)).collect::<Vec<_>>()));
    found.notes = notes(&found);
    Ok(found)
}

/// What predictions leave of each machine: the mean over its profiles.
fn left(profiles: &[Profile], outcomes: &[Outcome]) -> BTreeMap<String, BTreeMap<String, f64>> {
    let mut found: BTreeMap<String, BTreeMap<String, Vec<f64>>> = BTreeMap::new();
    for (profile, outcome) in profiles.iter().zip(outcomes) {
        for (algorithm, off) in &outcome.off {
            let machines = found.entry(algorithm.clone()).or_default();
            machines.entry(profile.machine().to_owned()).or_default().push(off.mean_ln);
        }
    }
    let means = |machines: BTreeMap<String, Vec<f64>>| machines.into_iter().map(|(k, lns)| (k, average(&lns))).collect();
    found.into_iter().map(|(algorithm, machines)| (algorithm, means(machines))).collect()
}

/// The value of each machine that has it: the median over its profiles.
fn values(figure: Figure, profiles: &[Profile], machines: &[&str]) -> BTreeMap<usize, f64> {
    let of = |machine: &str| {
        let own = profiles.iter().filter(|p| p.machine() == machine).filter_map(|p| figure.value(&p.hardware));
        median(&own.collect::<Vec<f64>>())
    };
    machines.iter().enumerate().filter_map(|(k, machine)| Some((k, of(machine)?))).collect()
}

/// For each permutation the machine whose value each one gets.
fn donors(values: &BTreeMap<usize, f64>) -> Vec<BTreeMap<usize, usize>> {
    let mut random = Random::new(SEED);
    let machines: Vec<usize> = values.keys().copied().collect();
    let one = |order: Vec<usize>| machines.iter().zip(order).map(|(&k, donor)| (k, machines[donor])).collect();
    (0..PERMUTATIONS).map(|_| one(random.shuffled(machines.len()))).collect()
}

fn of_parameter(
    figure: Figure,
    machines: &[&str],
    profiles: &[Profile],
    permuted: &Shifts,
    refitted: &Shifts,
) -> OfParameter {
    let logs: Vec<f64> = values(figure, profiles, machines).values().map(|v| v.log2()).collect();
    let mean = average(&logs);
    let deviation = average(&logs.iter().map(|v| (v - mean).powi(2)).collect::<Vec<f64>>()).sqrt();
    let effect = |what: What, border: &str, machines: usize, least: f64| {
        Effect::new(permuted.interval(what, border), refitted.interval(what, border), machines, deviation, least)
    };
    let of_border = |border: &str| {
        let machines = permuted.machines(What::Error, border);
        OfBorder {
            border: border.to_owned(),
            physical_machines: machines,
            permuted_moves_octaves: permuted.interval(What::Moves, border).filter(|_| machines >= FEWEST_MACHINES),
            error_rise_octaves: effect(What::Error, border, machines, LEAST_OCTAVES),
        }
    };
    let of_algorithm = |algorithm: &str| {
        let machines = permuted.machines(What::Time, algorithm);
        OfAlgorithm {
            algorithm: algorithm.to_owned(),
            physical_machines: machines,
            distance_rise_ln: effect(What::Time, algorithm, machines, LEAST_LN),
        }
    };
    OfParameter {
        parameter: figure.name(),
        physical_machines: logs.len(),
        deviation_octaves: deviation,
        regret_rise: effect(What::Regret, "", logs.len(), LEAST_REGRET),
        algorithms: permuted.of(What::Time).into_iter().map(of_algorithm).collect(),
        borders: permuted.of(What::Error).into_iter().map(of_border).collect(),
    }
}

fn notes(found: &Importance) -> Vec<String> {
    let told = found.parameters.iter().map(|p| 1 + p.algorithms.len() + p.borders.len()).sum::<usize>();
    vec![
        format!(
            "these are {told} verdicts by intervals of 90 %: up to one in ten of those that hold nothing, more with few machines, is `linked` by \
             chance"
        ),
        "a link is one of the model that was fitted, on these machines; it says what predicts, not what causes".to_owned(),
        "the intervals are over machines, each with the models that were fitted without it; the models are not drawn"
            .to_owned(),
    ]
}

impl Importance {
    /// What is to be read of it, as a table that `draw` draws, and the notes.
    pub(crate) fn page(&self, draw: impl Fn(&[Vec<String>]) -> String) -> String {
        let mut rows = vec![
            ["parameter", "machines", "permuted", "fitted without", "choice", "linked borders"].map(str::to_owned).to_vec(),
        ];
        let points = |i: &Option<Interval>| {
            i.map_or("-".to_owned(), |i| format!("{:+.1} ({:+.1} to {:+.1})", i.mean * 100.0, i.low * 100.0, i.high * 100.0))
        };
        for p in &self.parameters {
            let linked = p.borders.iter().filter(|b| b.error_rise_octaves.verdict == Verdict::Linked);
            let name = |b: &OfBorder| {
                let octaves = b.permuted_moves_octaves.map_or(0.0, |i| i.mean);
                format!("{} ({octaves:.1})", b.border)
            };
            let linked: Vec<String> = linked.map(name).collect();
            let Effect { permuted, refitted, verdict, .. } = &p.regret_rise;
            rows.push(vec![
                p.parameter.clone(),
                p.physical_machines.to_string(),
                points(permuted),
                points(refitted),
                verdict.to_string(),
                linked.join("; "),
            ]);
        }
        let mut text = self.mean_regret.map_or_else(String::new, |regret| {
            format!(
                "Mean regret on machines left out: {:.1} %. Percentage points that are added by the values of other machines, and by \
                 one value for all,\nwith 90 % intervals; in brackets how many octaves a linked border moves with the value of another machine.\n\n",
                regret * 100.0
            )
        });
        text.push_str(&draw(&rows));
        self.notes.iter().for_each(|note| text.push_str(&format!("\n{note}\n")));
        text
    }
}
