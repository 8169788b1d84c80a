//! What a sampling process is told, and what it tells.

use sapwise::{AlgorithmId, GpuIdentity};
use serde::{Deserialize, Serialize};

/// What holds for all samples, as it is handed to a process of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Session {
    /// Name of the scenario.
    pub(crate) scenario: String,
    /// Seed of the scenes.
    pub(crate) seed: u64,
    /// Cores that algorithms may use.
    pub(crate) cores: u32,
    /// The GPUs that algorithms may use, as they were when the hardware was measured.
    pub(crate) gpus: Vec<GpuIdentity>,
    /// The algorithms that may be asked for.
    pub(crate) algorithms: Vec<AlgorithmId>,
}

/// A request for one sample, a line of standard input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SampleRequest {
    pub(super) algorithm: AlgorithmId,
    /// Objects of the scene.
    pub(super) objects: u32,
    /// Pairs in the second frame of the scene.
    pub(super) pairs: u64,
    /// No frame begins after this time.
    pub(super) seconds: f64,
}

/// What a sampling process prints, one a line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Reply {
    /// GPUs are open, and requests may come. What went wrong so far.
    Ready(Vec<String>),
    /// The sample was taken.
    Taken {
        /// Median over the frames.
        ns: f64,
        /// Standard deviation of its logarithm, from the spread of the frames.
        noise_ln: f64,
        /// Share of the CPU that other programs have taken since the process was ready; null where that can't be told.
        foreign_load: Option<f64>,
    },
    /// The algorithm can't run, or returned a wrong answer.
    Failed {
        /// Why.
        why: String,
        /// Whether it returned a wrong answer.
        wrong: bool,
    },
    /// Not a single frame was done in time.
    TooSlow,
}
