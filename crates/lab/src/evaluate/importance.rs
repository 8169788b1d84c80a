//! What each hardware parameter is worth to predictions of machines that were held out: everything is fitted again with one value of it for
//! all machines.

mod figure;
#[cfg(test)]
mod tests;
mod verdict;

use super::baselines::by_costs;
use super::partition::Partition;
use super::regret_table::{NOT_TIMED, RegretTable};
use crate::data::{Profile, machines};
use crate::fit::{Designs, TrainingSet, model};
use crate::progress::Progress;
use crate::spread;
use anyhow::{Context, Result};
use figure::Figure;
use rayon::prelude::*;
use sapwise::Model;
use sapwise::stats::{mean, median};
use serde::Serialize;
use std::collections::BTreeMap;
use verdict::FEWEST_MACHINES;

pub use verdict::{Effect, Interval, Verdict};

/// Folds of whole machines. Each costs a fit of everything for each parameter, and of ten machines or more a sixth tells little more
/// than a tenth.
const MOST_FOLDS: usize = 6;
/// Machines that are looked at, at most, evenly taken: intervals over more say little more.
const MOST_MACHINES: usize = 60;
/// A rise of the mean regret that matters: half a percentage point.
const LEAST_REGRET: f64 = 0.005;
/// A rise of the distance between predicted and measured times that matters: 2 %.
const LEAST_LN: f64 = 0.02;

/// What each hardware parameter is worth to predictions of machines that were held out.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Importance {
    /// Mean regret with every parameter as it is, each machine counting the same; `None` of too few machines.
    pub mean_regret: Option<Interval>,
    /// In the order of a report: those of the machine, then those of its GPUs.
    pub parameters: Vec<OfParameter>,
    /// In sentences, what the figures don't say.
    pub notes: Vec<String>,
}

/// What one parameter is worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OfParameter {
    /// Its name in the ranges of a model.
    pub parameter: String,
    /// Physical machines that have it: only they count.
    pub physical_machines: usize,
    /// Rise of the mean regret.
    pub regret_rise: Effect,
    /// For each method on a class of processor the rise of the mean distance between predicted and measured times, as the absolute value
    /// of a natural logarithm.
    pub distance_rise_ln: BTreeMap<String, Effect>,
}

/// What came of the prediction of a profile.
#[derive(Debug, Clone, PartialEq)]
struct Outcome {
    regret: f64,
    /// For each method on a class of processor that was predicted the mean distance between measured and predicted time, as the absolute
    /// value of a natural logarithm.
    distances: BTreeMap<String, f64>,
}

/// Values of profiles by their physical machine.
type ByMachine<'a> = BTreeMap<&'a str, Vec<f64>>;

