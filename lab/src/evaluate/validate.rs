//! How well each strategy does on machines that it was not trained on.

use super::baselines::{self, Likeness, by_costs};
use super::crossovers::MeasuredCrossovers;
use super::direct::{RoleOutcome, direct, role_outcomes};
use super::forest::{Forests, Table};
use super::held_out::{HeldOut, HeldOutCrossover, Time};
use super::partition::Partition;
use super::regret_table::{RegretTable, Strategy};
use super::sampled::{self, Errors, Predicted};
use super::scores::{self, Judged, OURS, SINGLE_BEST};
use crate::belief::Prior;
use crate::data::{Profile, machines};
use crate::fit::{Designs, measured_costs, model};
use crate::progress::Progress;
use crate::spread::{percent, range};
use crate::training::Validation;
use anyhow::Result;
use rayon::prelude::*;
use sapwise::model::MethodModel;
use sapwise::stats::mean;
use sapwise::{AlgorithmCost, AlgorithmId, Model};
use std::sync::OnceLock;

/// Ours, corrected by [`sampled::SAMPLES`] samples of one scenario on the machine itself.
const SAMPLED: &str = "ours + 8 samples";
/// Profiles that are judged, of all folds together, about: scores of a hundred machines change little with thousands more.
const MOST_JUDGED: usize = 120;
/// Held-out profiles on which samples are taken, at most.
const MOST_SAMPLED: usize = 64;
/// Profiles of a training that the best single algorithm and the direct regression look at: a mean and a handful of slopes need no
/// more, and both go through all of them for each held-out profile.
const MOST_SEEN: usize = 100;
/// Profiles that the direct regression looks for crossovers in, about.
const MOST_CROSSED: usize = 600;

/// What a validation finds.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Validated {
    /// The score of every strategy.
    pub validation: Validation,
    /// In sentences, what the scores do not say.
    pub notes: Vec<String>,
    /// What a picture shows of it.
    pub held_out: HeldOut,
    /// How far costs lie from their prediction on what was held out; `None` where nothing was.
    pub prior: Option<Prior>,
}

/// Holds out one fold of a [`Partition`] after the other, fits to the others and lets every strategy choose on what was held out.
///
/// With one profile no strategy is scored. Each fold is a step of `progress`.
///
/// # Errors
/// When a regression fails, or the user asked to stop.
pub fn validate(
    profiles: &[Profile],
    designs: &Designs<'_>,
    partition: &Partition,
    progress: &dyn Progress,
) -> Result<Validated> {
    let mut notes = Vec::new();
    let mut all: Vec<Judged> = Vec::new();
    let (mut times, mut crossovers, mut prior) = (Vec::new(), Vec::new(), None);
    progress.start(partition.folds.len() as u64);
    progress.message("validating");
    if profiles.len() < 2 {
        notes.push("nothing is validated: there is one report only; add reports of other machines".to_owned());
    } else {
        if !partition.by_machine {
            notes.push(
                "validated by holding out profiles of one physical machine: this says little about machines never seen; add \
                 reports of other machines"
                    .to_owned(),
            );
        }
        notes.push("the full sweep is judged by the timings that it was fitted to".to_owned());
        let data = Data::new(profiles, designs);
        let most = MOST_JUDGED.div_ceil(partition.folds.len());
        let fold = |fold: &Vec<usize>| {
            progress.check()?;
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
            crossovers.extend(found.crossovers);
            notes.extend(found.notes);
            predicted.push(found.predicted);
        }
        let sampled = data.sampled(&partition.folds, predicted)?;
        all.extend(sampled.judged);
        notes.extend(sampled.told);
        prior = sampled.prior;
    }
    let validation = Validation {
        held_out: partition.held_out.clone(),
        physical_machines: machines(profiles).len(),
        profiles: profiles.len(),
        methods: scores::scores(&all, partition.by_machine),
    };
    Ok(Validated { validation, notes, held_out: HeldOut::new(&all, times, crossovers, partition.by_machine), prior })
}

