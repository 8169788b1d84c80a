//! How well each way to choose does on machines that it was not trained on.

use super::baselines::{self, Likeness, available, by_costs};
use super::crossing::Borders;
use super::curve::measured_costs;
use super::direct::{direct, direct_elastic_net};
use super::fit::Designs;
use super::forest::{Forests, Table};
use super::held::{Held, HeldBorder, Time};
use super::model::model;
use super::partition::Partition;
use super::profile::{Profile, machines};
use super::sampled::{self, Errors, Predicted};
use super::scores::{self, Judged};
use super::yardstick::{Chooser, Yardstick, average};
use crate::progress::Progress;
use anyhow::Result;
use rayon::prelude::*;
use sapwise::model::{Coverage, MethodModel, Validation};
use sapwise::{AlgorithmCost, AlgorithmId, Model, Prior};
use std::sync::OnceLock;

/// The way that scores are given relative to.
pub(super) const SINGLE_BEST: &str = "single best";
/// The way that `predict` takes.
pub(crate) const OURS: &str = "physics + ridge";
/// Ours, corrected by [`sampled::SAMPLES`] samples of one scenario on the machine itself.
const SAMPLED: &str = "ours + 8 samples";
/// Profiles that are judged, of all folds together, about: scores of a hundred machines change little with thousands more.
const MOST_JUDGED: usize = 120;
/// Held-out profiles on which samples are taken, at most.
const MOST_SAMPLED: usize = 64;
/// Profiles of a training that the best single algorithm and the direct regression look at: a mean and a handful of slopes need no
/// more, and both go through all of them for each held-out profile.
const MOST_SEEN: usize = 100;

/// What a validation finds.
pub(super) struct Validated {
    pub(super) validation: Validation,
    /// In sentences, what the scores do not say.
    pub(super) notes: Vec<String>,
    /// What a picture shows of it.
    pub(super) held: Held,
    /// How far costs lie from their prediction on what was left out; `None` where nothing was.
    pub(super) prior: Option<Prior>,
}

/// Leaves out one fold of a [`Partition`] after the other, fits to the others and lets every way choose on what was left out.
///
/// With one profile no way is scored. Each fold is a step of `progress`.
///
/// # Errors
/// When a regression fails.
pub(super) fn validate(
    profiles: &[Profile],
    designs: &Designs<'_>,
    partition: &Partition,
    progress: &Progress,
) -> Result<Validated> {
    let mut notes = Vec::new();
    let mut all: Vec<Judged> = Vec::new();
    let (mut times, mut borders, mut prior, mut coverage) = (Vec::new(), Vec::new(), None, None);
    if profiles.len() < 2 {
        notes.push("nothing is validated: there is one report only; add reports of other machines".to_owned());
    } else {
        if !partition.by_machine {
            notes.push(
                "validated by leaving out profiles of one physical machine: this says little about machines never seen; add \
                 reports of other machines"
                    .to_owned(),
            );
        }
        notes.push("the full sweep is judged by the timings that it was fitted to".to_owned());
        let data = Data::new(profiles, designs);
        let most = MOST_JUDGED.div_ceil(partition.folds.len());
        let fold = |fold: &Vec<usize>| {
            // Evenly over the fold, in which the profiles of a machine stand together.
            let judged: Vec<usize> = fold.iter().step_by(fold.len().div_ceil(most)).copied().collect();
            let found = data.fold(fold, &judged);
            progress.advance(1);
            found
        };
        let mut predicted = Vec::new();
        for found in partition.folds.par_iter().map(fold).collect::<Result<Vec<Found>>>()? {
            all.extend(found.judged);
            times.extend(found.times);
            borders.extend(found.borders);
            notes.extend(found.notes);
            predicted.push(found.predicted);
        }
        let sampled = data.sampled(&partition.folds, predicted)?;
        all.extend(sampled.judged);
        notes.extend(sampled.told);
        (prior, coverage) = (sampled.prior, sampled.coverage);
    }
    let validation = Validation {
        held_out: partition.held_out.clone(),
        physical_machines: machines(profiles).len(),
        profiles: profiles.len(),
        methods: scores::scores(&all),
        coverage: if partition.by_machine { coverage } else { None },
        ..Validation::default()
    };
    Ok(Validated { validation, notes, held: Held::new(&all, times, borders, partition.by_machine), prior })
}

