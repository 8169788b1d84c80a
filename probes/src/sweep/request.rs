//! The request to a sweeping process and its events.

use sapwise::AlgorithmId;
use sapwise_lab::report::Point;
use sapwise_tune::GpuIdentity;
use serde::{Deserialize, Serialize};

/// The sweep of one scenario by a process of its own.
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
    /// The GPUs that algorithms may use, as seen when the hardware was measured.
    pub(crate) gpus: Vec<GpuIdentity>,
}

/// The sizes, and the algorithms at each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Schedule {
    /// Every algorithm through these numbers of objects, ascending, until it leaves the race.
    Ascent(Vec<u32>),
    /// Single points in this order.
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

/// Another point for the algorithms that are close there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Visit {
    /// Number of objects.
    pub(crate) objects: u32,
    /// Time for the point.
    pub(crate) seconds: f64,
    /// The algorithms, two or more.
    pub(crate) algorithms: Vec<AlgorithmId>,
}

/// A line that a sweeping process prints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Event {
    /// A size is done.
    Point(Box<Point>),
    /// A remark for the report.
    Remark(String),
    /// An algorithm returned a wrong answer: the report is kept, and the probe fails.
    Mismatch(String),
}
