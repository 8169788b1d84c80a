//! What was decided for a frame, and why.

use crate::algorithm::AlgorithmId;
use crate::load::Load;
use crate::tuning::Source;

/// Why an algorithm was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// The first frame: nothing ran before.
    First,
    /// It ran before and is still the cheapest.
    Stayed,
    /// Another would be cheaper, but has not yet promised to save what the switch to it costs.
    Hysteresis,
    /// It became cheaper than the one before, by more than the switch costs.
    Switched,
    /// It is not the cheapest: it runs in this frame to find out what it costs.
    Explored,
    /// The one that was chosen failed in this frame.
    FellBack,
    /// A frame of the one before cost far more than was expected of it: this one is the cheapest of the others, most often a tree, whose cost
    /// does not depend on where the boxes lie.
    Sheltered,
}

/// The last decision and what it rested on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Decision<'a> {
    /// The algorithm that ran.
    pub algorithm: &'a AlgorithmId,
    /// Its expected cost in nanoseconds, corrected by what was learned; `None` where only the number of objects decides.
    pub predicted_ns: Option<f64>,
    /// What the frame took in nanoseconds. `None` where it was not timed: in frames so short that the clock would cost more than
    /// one part in a hundred of them only some are.
    pub measured_ns: Option<f64>,
    /// The cheapest of the others and its expected cost in nanoseconds.
    pub runner_up: Option<(&'a AlgorithmId, f64)>,
    /// Why it was chosen.
    pub reason: Reason,
    /// Where the costs came from.
    pub source: Source,
    /// The load that was estimated.
    pub load: Load,
}

/// A decision by position among the candidates, without a copy of any name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    pub(super) chosen: usize,
    pub(super) predicted_ns: Option<f64>,
    pub(super) runner_up: Option<(usize, f64)>,
    pub(super) reason: Reason,
}
