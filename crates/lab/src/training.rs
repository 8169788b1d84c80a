//! What a model was trained on, and how well models of its kind did on held-out machines.

use crate::report::Label;
use sapwise_tune::Model;
use sapwise_tune::json::{self, Format};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The key `training` in the file of a model. Predictions don't need it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
#[non_exhaustive]
pub struct Training {
    /// The reports behind the model.
    pub trained_on: Vec<TrainingReport>,
    /// How well each strategy did on what was held out.
    pub validation: Validation,
    /// How many of the machines that others published lie inside; `None` without these.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub published: Option<PublishedShares>,
}

/// How many of the machines that others published lie inside the ranges of a model, or outside by at most a tenth.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct PublishedShares {
    /// CPUs.
    pub cpus: Outside,
    /// GPUs.
    pub gpus: Outside,
    /// For each parameter with enough values: the share of them, from 0 to 1, within its range.
    pub within: BTreeMap<String, f64>,
}

/// Published machines outside the ranges of a model.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Outside {
    /// All of them.
    pub machines: usize,
    /// Those with at least one known parameter outside.
    pub outside: usize,
}

/// One report behind a model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct TrainingReport {
    /// Its folder and file name, without other folders.
    pub file: String,
    /// The host.
    pub host: String,
    /// What kind of evidence it is.
    pub label: Label,
}

/// How well strategies did on machines, or profiles, that were held out of the training.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Validation {
    /// What was held out in turn: `physical machine`. With one physical machine only it is `SIMD level and thread
    /// count`, or `profile`, which says little about other machines.
    pub held_out: String,
    /// Physical machines in the data.
    pub physical_machines: usize,
    /// CPU models of these machines.
    pub cpu_models: usize,
    /// Reports in the data.
    pub profiles: usize,
    /// The strategies that were compared.
    pub methods: Vec<MethodScore>,
    /// The noise floor; `None` without repeated runs of a machine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor: Option<Floor>,
    /// How far times lie from their prediction; `None` when fewer than two physical machines were held out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<Coverage>,
}

/// Mean regrets: over all sizes, and weighted by how often games are assumed to have each number of objects.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Regrets {
    /// Over all cells.
    pub all: f64,
    /// Weighted as in games.
    pub in_games: f64,
}

/// Mean regrets of all reports, of those on one thread and of those on several.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Split {
    /// Of all reports.
    pub all: Regrets,
    /// Of those in which no algorithm ran on several threads.
    pub one_thread: Option<Regrets>,
    /// Of the others.
    pub several_threads: Option<Regrets>,
}

/// The noise floor: the regret of choosing by another run on the same machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Floor {
    /// Pairs of runs on one machine under the same restriction, each judged on the other.
    pub pairs: usize,
    /// Choosing the best in the same cell of the other run.
    pub cells: Split,
    /// Choosing the cheapest by the costs measured in the other run.
    pub full_sweep: Split,
}

/// How far times lie from their prediction on held-out machines.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Coverage {
    /// Physical machines.
    pub physical_machines: usize,
    /// Nine of ten times lie within a factor of e to the power of this from their prediction.
    pub times_90_ln: f64,
    /// The share of a machine's times within the factor of the other machines, the mean over machines.
    pub times: f64,
    /// The same as `times_90_ln` for the ratio of the two fastest algorithms under a load.
    pub ratios_90_ln: f64,
    /// The same as `times` for these ratios.
    pub ratios: f64,
}

/// The score of one strategy. Regret is the time of its choice over the time of the best, less one. Every physical
/// machine counts the same, however many reports it has.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct MethodScore {
    /// Name of the strategy.
    pub name: String,
    /// Mean regret over the cells of a held-out report, each a quarter of a decade of a scenario, then over the
    /// reports.
    pub mean_regret: f64,
    /// Least mean regret of a held-out machine, or of a held-out report if all are of one machine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_regret: Option<f64>,
    /// Largest mean regret of the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_regret: Option<f64>,
    /// Mean regrets with the scenario held out as well; `None` if the strategy is not judged on that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unseen_scenario: Option<Split>,
    /// Mean regret by the means over frames instead of the medians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_means: Option<Regrets>,
    /// Mean regret on the reports in which no algorithm ran on several threads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub one_thread: Option<Regrets>,
    /// The same on the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub several_threads: Option<Regrets>,
    /// Share of all cells with a regret over 10 %.
    pub share_over_10_percent: f64,
    /// Mean regret weighted as in games, which is an assumption: log-normal around 800 objects, two thirds of the
    /// frames between 220 and 2800.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_regret_in_games: Option<f64>,
    /// Median distance between measured and predicted crossovers that matter, in octaves, over all scenarios: those
    /// whose algorithm below costs over 1.1 times the one above at twice the objects. If the predicted costs don't
    /// cross within the measured sizes, the distance to the end beyond which they would, a lower bound. `None` for a
    /// strategy that predicts no costs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crossing_error_octaves: Option<f64>,
    /// Share of these crossovers that were predicted within half an octave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crossings_within_half_octave: Option<f64>,
}

impl MethodScore {
    /// Returns the least and the largest mean regret of what was held out.
    pub fn regret_range(&self) -> Option<[f64; 2]> {
        Some([self.least_regret?, self.largest_regret?])
    }
}

/// The file of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredModel {
    /// The model.
    pub model: Model,
    /// How it was trained and validated.
    pub training: Training,
}

/// The training in the file of a model, whose other keys are the model's.
const TRAINING: Format = Format::new("model", 5).skipping(&["name", "ranges", "ratios_90_ln", "places", "methods"]);

/// Reads the file of a model.
///
/// # Errors
/// When the model or its training is unsound.
pub fn read_model(text: &str) -> Result<StoredModel, json::Error> {
    read_model_and_skipped(text).map(|read| read.0)
}

/// Reads the file of a model, and returns the keys of a newer minor version that were skipped.
pub(crate) fn read_model_and_skipped(text: &str) -> Result<(StoredModel, Vec<String>), json::Error> {
    #[derive(Deserialize)]
    struct Keys {
        training: Training,
    }
    let json::Read { value: Keys { training }, mut skipped, .. } = TRAINING.read(text)?;
    let json::Read { value: model, skipped: in_model, .. } =
        Format::MODEL.read::<Model>(text)?.checked(Model::defect)?;
    // Neither reader knows a new key of the outermost level.
    skipped.extend(in_model.into_iter().filter(|key| !skipped.contains(key)).collect::<Vec<_>>());
    Ok((StoredModel { model, training }, skipped))
}

impl StoredModel {
    /// Returns the model that is built into the library, with its training.
    ///
    /// # Errors
    /// Never, unless the file was changed by hand.
    pub fn built_in() -> Result<Self, json::Error> {
        read_model(include_str!("../default.json"))
    }
}

/// Writes the file of a model, one key a line.
///
/// # Errors
/// When a number can't be written.
pub fn write_model(model: &Model, training: &Training) -> Result<String, json::Error> {
    #[derive(Serialize)]
    struct Keys<'a> {
        #[serde(flatten)]
        model: &'a Model,
        training: &'a Training,
    }
    TRAINING.write(&Keys { model, training })
}