/// What all folds share.
pub(super) struct Data<'a> {
    profiles: &'a [Profile],
    designs: &'a Designs<'a>,
    table: Table,
    yardsticks: Vec<Yardstick>,
    /// Mean regret of each algorithm of each profile when it is chosen always.
    always: Vec<Vec<f64>>,
    /// What machines are compared by, of each profile.
    likeness: Vec<Likeness>,
    /// The measured costs of each profile, once they are asked for.
    costs: Vec<OnceLock<Vec<AlgorithmCost>>>,
}

/// What is found on one fold.
#[derive(Default)]
pub(super) struct Found {
    pub(super) judged: Vec<Judged>,
    predicted: Vec<Predicted>,
    times: Vec<Time>,
    borders: Vec<HeldBorder>,
    notes: Vec<String>,
}

/// What is found by samples on what was left out, and of errors there.
struct OfSamples {
    judged: Vec<Judged>,
    prior: Option<Prior>,
    coverage: Option<Coverage>,
    told: Option<String>,
}

/// What was fitted to the training of a fold.
struct Fitted<'a> {
    /// Positions of the profiles of the training, and what their machines are compared by.
    known: Vec<usize>,
    likeness: Vec<&'a Likeness>,
    /// Some of them with the mean regret of each algorithm when it is chosen always, and some of those that have crossings.
    always: Vec<(&'a Profile, &'a [f64])>,
    crossed: Vec<&'a Profile>,
    /// The model with its residual, and without; `None` where none could be fitted.
    models: Option<(Model, Model)>,
    forests: Forests,
}

/// One way to choose.
struct Way<'a> {
    name: &'static str,
    choose: Chooser<'a>,
    /// The costs that it chooses by, where it has any.
    costs: Option<&'a [AlgorithmCost]>,
}

impl<'a> Data<'a> {
    pub(super) fn new(profiles: &'a [Profile], designs: &'a Designs<'a>) -> Self {
        let yardsticks: Vec<Yardstick> = profiles.par_iter().map(Yardstick::new).collect();
        let always = yardsticks.par_iter().map(Yardstick::always).collect();
        let costs = profiles.iter().map(|_| OnceLock::new()).collect();
        let likeness = profiles.iter().map(|p| Likeness::new(&p.hardware)).collect();
        Self { profiles, designs, table: Table::new(profiles), yardsticks, always, likeness, costs }
    }

    /// The regrets of every way on some of the profiles of a fold, trained on those that are not in it.
    ///
    /// # Errors
    /// When a regression fails.
    pub(super) fn fold(&self, fold: &[usize], judged: &[usize]) -> Result<Found> {
        let mut found = Found::default();
        let mut chosen = vec![true; self.profiles.len()];
        fold.iter().for_each(|&k| chosen[k] = false);
        let models = match model(self.profiles, self.designs, &chosen, "validation") {
            Ok((model, _)) => {
                let bare = |m: &MethodModel| MethodModel { residual: Vec::new(), residual_intercept: 0.0, ..m.clone() };
                let physics = Model { methods: model.methods.iter().map(bare).collect(), ..model.clone() };
                Some((model, physics))
            }
            Err(why) => {
                let file = &self.profiles[fold[0]].file;
                found.notes.push(format!("no model could be fitted when {file} was left out: {why:#}"));
                None
            }
        };
        let known: Vec<usize> = (0..self.profiles.len()).filter(|&k| chosen[k]).collect();
        let likeness = known.iter().map(|&k| &self.likeness[k]).collect();
        let seen = known.iter().step_by(known.len().div_ceil(MOST_SEEN).max(1));
        let always = seen.map(|&k| (&self.profiles[k], &self.always[k][..])).collect();
        // Of many reports some have crossings.
        let crossed: Vec<&Profile> = known.iter().map(|&k| &self.profiles[k]).filter(|p| !p.crossings.is_empty()).collect();
        let step = crossed.len().div_ceil(MOST_SEEN).max(1);
        let crossed = crossed.into_iter().step_by(step).collect();
        let fitted = Fitted { known, likeness, always, crossed, models, forests: self.table.grow(&chosen)? };
        for &held in judged {
            self.held_out(held, &fitted, &mut found)?;
        }
        Ok(found)
    }