/// What all folds share.
struct Data<'a> {
    profiles: &'a [Profile],
    designs: &'a Designs<'a>,
    table: Table,
    regrets: Vec<RegretTable>,
    /// Mean regret of each algorithm of each profile when it is chosen always.
    always: Vec<Vec<f64>>,
    /// Which of two algorithms is cheaper where, of each profile; nothing of those that are not looked at.
    outcomes: Vec<Vec<RoleOutcome>>,
    /// What machines are compared by, of each profile.
    likeness: Vec<Likeness>,
    /// The measured costs of each profile, once they are asked for.
    costs: Vec<OnceLock<Vec<AlgorithmCost>>>,
}

/// What is found on one fold.
#[derive(Default)]
struct Found {
    judged: Vec<Judged>,
    predicted: Vec<Predicted>,
    times: Vec<Time>,
    crossovers: Vec<HeldOutCrossover>,
    notes: Vec<String>,
}

/// What is found by samples on what was held out, and of errors there.
struct OfSamples {
    judged: Vec<Judged>,
    prior: Option<Prior>,
    told: Option<String>,
}

/// What was fitted to the training of a fold.
struct Fitted<'a> {
    /// Positions of the profiles of the training, and what their machines are compared by.
    known: Vec<usize>,
    likeness: Vec<&'a Likeness>,
    /// Some of them with the mean regret of each algorithm when it is chosen always, and some of those whose crossovers were looked for.
    always: Vec<(&'a Profile, &'a [f64])>,
    crossed: Vec<(&'a Profile, &'a [RoleOutcome])>,
    /// The model with its residual, and without; `None` where none could be fitted.
    models: Option<(Model, Model)>,
    forests: Forests,
}

/// A strategy with its name.
struct Contestant<'a> {
    name: &'static str,
    choose: Strategy<'a>,
    /// The costs that it chooses by, where it has any.
    costs: Option<&'a [AlgorithmCost]>,
}

impl<'a> Data<'a> {
    fn new(profiles: &'a [Profile], designs: &'a Designs<'a>) -> Self {
        let regrets: Vec<RegretTable> = profiles.par_iter().map(RegretTable::new).collect();
        let always = regrets.par_iter().map(|r| r.always().iter().map(|always| always.mean).collect()).collect();
        let costs = profiles.iter().map(|_| OnceLock::new()).collect();
        let likeness = profiles.iter().map(|p| Likeness::new(&p.hardware)).collect();
        let step = profiles.len().div_ceil(MOST_CROSSED).max(1);
        let outcomes = |(k, p): (usize, &Profile)| if k.is_multiple_of(step) { role_outcomes(p) } else { Vec::new() };
        let outcomes = profiles.par_iter().enumerate().map(outcomes).collect();
        Self { profiles, designs, table: Table::new(profiles), regrets, always, outcomes, likeness, costs }
    }

