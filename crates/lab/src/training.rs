//! What a training says of itself: what it was trained on, and how well it did on what it had not seen.

use crate::report::Label;
use sapwise::Model;
use sapwise::json::{self, Format};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// What stands beside a model in its file, under the key `training`. Predictions don't need it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
#[non_exhaustive]
pub struct Training {
    /// The reports behind the model. Empty where they are too many.
    pub trained_on: Vec<TrainingReport>,
    /// Their numbers by label, where they are too many to be listed; else empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trained_on_counts: Vec<TrainingCount>,
    /// How each strategy did on what was held out.
    pub validation: Validation,
}

/// One report behind a model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct TrainingReport {
    /// File name without folders.
    pub file: String,
    /// The host.
    pub host: String,
    /// What kind of evidence it is.
    pub label: Label,
}

/// How many reports of one label are behind a model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct TrainingCount {
    /// What kind of evidence they are.
    pub label: Label,
    /// Reports.
    pub reports: usize,
    /// Physical machines that they are of.
    pub physical_machines: usize,
}

/// How strategies did on machines, or profiles, that were held out of the training.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Validation {
    /// What was held out in turn: `physical machine`, or `one of 10 groups of physical machines`; where there is one physical machine
    /// only `SIMD level and thread count`, or `profile`. The last two say little about machines never seen.
    pub held_out: String,
    /// Physical machines in the data.
    pub physical_machines: usize,
    /// CPU models of these.
    pub cpu_models: usize,
    /// Profiles, that is reports, in the data.
    pub profiles: usize,
    /// The strategies that were compared.
    pub methods: Vec<MethodScore>,
    /// What is lost by chance: by choosing from the timings of another run on the same machine. `None` without two runs of one machine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor: Option<Floor>,
    /// How far times lie from their prediction; `None` where fewer than two physical machines were held out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<Coverage>,
}

/// Mean regrets: over all sizes, and with each number of objects as often as games are assumed to have it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Regrets {
    /// Over all cells.
    pub all: f64,
    /// As games have them.
    pub in_games: f64,
}

/// Mean regrets of all reports, of those of one thread and of those of several.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Split {
    /// Of all reports.
    pub all: Regrets,
    /// Of those in which no algorithm ran on several threads; `None` of none.
    pub one_thread: Option<Regrets>,
    /// Of the others.
    pub several_threads: Option<Regrets>,
}

/// What is lost by chance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Floor {
    /// Pairs of runs on one machine under the same restriction, each judged on the other.
    pub pairs: usize,
    /// Whoever was best in the same cell of the other run.
    pub cells: Split,
    /// Whoever is cheapest by the costs measured in the other run.
    pub full_sweep: Split,
}

/// How far times lie from their prediction on machines held out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Coverage {
    /// Physical machines.
    pub physical_machines: usize,
    /// Nine of ten times lie within a factor of e to this of their prediction.
    pub times_90_ln: f64,
    /// The share of a machine's times that lie within the factor that the others tell, the mean over machines.
    pub times: f64,
    /// Nine of ten ratios of the times of the two fastest algorithms under a load lie within a factor of e to this of their prediction.
    pub ratios_90_ln: f64,
    /// The share of such ratios of a machine within the factor that the others tell.
    pub ratios: f64,
}

/// The score of one strategy. Regret is the time of its choice over the time of the best, less one.
///
/// Every physical machine counts the same in regrets, however many of its reports were held out.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct MethodScore {
    /// Name of the strategy.
    pub name: String,
    /// Regret, mean over the cells of a held-out report, each a quarter of a decade of a scenario, then over the reports.
    pub mean_regret: f64,
    /// Least mean regret of a held-out machine; of a held-out report, where all are of one machine. With [`MethodScore::largest_regret`] the
    /// range around the mean. `None` in files from before this was told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_regret: Option<f64>,
    /// Largest mean regret of the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_regret: Option<f64>,
    /// Mean regrets where the scenario was held out as well as the machine, as a user's scene is none of ours; `None` of a strategy that this
    /// is not asked of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unseen_scenario: Option<Split>,
    /// Mean regret judged by the means over frames in place of their medians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_means: Option<Regrets>,
    /// Mean regret on the reports in which no algorithm ran on several threads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub one_thread: Option<Regrets>,
    /// The same of the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub several_threads: Option<Regrets>,
    /// 95th percentile over held-out reports of their mean regret.
    pub p95_regret: f64,
    /// Share of all cells with a regret over 10 %.
    pub share_over_10_percent: f64,
    /// How much of the gap between the best single algorithm (0) and the oracle (1) it closes.
    pub closed_gap: f64,
    /// Regret, mean over reports as seen by games: each number of objects counts as often as games have it, which is an assumption
    /// (log-normal around 800, two thirds of the frames within 220 to 2800). `None` in files from before this was told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_regret_in_games: Option<f64>,
    /// Least of the same of a held-out machine or report, as [`MethodScore::least_regret`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_regret_in_games: Option<f64>,
    /// Largest of the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_regret_in_games: Option<f64>,
    /// 95th percentile over held-out reports of the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p95_regret_in_games: Option<f64>,
    /// Octaves between the measured and the predicted crossover, the median over all measured ones. Where the predicted curves of the
    /// two algorithms do not cross in the range of measured sizes, the distance to the end of that range beyond which they would: a
    /// lower bound. `None` for what predicts no costs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crossing_error_octaves: Option<f64>,
    /// Share of these crossovers that were predicted within half an octave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crossings_within_half_octave: Option<f64>,
}

