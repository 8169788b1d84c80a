//! The strategies that a prediction competes with, and the data that each is fitted to.

use super::baselines::{self, Likeness, by_costs, by_costs_of_running};
use super::direct::{RoleOutcome, direct, role_outcomes};
use super::forest::{Forests, Table};
use super::regret_table::{RegretTable, Strategy};
use super::scores::{OURS, RUNNING, SINGLE_BEST};
use crate::data::Profile;
use crate::fit::{Designs, costs_of_one, model};
use anyhow::Result;
use rayon::prelude::*;
use sapwise::AlgorithmId;
use sapwise::algorithm::BackendClass;
use sapwise::tuning::AlgorithmCost;
use sapwise_tune::Model;
use sapwise_tune::model::MethodModel;
use std::borrow::Cow;
use std::sync::OnceLock;

const PHYSICS: &str = "physics";
const FOREST: &str = "random forest";
const NEAREST: &str = "nearest machine";
const FULL_SWEEP: &str = "full sweep";

/// Data that all folds share.
pub(super) struct Material<'a> {
    pub(super) profiles: &'a [Profile],
    table: Table,
    /// The regret table of each profile, computed when it is first needed.
    regrets: Vec<OnceLock<RegretTable>>,
    /// Which of two algorithms is cheaper at which sizes, on each profile.
    outcomes: Vec<Vec<RoleOutcome>>,
    /// The parameters of each profile that machines are compared by.
    likeness: Vec<Likeness>,
    /// Whether each profile has timings on a real GPU.
    on_gpu: Vec<bool>,
    /// Each profile without its GPUs, computed when it is first needed.
    on_cpu: Vec<OnceLock<(Profile, RegretTable)>>,
}

/// Data shared by the folds that hold out the same scenario, or no scenario.
pub(super) struct Seen<'a> {
    without: Option<&'a str>,
    designs: &'a Designs<'a>,
    /// The measured costs of each profile, computed when they are first needed.
    costs: Vec<OnceLock<Vec<AlgorithmCost>>>,
}

/// Everything that was fitted to the training profiles of a fold.
pub(super) struct Fitted<'a> {
    seen: &'a Seen<'a>,
    /// Positions of the training profiles.
    known: Vec<usize>,
    /// These profiles with the mean regret of always choosing each algorithm.
    always: Vec<(&'a Profile, Vec<f64>)>,
    /// The model with its residual, and without; `None` when none could be fitted.
    models: Option<(Model, Model)>,
    forests: Forests,
    /// Whether the training has timings on a real GPU.
    knows_gpus: bool,
    pub(super) notes: Vec<String>,
}

/// The costs that a model predicts for a profile, and those by its physical terms alone.
pub(super) struct Ours {
    pub(super) whole: Vec<AlgorithmCost>,
    physics: Vec<AlgorithmCost>,
}

/// A strategy with its name.
pub(super) struct Contestant<'a> {
    pub(super) name: &'static str,
    pub(super) choose: Strategy<'a>,
    /// The costs that its crossovers are derived from, if any.
    pub(super) costs: Option<Costs<'a>>,
}

impl<'a> Material<'a> {
    pub(super) fn new(profiles: &'a [Profile]) -> Self {
        Self {
            profiles,
            table: Table::new(profiles),
            regrets: profiles.iter().map(|_| OnceLock::new()).collect(),
            outcomes: profiles.par_iter().map(role_outcomes).collect(),
            likeness: profiles.iter().map(|p| Likeness::new(&p.hardware)).collect(),
            on_gpu: profiles.iter().map(Profile::has_real_gpu).collect(),
            on_cpu: profiles.iter().map(|_| OnceLock::new()).collect(),
        }
    }

    /// Fits everything to the profiles that are not in a fold.
    ///
    /// # Errors
    /// When a regression fails.
    pub(super) fn fit(&'a self, fold: &[usize], seen: &'a Seen<'a>) -> Result<Fitted<'a>> {
        let (without, mut notes) = (seen.without, Vec::new());
        let mut chosen = vec![true; self.profiles.len()];
        fold.iter().for_each(|&k| chosen[k] = false);
        let models = match model(seen.designs, &chosen, "validation") {
            Ok((model, _)) => {
                let mut physics = model.clone();
                physics.methods = model.methods.iter().map(MethodModel::without_residual).collect();
                Some((model, physics))
            }
            Err(why) => {
                let file = &self.profiles[fold[0]].file;
                notes.push(format!("no model could be fitted when {file} was held out: {why:#}"));
                None
            }
        };
        let known: Vec<usize> = (0..self.profiles.len()).filter(|&k| chosen[k] && self.profiles[k].has_cpu()).collect();
        let always = |k: usize| self.regret_table(k).always(without).iter().map(|always| always.mean).collect();
        let left_out =
            |k: usize, spot: u32| without.is_some_and(|w| self.profiles[k].points[spot as usize].scenario == w);
        Ok(Fitted {
            seen,
            always: known.iter().map(|&k| (&self.profiles[k], always(k))).collect(),
            models,
            forests: self.table.grow(&chosen, left_out)?,
            knows_gpus: (0..chosen.len()).any(|k| chosen[k] && self.on_gpu[k]),
            known,
            notes,
        })
    }

    /// Returns a profile as a fold judges it, and its regret table: without its GPUs if no machine of the training has
    /// a real one. Predicting a real GPU from software adapters shows nothing.
    pub(super) fn judged(&self, k: usize, fitted: &Fitted<'_>) -> (&Profile, &RegretTable) {
        if fitted.knows_gpus || !self.on_gpu[k] {
            return (&self.profiles[k], self.regret_table(k));
        }
        let (profile, table) = self.on_cpu[k].get_or_init(|| {
            let mut profile = self.profiles[k].clone();
            profile.retain(|t| t.id.backend().class() == BackendClass::Cpu);
            let table = RegretTable::new(&profile);
            (profile, table)
        });
        (profile, table)
    }

    /// Returns the regret table of a profile.
    pub(super) fn regret_table(&self, k: usize) -> &RegretTable {
        self.regrets[k].get_or_init(|| RegretTable::new(&self.profiles[k]))
    }
}

impl<'a> Seen<'a> {
    pub(super) fn new(without: Option<&'a str>, designs: &'a Designs<'a>) -> Self {
        let costs = designs.profiles.iter().map(|_| OnceLock::new()).collect();
        Self { without, designs, costs }
    }

