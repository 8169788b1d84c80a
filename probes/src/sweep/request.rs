//! What a sweeping process is told, and what it tells.

use sapwise::{AlgorithmId, GpuIdentity};
use sapwise_lab::report::Point;
use serde::{Deserialize, Serialize};

/// The sweep of one scenario, as it is handed to a process of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SweepRequest {
    /// Name of the scenario.
    pub(crate) scenario: String,
    /// The sizes.
    pub(crate) schedule: Schedule,
    /// Cores that algorithms may use.
    pub(crate) cores: u32,
    /// Seed of the scenes and of the order of turns.
    pub(crate) seed: u64,
    /// Time for all sizes.
    pub(crate) seconds: f64,
    /// The GPUs that algorithms may use, as they were when the hardware was measured.
    pub(crate) gpus: Vec<GpuIdentity>,
    /// Whether foreign load is wanted, so that it spoils nothing.
    pub(crate) contended: bool,
}

/// Which sizes, and who takes part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Schedule {
    /// Every algorithm through these numbers of objects, ascending, until it leaves the race.
    Ascent(Vec<u32>),
    /// Where the choice is in doubt, in this order.
    Visits(Vec<Visit>),
}

impl Schedule {
    /// Whether an algorithm takes part anywhere.
    pub(super) fn admits(&self, id: &AlgorithmId) -> bool {
        match self {
            Self::Ascent(_) => true,
            Self::Visits(visits) => visits.iter().any(|v| v.algorithms.contains(id)),
        }
    }
}

/// One more point, of those algorithms between which the choice lies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Visit {
    /// Number of objects.
    pub(crate) objects: u32,
    /// Time for it.
    pub(crate) seconds: f64,
    /// Who takes part; two or more.
    pub(crate) algorithms: Vec<AlgorithmId>,
}

/// What a sweeping process prints, one a line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Event {
    /// A size is done.
    Point(Box<Point>),
    /// Something that the reader of the report should know.
    Remark(String),
    /// An algorithm returned a wrong answer. The report is kept, and the probe has failed.
    Mismatch(String),
}
