//! What a sweeping process is told, and what it tells.

use sapwise::GpuIdentity;
use sapwise::report::Point;
use serde::{Deserialize, Serialize};

/// The sweep of one scenario, as it is handed to a process of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Order {
    /// Name of the scenario.
    pub(crate) scenario: String,
    /// Numbers of objects, ascending.
    pub(crate) sizes: Vec<u32>,
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

/// What a sweeping process prints, one a line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Event {
    /// A size is done.
    Point(Box<Point>),
    /// Something that the reader of the report should know.
    Remark(String),
    /// An algorithm gave a wrong answer. The report is kept, and the probe has failed.
    Mismatch(String),
}