    /// Returns the measured costs of a profile.
    pub(super) fn costs(&self, k: usize) -> &[AlgorithmCost] {
        self.costs[k].get_or_init(|| costs_of_one(self.designs, k))
    }
}

impl Fitted<'_> {
    /// Predicts a profile; adds a note when the model predicts nothing.
    pub(super) fn predict(&self, profile: &Profile, notes: &mut Vec<String>) -> Option<Ours> {
        let (whole, physics) = self.models.as_ref()?;
        let all = profile.with_revisions(&profile.available());
        let predicted = |model: &Model| model.predict(&profile.hardware, &all).map(|p| p.costs);
        match predicted(whole).and_then(|whole| Ok(Ours { whole, physics: predicted(physics)? })) {
            Ok(ours) => Some(ours),
            Err(why) => {
                notes.push(format!("{} could not be predicted when it was held out: {why}", profile.file));
                None
            }
        }
    }

    /// Returns the strategies for a held-out profile, fewer if a scenario is held out too.
    ///
    /// # Errors
    /// When a regression fails.
    pub(super) fn contestants<'b>(
        &'b self,
        data: &'b Material<'_>,
        held: usize,
        ours: Option<&'b Ours>,
        available: &'b [AlgorithmId],
    ) -> Result<Vec<Contestant<'b>>> {
        let (profile, seen) = (&data.profiles[held], self.seen);
        let always: Vec<(&Profile, &[f64])> = self.always.iter().map(|(p, means)| (*p, &means[..])).collect();
        let likeness: Vec<&Likeness> = self.known.iter().map(|&k| &data.likeness[k]).collect();
        let nearest = baselines::nearest(&likeness, &data.likeness[held]);
        let nearest = nearest.map(|k| baselines::of_another(seen.costs(self.known[k]), available));
        let whole = ours.map(|o| &o.whole[..]).unwrap_or_default();
        let physics = ours.map(|o| &o.physics[..]).unwrap_or_default();
        let mut all = vec![
            by(OURS, Cow::Borrowed(whole), available),
            alone(RUNNING, by_costs_of_running(whole.to_vec(), available)),
            by(PHYSICS, Cow::Borrowed(physics), available),
            alone(FOREST, self.forests.chooser(&profile.hardware, available)),
            alone(SINGLE_BEST, baselines::single_best(&always, available)),
            by(NEAREST, Cow::Owned(nearest.unwrap_or_default()), available),
        ];
        if seen.without.is_none() {
            let crossed: Vec<(&Profile, &[RoleOutcome])> =
                self.known.iter().map(|&k| (&data.profiles[k], &data.outcomes[k][..])).collect();
            all.extend([
                alone("direct regression", direct(&crossed, &profile.hardware, available)?),
                alone("frozen constants (64)", baselines::frozen(64, "grid-sap", available)),
                alone("frozen constants (1000)", baselines::frozen(999, "sap", available)),
            ]);
        }
        // Only the scenario is held out from it, not its own machine. Crossovers are measured by its costs.
        all.push(Contestant { costs: None, ..by(FULL_SWEEP, Cow::Borrowed(seen.costs(held)), available) });
        Ok(all)
    }
}

/// Costs that a model keeps, or that were made for one choice.
type Costs<'a> = Cow<'a, [AlgorithmCost]>;

/// Chooses the cheapest by costs. Without any it chooses nothing, which counts as the worst choice.
fn by<'a>(name: &'static str, costs: Costs<'a>, available: &'a [AlgorithmId]) -> Contestant<'a> {
    Contestant { name, choose: by_costs(costs.to_vec(), available), costs: Some(costs) }
}

/// A strategy without costs, whose crossovers are not judged.
fn alone<'a>(name: &'static str, choose: Strategy<'a>) -> Contestant<'a> {
    Contestant { name, choose, costs: None }
}
