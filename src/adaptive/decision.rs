//! The decision for a frame, and its reason.

use crate::algorithm::AlgorithmId;
use crate::load::Load;
use crate::tuning::Source;
use std::fmt;

crate::described! {
    /// Why an algorithm was chosen.
    ///
    /// ```
    /// assert_eq!(sapwise::Reason::Stayed.to_string(), "still the cheapest");
    /// ```
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Reason {
        /// The first frame: nothing ran before.
        First = "the cheapest in the first frame",
        /// It ran before and is still the cheapest.
        Stayed = "still the cheapest",
        /// Another would be cheaper, but the switch to it would not have paid for itself yet.
        Hysteresis = "no longer the cheapest, but a switch would not have paid yet",
        /// It became cheaper than the previous one, by more than the price of the switch.
        Switched = "cheaper than the one before by more than the switch costs",
        /// It is not expected to be the cheapest: a trial measures its cost.
        Explored = "not the cheapest, tried to learn what it costs",
        /// The chosen one failed in this frame.
        FellBack = "in place of one that failed",
    }
}

/// The last decision and its basis. Its text is one sentence for people, whose wording may change.
///
/// ```
/// use sapwise::{Aabb, Adaptive, BroadPhase, Pairs, Reason, Registry, Tuning};
///
/// let registry = Registry::new();
/// let mut adaptive = Adaptive::new(Tuning::usual(&registry), &registry)?;
/// adaptive.find_pairs(&[Aabb::cube([0.0; 3], 1.0); 9], &mut Pairs::new())?;
/// let decision = adaptive.last_decision().expect("a frame ran");
/// assert_eq!((decision.reason, decision.load.objects), (Reason::First, 9));
/// println!("{decision}"); // a sentence
/// # Ok::<(), sapwise::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Decision<'a> {
    /// The algorithm that ran.
    pub algorithm: &'a AlgorithmId,
    /// Its expected cost in nanoseconds, with learned corrections; `None` if the number of objects alone decides.
    pub predicted_ns: Option<f64>,
    /// The time of the frame in nanoseconds, `None` if it was not timed. Of frames so short that reading the clock
    /// takes more than 0.25 %, only some are timed.
    pub measured_ns: Option<f64>,
    /// The cheapest of the others and its expected cost in nanoseconds.
    pub runner_up: Option<(&'a AlgorithmId, f64)>,
    /// The reason for the choice.
    pub reason: Reason,
    /// The origin of the costs.
    pub source: Source,
    /// The estimated load.
    pub load: Load,
}

impl fmt::Display for Decision<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.algorithm, self.reason)?;
        match (self.predicted_ns, self.measured_ns) {
            (Some(expected), Some(took)) => write!(f, ": {} expected, {} taken", Time(expected), Time(took))?,
            (Some(expected), None) => write!(f, ": {} expected", Time(expected))?,
            (None, Some(took)) => write!(f, ", decided by the number of boxes: {} taken", Time(took))?,
            (None, None) => f.write_str(", decided by the number of boxes")?,
        }
        if let Some((next, ns)) = self.runner_up {
            write!(f, ", the next is {next} with {}", Time(ns))?;
        }
        let Load { objects, pairs, moved, .. } = self.load;
        write!(f, "; {objects} boxes, about {pairs:.0} pairs, boxes move by {moved:.2} of an edge")
    }
}

/// Nanoseconds, displayed in a readable unit.
struct Time(f64);

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            ns if ns < 1e3 => write!(f, "{ns:.0} ns"),
            ns if ns < 1e6 => write!(f, "{:.1} µs", ns / 1e3),
            ns => write!(f, "{:.1} ms", ns / 1e6),
        }
    }
}

/// A decision, with candidates by position, so that no name is copied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    pub(super) chosen: usize,
    pub(super) predicted_ns: Option<f64>,
    pub(super) runner_up: Option<(usize, f64)>,
    pub(super) reason: Reason,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decision_is_one_sentence_with_what_is_known() {
        let [algorithm, next]: [AlgorithmId; 2] = ["sap@cpu2", "bvh@cpu1"].map(|id| id.parse().unwrap());
        let load = Load::of_objects(800).with_pairs(409.7).with_moved(0.031);
        let decision = Decision {
            algorithm: &algorithm,
            predicted_ns: Some(41_049.0),
            measured_ns: Some(1.52e6),
            runner_up: Some((&next, 900.0)),
            reason: Reason::Stayed,
            source: Source::Measured,
            load,
        };
        let told = "sap@cpu2, still the cheapest: 41.0 µs expected, 1.5 ms taken, the next is bvh@cpu1 with 900 ns; \
            800 boxes, about 410 pairs, boxes move by 0.03 of an edge";
        assert_eq!(decision.to_string(), told);
        let by_count = Decision { predicted_ns: None, measured_ns: None, runner_up: None, ..decision };
        assert!(
            by_count.to_string().starts_with("sap@cpu2, still the cheapest, decided by the number of boxes; 800 boxes")
        );
    }
}