impl MethodScore {
    /// Least and largest mean regret of what was held out.
    #[must_use]
    pub fn regret_range(&self) -> Option<[f64; 2]> {
        Some([self.least_regret?, self.largest_regret?])
    }

    /// The same as seen by games.
    #[must_use]
    pub fn regret_range_in_games(&self) -> Option<[f64; 2]> {
        Some([self.least_regret_in_games?, self.largest_regret_in_games?])
    }
}

/// A file that holds a model: what predicts, and what training says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredModel {
    /// What predicts.
    pub model: Model,
    /// What training says of it.
    pub training: Training,
}

impl Training {
    /// How many reports are behind the model.
    #[must_use]
    pub fn reports(&self) -> usize {
        self.trained_on.len() + self.trained_on_counts.iter().map(|c| c.reports).sum::<usize>()
    }

    /// How many physical machines these reports are of. A machine with reports of several labels counts for each of them where only the
    /// counts are kept.
    #[must_use]
    pub fn physical_machines(&self) -> usize {
        let listed: BTreeSet<&str> = self.trained_on.iter().map(|r| r.host.as_str()).collect();
        listed.len() + self.trained_on_counts.iter().map(|c| c.physical_machines).sum::<usize>()
    }

    /// How many reports of each label are behind the model, listed or counted.
    #[must_use]
    pub fn labels(&self) -> Vec<(Label, usize)> {
        let mut labels: Vec<(Label, usize)> = Vec::new();
        let listed = self.trained_on.iter().map(|r| (r.label, 1));
        for (label, count) in listed.chain(self.trained_on_counts.iter().map(|c| (c.label, c.reports))) {
            match labels.iter_mut().find(|l| l.0 == label) {
                Some(known) => known.1 += count,
                None => labels.push((label, count)),
            }
        }
        labels
    }
}

/// What training says of itself, read from the file of a model, whose other keys are the engine's.
const TRAINING: Format =
    Format::new("model", 3).skipping(&["name", "simulated", "ranges", "ratios_90_ln", "places", "methods"]);

/// Reads a model with what training says of itself.
///
/// # Errors
/// When the text is no sound model, or holds no sound training.
pub fn read_model(text: &str) -> Result<StoredModel, json::Error> {
    read_model_and_skipped(text).map(|read| read.0)
}

/// As [`read_model`], with the keys of a newer minor version that were skipped.
pub(crate) fn read_model_and_skipped(text: &str) -> Result<(StoredModel, Vec<String>), json::Error> {
    #[derive(Deserialize)]
    struct Keys {
        training: Training,
    }
    let json::Read { value: Keys { training }, mut skipped, .. } = TRAINING.read(text)?;
    let json::Read { value: model, skipped: in_model, .. } =
        Format::MODEL.read::<Model>(text)?.checked(Model::defect)?;
    // A new key of the outermost level is unknown to both readers.
    skipped.extend(in_model.into_iter().filter(|key| !skipped.contains(key)).collect::<Vec<_>>());
    Ok((StoredModel { model, training }, skipped))
}

impl StoredModel {
    /// The model that is built into the library, with what its training says of itself.
    ///
    /// # Errors
    /// Never, unless the file was changed by hand.
    pub fn built_in() -> Result<Self, json::Error> {
        read_model(include_str!("../../../models/default.json"))
    }
}

/// Writes a model with what training says of itself, one key a line.
///
/// # Errors
/// When a figure can't be written.
pub fn write_model(model: &Model, training: &Training) -> Result<String, json::Error> {
    #[derive(Serialize)]
    struct Keys<'a> {
        #[serde(flatten)]
        model: &'a Model,
        training: &'a Training,
    }
    TRAINING.write(&Keys { model, training })
}