    /// The regrets of every strategy on some of the profiles of a fold, trained on those that are not in it.
    ///
    /// # Errors
    /// When a regression fails.
    fn fold(&self, fold: &[usize], judged: &[usize]) -> Result<Found> {
        let mut found = Found::default();
        let mut chosen = vec![true; self.profiles.len()];
        fold.iter().for_each(|&k| chosen[k] = false);
        let models = match model(self.profiles, self.designs, &chosen, "validation") {
            Ok((model, _)) => {
                let mut physics = model.clone();
                physics.methods = model.methods.iter().map(MethodModel::without_residual).collect();
                Some((model, physics))
            }
            Err(why) => {
                let file = &self.profiles[fold[0]].file;
                found.notes.push(format!("no model could be fitted when {file} was held out: {why:#}"));
                None
            }
        };
        let known: Vec<usize> = (0..self.profiles.len()).filter(|&k| chosen[k]).collect();
        let likeness = known.iter().map(|&k| &self.likeness[k]).collect();
        let seen = known.iter().step_by(known.len().div_ceil(MOST_SEEN).max(1));
        let always = seen.map(|&k| (&self.profiles[k], &self.always[k][..])).collect();
        let crossed = known.iter().map(|&k| (&self.profiles[k], &self.outcomes[k][..]));
        let crossed: Vec<_> = crossed.filter(|(_, outcomes)| !outcomes.is_empty()).collect();
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
        let available = profile.available();
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
                    found.notes.push(format!("there is no default machine when {} is held out: {why:#}", profile.file));
                    nothing()
                })
            }
        };
        if let Some(costs) = &ridge {
            found.times.extend(Time::of(profile, costs));
        }
        let contestants = [
            by(OURS, ridge.as_deref(), &available),
            by("physics", physics.as_deref(), &available),
            alone("random forest", fitted.forests.chooser(&profile.hardware, &available)),
            alone("direct regression", direct(&fitted.crossed, &profile.hardware, &available, &mut found.notes)?),
            alone(SINGLE_BEST, baselines::single_best(&fitted.always, &available)),
            alone("frozen constants (64)", baselines::frozen(64, "grid-sap", &available)),
            alone("frozen constants (1000)", baselines::frozen(999, "sap", &available)),
            alone("default machine", default_machine),
            by("nearest machine", nearest, &available),
            // Its costs are those that crossovers are measured by.
            Contestant { costs: None, ..by("full sweep", Some(self.costs(held)), &available) },
        ];
        let measured = MeasuredCrossovers::new(profile, self.costs(held));
        let compared = ridge.as_deref().map(|costs| measured.predicted(costs)).unwrap_or_default();
        let crossover = |compared| HeldOutCrossover { file: profile.file.clone(), compared };
        found.crossovers.extend(compared.into_iter().map(crossover));
        found.judged.extend(contestants.into_iter().map(|contestant| Judged {
            name: contestant.name,
            file: profile.file.clone(),
            machine: profile.machine().to_owned(),
            regret: self.regrets[held].regret(profile, &contestant.choose),
            crossings: contestant.costs.map(|costs| measured.errors(costs)),
        }));
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
            let scenario = profile.usual_scenario();
            let corrected = sampled::corrected(profile, scenario, &predicted[k], &priors[of_fold[k]])?;
            let available = profile.available();
            // Where no sample can be taken the prediction stays.
            let costs = corrected.as_deref().unwrap_or(&predicted[k].costs);
            let [with, without] = [costs, &predicted[k].costs].map(|costs| by(SAMPLED, Some(costs), &available));
            let there = |c: &Contestant<'_>| self.regrets[held].regret_in(Some(scenario), profile, &c.choose).mean;
            let judged = Judged {
                name: SAMPLED,
                file: profile.file.clone(),
                machine: profile.machine().to_owned(),
                regret: self.regrets[held].regret(profile, &with.choose),
                crossings: Some(MeasuredCrossovers::new(profile, self.costs(held)).errors(costs)),
            };
            Ok((judged, there(&without), there(&with)))
        };
        let found = (0..predicted.len()).into_par_iter().map(judge).collect::<Result<Vec<(Judged, f64, f64)>>>()?;
        let (without, with): (Vec<f64>, Vec<f64>) = found.iter().map(|f| (f.1, f.2)).unzip();
        let told = (!found.is_empty()).then(|| {
            let told = |regrets: &[f64]| percent(mean(regrets), range(regrets), 1);
            format!(
                "{} samples replayed from the timings that judge them, on {} held-out reports: under the loads of the scenario that is \
                 sampled the mean regret goes from {} to {}, 95th percentile {:.1} %",
                sampled::SAMPLES,
                found.len(),
                told(&without),
                told(&with),
                100.0 * scores::percentile_95(with.iter().map(|r| (*r, 1.0)).collect())
            )
        });
        let prior = predicted.iter().any(|p| !p.costs.is_empty()).then(|| errors.prior(&[]));
        Ok(OfSamples { judged: found.into_iter().map(|f| f.0).collect(), prior, told })
    }
}

/// Chooses the cheapest by costs; nothing, which counts as the worst, where there are none.
fn by<'a>(name: &'static str, costs: Option<&'a [AlgorithmCost]>, available: &'a [AlgorithmId]) -> Contestant<'a> {
    let costs = costs.unwrap_or_default();
    let choose = if costs.is_empty() { nothing() } else { by_costs(costs.to_vec(), available) };
    Contestant { name, choose, costs: Some(costs) }
}

/// A strategy that predicts no costs.
fn alone<'a>(name: &'static str, choose: Strategy<'a>) -> Contestant<'a> {
    Contestant { name, choose, costs: None }
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
            notes.push(format!("{} could not be predicted when it was held out: {why}", profile.file));
            None
        }
    }
}

/// Chooses nothing, which counts as the worst.
fn nothing<'a>() -> Strategy<'a> {
    Box::new(|_| None)
}

#[cfg(test)]
mod tests;