    /// The measured costs of a profile.
    fn costs(&self, k: usize) -> &[AlgorithmCost] {
        self.costs[k].get_or_init(|| measured_costs(&self.profiles[k]).0)
    }

    fn held_out(&self, held: usize, fitted: &Fitted<'_>, found: &mut Found) -> Result<()> {
        let profile = &self.profiles[held];
        let available = available(profile);
        let mut predicted = |model: fn(&(Model, Model)) -> &Model| {
            let models = fitted.models.as_ref()?;
            predict(model(models), profile, &available, &mut found.notes)
        };
        let (ridge, physics) = (predicted(|m| &m.0), predicted(|m| &m.1));
        let nearest = baselines::nearest(&fitted.likeness, &self.likeness[held]).map(|k| self.costs(fitted.known[k]));
        let default_machine = match fitted.known.first() {
            None => nothing(),
            Some(&first) => {
                let own = baselines::default_machine(&self.profiles[first], self.costs(first), &available);
                own.unwrap_or_else(|why| {
                    found.notes.push(format!("there is no default machine when {} is left out: {why:#}", profile.file));
                    nothing()
                })
            }
        };
        if let Some(costs) = &ridge {
            found.times.extend(Time::of(profile, costs));
        }
        let ways = [
            by(OURS, ridge.as_deref(), &available),
            by("physics", physics.as_deref(), &available),
            alone("random forest", fitted.forests.chooser(&profile.hardware, &available)),
            alone("direct regression", direct(&fitted.crossed, &profile.hardware, &available, &mut found.notes)?),
            alone(
                "direct elastic net",
                direct_elastic_net(&fitted.crossed, &profile.hardware, &available, &mut found.notes)?,
            ),
            alone(SINGLE_BEST, baselines::single_best(&fitted.always, &available)),
            alone("frozen constants (64)", baselines::frozen(64, "grid-sap", &available)),
            alone("frozen constants (1000)", baselines::frozen(999, "sap", &available)),
            alone("default machine", default_machine),
            by("nearest machine", nearest, &available),
            // Its costs are those that borders are measured by.
            Way { costs: None, ..by("full sweep", Some(self.costs(held)), &available) },
        ];
        let borders = Borders::new(profile, self.costs(held));
        let beside = ridge.as_deref().map(|costs| borders.predicted(costs)).unwrap_or_default();
        found.borders.extend(beside.into_iter().map(|beside| HeldBorder { file: profile.file.clone(), beside }));
        found.judged.extend(ways.iter().map(|way| Judged {
            name: way.name,
            file: profile.file.clone(),
            machine: profile.machine().to_owned(),
            regret: self.yardsticks[held].regret(profile, &way.choose),
            crossings: way.costs.map(|costs| borders.errors(costs)),
        }));
        drop(ways);
        found.predicted.push(Predicted { held, costs: ridge.unwrap_or_default() });
        Ok(())
    }

