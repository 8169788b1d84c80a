//! What to replay.

use super::co_runner::CoRunner;
use super::frame_source::FrameSource;

/// The frames of a replay, how often they run, and what the adaptive choice may do.
#[derive(Debug)]
pub(crate) struct ReplaySettings {
    pub(crate) source: FrameSource,
    pub(crate) frames: usize,
    pub(crate) repeats: usize,
    /// Of the order in which algorithms take turns.
    pub(crate) seed: u64,
    pub(crate) learning: bool,
    pub(crate) exploring: bool,
    pub(crate) co_runner: Option<CoRunner>,
}
