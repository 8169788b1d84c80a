//! What each hardware parameter is worth to predictions of machines that were held out: everything is fitted again with one value of it for
//! all machines.

mod figure;
mod interval;
#[cfg(test)]
mod tests;
mod verdict;

use super::baselines::by_costs;
use super::partition::Partition;
use super::regret_table::{NOT_TIMED, RegretTable};
use crate::data::{Profile, machines};
use crate::fit::{Designs, model};
use crate::progress::Progress;
use crate::spread;
use anyhow::{Context, Result};
use figure::Figure;
use rayon::prelude::*;
use sapwise::stats::{mean, median};
use sapwise::{AlgorithmCost, AlgorithmId, Model};
use serde::Serialize;
use std::collections::BTreeMap;
use verdict::FEWEST_MACHINES;

pub use interval::Interval;
pub use verdict::{Effect, Verdict};

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
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Importance {
    /// What is held out together, in words.
    pub held_out: String,
    /// Physical machines.
    pub physical_machines: usize,
    /// Reports of them.
    pub profiles: usize,
    /// Mean regret with every parameter as it is, of these folds, each machine counting the same; none of too few machines.
    pub mean_regret: Option<Interval>,
    /// In the order of a report: those of the machine, then those of its GPUs.
    pub parameters: Vec<OfParameter>,
    /// For each method on a class of processor and each physical machine the mean logarithm of measured over predicted time when it
    /// was held out, with every parameter as it is: what predictions leave.
    pub left_ln: BTreeMap<String, BTreeMap<String, f64>>,
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
    /// Standard deviation of its base-2 logarithm over them.
    pub deviation_octaves: f64,
    /// Rise of the mean regret.
    pub regret_rise: Effect,
    /// The methods, each on a class of processor.
    pub methods: Vec<OfMethod>,
}

/// What one parameter is worth to the predicted times of one method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OfMethod {
    /// The method and its class of processor.
    pub method: String,
    /// Physical machines that have the parameter and timings of it.
    pub physical_machines: usize,
    /// Rise of the mean distance between predicted and measured times, as the absolute value of a natural logarithm.
    pub distance_rise_ln: Effect,
}

/// What came of a prediction.
#[derive(Debug, Clone, PartialEq)]
struct Outcome {
    regret: f64,
    /// For each method on a class of processor that was predicted the mean logarithm of measured over predicted time, above zero where the
    /// machine is slower than predicted, and the mean of the absolute values.
    off: BTreeMap<String, (f64, f64)>,
}

/// Values of profiles by the position of their physical machine.
type ByMachine = BTreeMap<usize, Vec<f64>>;

/// Looks at one parameter after the other: everything is fitted again with one value of it for all machines, in the training too, and the
/// machines that were held out are predicted. What another parameter can stand in for is worth nothing by that.
///
/// Of fewer than five physical machines nothing is told, and nothing is computed. Each fit is a step of `progress`.
///
/// # Errors
/// When a model can't be fitted without a fold, or the user asked to stop.
pub fn importance(profiles: &[Profile], progress: &dyn Progress) -> Result<Importance> {
    let all = machines(profiles);
    let step = all.len().div_ceil(MOST_MACHINES).max(1);
    if step == 1 {
        return of_machines(profiles, &all, progress);
    }
    let kept: Vec<&str> = all.iter().step_by(step).copied().collect();
    let some: Vec<Profile> = profiles.iter().filter(|p| kept.contains(&p.machine())).cloned().collect();
    let mut found = of_machines(&some, &kept, progress)?;
    found.notes.insert(0, format!("{} of {} physical machines are looked at here, evenly taken", kept.len(), all.len()));
    Ok(found)
}