    /// What samples add to the predictions of each fold, with a prior from the others; and the prior of all.
    fn sampled(&self, folds: &[Vec<usize>], predicted: Vec<Vec<Predicted>>) -> Result<OfSamples> {
        // Of many machines some: more tell neither the prior nor a mean regret better.
        let all: usize = predicted.iter().map(Vec::len).sum();
        let step = all.div_ceil(MOST_SAMPLED).max(1);
        let owned = predicted.into_iter().enumerate().flat_map(|(f, p)| p.into_iter().map(move |p| (f, p)));
        let (of_fold, predicted): (Vec<usize>, Vec<Predicted>) = owned.step_by(step).unzip();
        let errors = Errors::new(self.profiles, &predicted);
        let priors: Vec<Prior> = folds.par_iter().map(|fold| errors.prior(fold)).collect();
        let judge = |k: usize| {
            let held = predicted[k].held;
            let profile = &self.profiles[held];
            let scenario = baselines::usual(profile.points.iter().map(|s| s.scenario.as_str()));
            let corrected = sampled::corrected(profile, scenario, &predicted[k], &priors[of_fold[k]])?;
            let available = available(profile);
            // Where no sample can be taken the prediction stays.
            let costs = corrected.as_deref().unwrap_or(&predicted[k].costs);
            let [with, without] = [costs, &predicted[k].costs].map(|costs| by(SAMPLED, Some(costs), &available));
            let there = |way: &Way<'_>| self.yardsticks[held].regret_in(Some(scenario), profile, &way.choose).mean;
            let judged = Judged {
                name: SAMPLED,
                file: profile.file.clone(),
                machine: profile.machine().to_owned(),
                regret: self.yardsticks[held].regret(profile, &with.choose),
                crossings: Some(Borders::new(profile, self.costs(held)).errors(costs)),
            };
            Ok((judged, there(&without), there(&with)))
        };
        let found = (0..predicted.len()).into_par_iter().map(judge).collect::<Result<Vec<(Judged, f64, f64)>>>()?;
        let (without, with): (Vec<f64>, Vec<f64>) = found.iter().map(|f| (f.1, f.2)).unzip();
        let told = (!found.is_empty()).then(|| {
            let percent = |regrets: &[f64]| format!("{:.1} %", 100.0 * average(regrets));
            format!(
                "{} samples replayed from the timings that judge them, on {} held-out reports: under the loads of the scenario that is \
                 sampled the mean regret falls from {} to {}, 95th percentile {:.1} %",
                sampled::SAMPLES,
                found.len(),
                percent(&without),
                percent(&with),
                100.0 * scores::percentile_95(with.iter().map(|r| (*r, 1.0)).collect())
            )
        });
        let prior = predicted.iter().any(|p| !p.costs.is_empty()).then(|| errors.prior(&[]));
        let coverage = sampled::coverage(&errors);
        Ok(OfSamples { judged: found.into_iter().map(|f| f.0).collect(), prior, coverage, told })
    }
}

/// A way that chooses the cheapest by costs; nothing is chosen, which counts as the worst, where there are none.
fn by<'a>(name: &'static str, costs: Option<&'a [AlgorithmCost]>, available: &'a [AlgorithmId]) -> Way<'a> {
    let costs = costs.unwrap_or_default();
    let choose = if costs.is_empty() { nothing() } else { by_costs(costs.to_vec(), available) };
    Way { name, choose, costs: Some(costs) }
}

/// A way that predicts no costs.
fn alone<'a>(name: &'static str, choose: Chooser<'a>) -> Way<'a> {
    Way { name, choose, costs: None }
}

/// The costs that a model predicts, and a note where it predicts none.
fn predict(
    model: &Model,
    profile: &Profile,
    available: &[AlgorithmId],
    notes: &mut Vec<String>,
) -> Option<Vec<AlgorithmCost>> {
    match model.predict(&profile.hardware, &profile.with_revisions(available)) {
        Ok(prediction) => Some(prediction.costs),
        Err(why) => {
            notes.push(format!("{} could not be predicted when it was left out: {why}", profile.file));
            None
        }
    }
}

/// Chooses nothing, which counts as the worst.
fn nothing<'a>() -> Chooser<'a> {
    Box::new(|_| None)
}

#[cfg(test)]
mod tests;