/// Looks at one parameter after the other: everything is fitted again with one value of it for all machines, in the training too, and the
/// machines that were held out are predicted. What another parameter can stand in for is worth nothing by that.
///
/// Of fewer than five physical machines nothing is told, and nothing is computed. Each fit is a step of `progress`.
///
/// # Errors
/// When a model can't be fitted without a fold, or the user asked to stop.
pub fn importance(profiles: &[Profile], progress: &dyn Progress) -> Result<Importance> {
    let all = machines(profiles);
    let kept: Vec<&str> = all.iter().step_by(all.len().div_ceil(MOST_MACHINES).max(1)).copied().collect();
    let some: Vec<Profile> = profiles.iter().filter(|p| kept.contains(&p.machine())).cloned().collect();
    let partition = Partition::of_machines(&some, MOST_FOLDS, MOST_FOLDS).filter(|_| kept.len() >= FEWEST_MACHINES);
    let Some(Partition { folds, .. }) = partition else {
        let notes = vec![format!(
            "nothing is told: there are {} physical machines, and it takes {FEWEST_MACHINES}; add reports of other machines",
            kept.len()
        )];
        return Ok(Importance { notes, ..Importance::default() });
    };
    progress.start((folds.len() * (Figure::ALL.len() + 1)) as u64);
    progress.message("fitting without each parameter");
    let tables: Vec<RegretTable> = some.par_iter().map(RegretTable::new).collect();
    let fitted = |profiles: &[Profile]| outcomes(profiles, &folds, &tables, progress);
    let before = fitted(&some)?;
    let one = |figure: Figure| -> Result<OfParameter> {
        let mut values = ByMachine::new();
        for profile in &some {
            figure
                .value(&profile.hardware)
                .into_iter()
                .for_each(|v| values.entry(profile.machine()).or_default().push(v));
        }
        let values: BTreeMap<&str, f64> = values.into_iter().filter_map(|(m, own)| Some((m, median(&own)?))).collect();
        let (mut of_choice, mut of_methods) = (ByMachine::new(), BTreeMap::<String, ByMachine<'_>>::new());
        if let Some(middle) = median(&values.values().copied().collect::<Vec<f64>>()) {
            let without: Vec<Profile> = some.iter().map(|p| figure.replaced(p, middle)).collect();
            for ((profile, before), after) in some.iter().zip(&before).zip(fitted(&without)?) {
                let machine = profile.machine();
                if !values.contains_key(machine) {
                    continue;
                }
                of_choice.entry(machine).or_default().push(after.regret - before.regret);
                for (method, now) in after.distances {
                    if let Some(distance) = before.distances.get(&method) {
                        of_methods.entry(method).or_default().entry(machine).or_default().push(now - distance);
                    }
                }
            }
        }
        let deviation = deviation(&values.values().map(|v| v.log2()).collect::<Vec<f64>>());
        let effect = |of: &ByMachine<'_>, least: f64| Effect::new(&means(of), deviation, least);
        Ok(OfParameter {
            parameter: figure.name(),
            physical_machines: values.len(),
            regret_rise: effect(&of_choice, LEAST_REGRET),
            distance_rise_ln: of_methods.iter().map(|(method, of)| (method.clone(), effect(of, LEAST_LN))).collect(),
        })
    };
    let parameters: Vec<OfParameter> = Figure::ALL.into_par_iter().map(one).collect::<Result<_>>()?;
    let mut regrets = ByMachine::new();
    some.iter().zip(&before).for_each(|(p, o)| regrets.entry(p.machine()).or_default().push(o.regret));
    let told = parameters.iter().map(|p| 1 + p.distance_rise_ln.len()).sum::<usize>();
    let mut notes = vec![
        format!(
            "these are {told} verdicts by intervals of 90 %: up to one in ten of those that hold nothing, more with few machines, is `linked` by \
             chance"
        ),
        "a link is one of the model that was fitted, on these machines; it says what predicts, not what causes"
            .to_owned(),
        "the intervals are over machines, each with the models that were fitted without it; the models are not drawn"
            .to_owned(),
    ];
    if kept.len() < all.len() {
        notes.insert(0, format!("{} of {} physical machines are looked at here, evenly taken", kept.len(), all.len()));
    }
    Ok(Importance { mean_regret: Interval::of(&means(&regrets)), parameters, notes })
}

/// What came of the prediction of each profile by a model that was fitted without its fold.
fn outcomes(
    profiles: &[Profile],
    folds: &[Vec<usize>],
    tables: &[RegretTable],
    progress: &dyn Progress,
) -> Result<Vec<Outcome>> {
    let designs = Designs::new(profiles);
    let fold = |fold: &Vec<usize>| -> Result<Vec<(usize, Outcome)>> {
        progress.check()?;
        let chosen: Vec<bool> = (0..profiles.len()).map(|k| !fold.contains(&k)).collect();
        let model = model(profiles, &designs, TrainingSet::of(&chosen), "importance")
            .with_context(|| format!("no importance is told when {} is held out", profiles[fold[0]].file))?
            .0;
        progress.advance(1);
        Ok(fold.iter().map(|&k| (k, outcome(&profiles[k], &tables[k], &model))).collect())
    };
    // Folds of whole machines hold each profile once.
    let mut all = folds.par_iter().map(fold).collect::<Result<Vec<_>>>()?.concat();
    all.sort_by_key(|(k, _)| *k);
    Ok(all.into_iter().map(|(_, outcome)| outcome).collect())
}

/// What a model predicts for a profile. Where it predicts nothing, nothing is chosen, which is charged like what was never timed.
fn outcome(profile: &Profile, table: &RegretTable, model: &Model) -> Outcome {
    let available = profile.available();
    let Ok(prediction) = model.predict(&profile.hardware, &profile.with_revisions(&available)) else {
        return Outcome { regret: NOT_TIMED - 1.0, distances: BTreeMap::new() };
    };
    let mut distances: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for spot in &profile.points {
        for &(k, ns) in &spot.medians {
            let Some(cost) = prediction.costs.iter().find(|c| c.algorithm == *profile.id(k)) else { continue };
            // Whatever the number of threads or GPUs.
            let method = format!("{} on the {}", cost.algorithm.method(), cost.algorithm.backend().class());
            distances.entry(method).or_default().push((ns / cost.curve.cost_ns(&spot.load)).ln().abs());
        }
    }
    let distances = distances.into_iter().map(|(method, all)| (method, mean(&all))).collect();
    Outcome { regret: table.regret(profile, &by_costs(prediction.costs, &available)).mean, distances }
}

/// The mean of each machine over its profiles.
fn means(of: &ByMachine<'_>) -> Vec<f64> {
    of.values().map(|values| mean(values)).collect()
}

/// The standard deviation of all there is.
fn deviation(values: &[f64]) -> f64 {
    let centre = mean(values);
    mean(&values.iter().map(|v| (v - centre).powi(2)).collect::<Vec<f64>>()).sqrt()
}

impl Importance {
    /// What is to be read of it, as a table that `draw` draws, and the notes.
    pub fn page(&self, draw: impl Fn(&[Vec<String>]) -> String) -> String {
        let mut rows =
            vec![["parameter", "machines", "fitted without", "choice", "linked methods"].map(str::to_owned).to_vec()];
        for p in &self.parameters {
            let linked = p.distance_rise_ln.iter().filter(|(_, effect)| effect.verdict == Verdict::Linked);
            let linked: Vec<&str> = linked.map(|(method, _)| method.as_str()).collect();
            let Effect { rise, verdict } = p.regret_rise;
            let points = rise.map_or("-".to_owned(), |i| {
                format!("{:+.1} ({:+.1} to {:+.1})", i.mean * 100.0, i.low * 100.0, i.high * 100.0)
            });
            let machines = p.physical_machines.to_string();
            rows.push(vec![p.parameter.clone(), machines, points, verdict.to_string(), linked.join("; ")]);
        }
        let mut text = self.mean_regret.map_or_else(String::new, |regret| {
            format!(
                "Mean regret on machines held out: {}. Percentage points that are added by one value of the parameter for all machines.\n\
                 All with 90 % intervals.\n\n",
                spread::percent(regret.mean, Some([regret.low, regret.high]), 1)
            )
        });
        if !self.parameters.is_empty() {
            text.push_str(&draw(&rows));
        }
        self.notes.iter().for_each(|note| text.push_str(&format!("\n{note}\n")));
        text
    }
}