fn of_machines(profiles: &[Profile], machines: &[&str], progress: &dyn Progress) -> Result<Importance> {
    let mut found = Importance {
        held_out: String::new(),
        physical_machines: machines.len(),
        profiles: profiles.len(),
        mean_regret: None,
        parameters: Vec::new(),
        left_ln: BTreeMap::new(),
        notes: Vec::new(),
    };
    let partition = Partition::of_machines(profiles, MOST_FOLDS).filter(|_| machines.len() >= FEWEST_MACHINES);
    let Some(partition) = partition else {
        found.notes.push(format!(
            "nothing is told: there are {} physical machines, and it takes {FEWEST_MACHINES}; add reports of other machines",
            machines.len()
        ));
        let none = |figure: Figure| of_parameter(figure, &values(figure, profiles, machines), &BTreeMap::new());
        found.parameters = Figure::ALL.into_iter().map(none).collect();
        return Ok(found);
    };
    progress.start((partition.folds.len() * (Figure::ALL.len() + 1)) as u64);
    progress.message("fitting without each parameter");
    let tables: Vec<RegretTable> = profiles.par_iter().map(RegretTable::new).collect();
    let outcomes_of = |profiles: &[Profile]| -> Result<Vec<Outcome>> {
        let designs = Designs::new(profiles);
        let fold = |fold: &Vec<usize>| -> Result<Vec<(usize, Outcome)>> {
            progress.check()?;
            let chosen: Vec<bool> = (0..profiles.len()).map(|k| !fold.contains(&k)).collect();
            let model = model(profiles, &designs, &chosen, "importance").map(|m| m.0);
            let model =
                model.with_context(|| format!("no importance is told when {} is held out", profiles[fold[0]].file))?;
            progress.advance(1);
            Ok(fold.iter().map(|&k| (k, outcome(&profiles[k], &tables[k], &model))).collect())
        };
        let folds = partition.folds.par_iter().map(fold).collect::<Result<Vec<_>>>()?;
        // Folds of whole machines hold each profile once.
        let mut all = folds.concat();
        all.sort_by_key(|(k, _)| *k);
        Ok(all.into_iter().map(|(_, outcome)| outcome).collect())
    };
    let before = outcomes_of(profiles)?;
    let position = |k: usize| machines.binary_search(&profiles[k].machine()).unwrap_or_default();
    let one = |figure: Figure| -> Result<OfParameter> {
        let values = values(figure, profiles, machines);
        let mut rises: BTreeMap<String, ByMachine> = BTreeMap::new();
        if let Some(middle) = median(&values.values().copied().collect::<Vec<f64>>()) {
            let without: Vec<Profile> = profiles.iter().map(|p| figure.replaced(p, middle)).collect();
            let after = outcomes_of(&without)?;
            for k in (0..profiles.len()).filter(|&k| values.contains_key(&position(k))) {
                let mut add = |what: &str, rise: f64| {
                    rises.entry(what.to_owned()).or_default().entry(position(k)).or_default().push(rise);
                };
                add(CHOICE, after[k].regret - before[k].regret);
                for (method, (_, distance)) in &before[k].off {
                    if let Some((_, now)) = after[k].off.get(method) {
                        add(method, now - distance);
                    }
                }
            }
        }
        Ok(of_parameter(figure, &values, &rises))
    };
    found.parameters = Figure::ALL.into_par_iter().map(one).collect::<Result<_>>()?;
    found.held_out.clone_from(&partition.held_out);
    found.left_ln = left(profiles, &before);
    let mut regrets = ByMachine::new();
    before.iter().enumerate().for_each(|(k, o)| regrets.entry(position(k)).or_default().push(o.regret));
    found.mean_regret = Interval::of(&regrets.values().map(|r| mean(r)).collect::<Vec<_>>());
    let told = found.parameters.iter().map(|p| 1 + p.methods.len()).sum::<usize>();
    found.notes = vec![
        format!(
            "these are {told} verdicts by intervals of 90 %: up to one in ten of those that hold nothing, more with few machines, is `linked` by \
             chance"
        ),
        "a link is one of the model that was fitted, on these machines; it says what predicts, not what causes".to_owned(),
        "the intervals are over machines, each with the models that were fitted without it; the models are not drawn"
            .to_owned(),
    ];
    Ok(found)
}

/// Under which the rises of the regret stand; no method has this name.
const CHOICE: &str = "";

/// What a model predicts for a profile. Where it predicts nothing, nothing is chosen, which is charged like what was never timed.
fn outcome(profile: &Profile, table: &RegretTable, model: &Model) -> Outcome {
    let available = profile.available();
    let Ok(prediction) = model.predict(&profile.hardware, &profile.with_revisions(&available)) else {
        return Outcome { regret: NOT_TIMED - 1.0, off: BTreeMap::new() };
    };
    let off = off(profile, &prediction.costs);
    Outcome { regret: table.regret(profile, &by_costs(prediction.costs, &available)).mean, off }
}

