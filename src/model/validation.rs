//! How well a model did on what it had not seen.

/// How a model did on machines, or profiles, that were left out of its training.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Validation {
    /// What was left out in turn: `physical machine`, or `one of 24 groups of physical machines`; where there is one physical machine
    /// only `SIMD level and thread count`, or `profile`. The last two say little about machines never seen.
    pub held_out: String,
    /// Physical machines in the data.
    pub physical_machines: usize,
    /// Profiles, that is reports, in the data.
    pub profiles: usize,
    /// The ways to choose that were compared.
    pub methods: Vec<MethodScore>,
    /// How accuracy grows with the number of machines. Empty with fewer than three physical machines.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub learning: Vec<Learning>,
    /// How often intervals held what they should. `None` where that was not looked at.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Option::is_none"))]
    pub coverage: Option<Coverage>,
}

/// The score of one way to choose an algorithm. Regret is the time of its choice over the time of the best, less one.
///
/// Every physical machine counts the same in regrets, however many of its reports were held out.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MethodScore {
    /// Name of the way to choose.
    pub name: String,
    /// Regret, mean over the cells of a held-out report, each a quarter of a decade of a scenario, then over the reports.
    pub mean_regret: f64,
    /// 95th percentile over held-out reports of their mean regret.
    pub p95_regret: f64,
    /// Share of all cells with a regret over 10 %.
    pub share_over_10_percent: f64,
    /// How much of the gap between the best single algorithm (0) and the oracle (1) it closes.
    pub closed_gap: f64,
    /// Regret, mean over reports as seen by games: each number of objects counts as often as games have it, which is an assumption
    /// (log-normal around 800, two thirds of the frames within 220 to 2800). `None` in files from before this was told.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Option::is_none"))]
    pub mean_regret_in_games: Option<f64>,
    /// 95th percentile over held-out reports of the same.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Option::is_none"))]
    pub p95_regret_in_games: Option<f64>,
    /// Octaves between the measured and the predicted position of a border, the median over all borders between measured tuning.
    /// Where the predicted curves of the two algorithms do not cross in the range of measured sizes, the distance to the end
    /// of that range beyond which they would: a lower bound. `None` for what predicts no costs.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Option::is_none"))]
    pub crossing_error_octaves: Option<f64>,
    /// Share of these borders that were predicted within half an octave.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Option::is_none"))]
    pub crossings_within_half_octave: Option<f64>,
}

/// How well each way to choose did when it was trained on so many machines.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Learning {
    /// Physical machines in the training, each with all of its profiles.
    pub machines: usize,
    /// Random trainings, each judged on machines that are not in it.
    pub trainings: usize,
    /// The ways to choose.
    pub methods: Vec<LearningScore>,
}

/// One way to choose in a [`Learning`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LearningScore {
    /// Name of the way to choose.
    pub name: String,
    /// Mean regret, mean over the trainings.
    pub mean_regret: f64,
    /// 5th percentile over the trainings of their mean regret.
    pub low: f64,
    /// 95th percentile of the same.
    pub high: f64,
}

/// How often a 90 % interval held the measured figure, on machines or profiles that were left out.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Coverage {
    /// Share of measured times within their interval.
    pub times: f64,
    /// How many times these are.
    pub times_count: usize,
    /// Share of measured borders within their interval; `None` where there was none.
    pub crossings: Option<f64>,
    /// How many borders these are.
    pub crossings_count: usize,
}