/// How measured times lie to predicted ones, by method: [`Outcome::off`].
fn off(profile: &Profile, costs: &[AlgorithmCost]) -> BTreeMap<String, (f64, f64)> {
    let mut found: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let cost = |k: u16| costs.iter().find(|c| c.algorithm == *profile.id(k));
    let known: Vec<Option<&AlgorithmCost>> = (0..profile.algorithms.len() as u16).map(cost).collect();
    for spot in &profile.points {
        for &(k, ns) in &spot.medians {
            let Some(cost) = known[usize::from(k)] else { continue };
            let ln = (ns / cost.curve.cost_ns(&spot.load)).ln();
            found.entry(method_name(&cost.algorithm)).or_default().push(ln);
        }
    }
    let both = |logs: Vec<f64>| (mean(&logs), mean(&logs.iter().map(|ln| ln.abs()).collect::<Vec<f64>>()));
    found.into_iter().map(|(name, logs)| (name, both(logs))).collect()
}

/// A method on a class of processor, whatever the number of threads or GPUs.
fn method_name(id: &AlgorithmId) -> String {
    format!("{} on the {}", id.method(), id.backend().class())
}

/// What predictions leave of each machine: the mean over its profiles.
fn left(profiles: &[Profile], outcomes: &[Outcome]) -> BTreeMap<String, BTreeMap<String, f64>> {
    let mut found: BTreeMap<String, BTreeMap<String, Vec<f64>>> = BTreeMap::new();
    for (profile, outcome) in profiles.iter().zip(outcomes) {
        for (method, (mean_ln, _)) in &outcome.off {
            let machines = found.entry(method.clone()).or_default();
            machines.entry(profile.machine().to_owned()).or_default().push(*mean_ln);
        }
    }
    let means = |machines: BTreeMap<String, Vec<f64>>| machines.into_iter().map(|(k, lns)| (k, mean(&lns))).collect();
    found.into_iter().map(|(method, machines)| (method, means(machines))).collect()
}

/// The value of each machine that has it, by its position: the median over its profiles.
fn values(figure: Figure, profiles: &[Profile], machines: &[&str]) -> BTreeMap<usize, f64> {
    let of = |machine: &str| {
        let own = profiles.iter().filter(|p| p.machine() == machine).filter_map(|p| figure.value(&p.hardware));
        median(&own.collect::<Vec<f64>>())
    };
    machines.iter().enumerate().filter_map(|(k, machine)| Some((k, of(machine)?))).collect()
}

fn of_parameter(figure: Figure, values: &BTreeMap<usize, f64>, rises: &BTreeMap<String, ByMachine>) -> OfParameter {
    let logs: Vec<f64> = values.values().map(|v| v.log2()).collect();
    let centre = mean(&logs);
    let deviation = mean(&logs.iter().map(|v| (v - centre).powi(2)).collect::<Vec<f64>>()).sqrt();
    let effect = |of: Option<&ByMachine>, machines: usize, least: f64| {
        let means: Vec<f64> = of.iter().flat_map(|of| of.values()).map(|values| mean(values)).collect();
        Effect::new(Interval::of(&means), machines, deviation, least)
    };
    let method = |(name, of): (&String, &ByMachine)| OfMethod {
        method: name.clone(),
        physical_machines: of.len(),
        distance_rise_ln: effect(Some(of), of.len(), LEAST_LN),
    };
    OfParameter {
        parameter: figure.name(),
        physical_machines: logs.len(),
        deviation_octaves: deviation,
        regret_rise: effect(rises.get(CHOICE), logs.len(), LEAST_REGRET),
        methods: rises.iter().filter(|(name, _)| *name != CHOICE).map(method).collect(),
    }
}

impl Importance {
    /// What is to be read of it, as a table that `draw` draws, and the notes.
    pub fn page(&self, draw: impl Fn(&[Vec<String>]) -> String) -> String {
        let mut rows =
            vec![["parameter", "machines", "fitted without", "choice", "linked methods"].map(str::to_owned).to_vec()];
        for p in &self.parameters {
            let linked = p.methods.iter().filter(|m| m.distance_rise_ln.verdict == Verdict::Linked);
            let linked: Vec<&str> = linked.map(|m| m.method.as_str()).collect();
            let Effect { rise, verdict, .. } = &p.regret_rise;
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
        text.push_str(&draw(&rows));
        self.notes.iter().for_each(|note| text.push_str(&format!("\n{note}\n")));
        text
    }
}
