//! One frame of a replay: what ran, and the times that follow from its samples.

use super::samples::Samples;
use sapwise::{AlgorithmId, Load, Reason};

/// One frame: its samples, and the times that follow from them in nanoseconds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Frame {
    pub(crate) objects: usize,
    /// The time of the adaptive choice, choice included.
    pub(crate) adaptive_ns: f64,
    /// The same in the repeats in which it did not explore at this frame; infinite where it explored in all of them.
    pub(crate) unexplored_ns: f64,
    /// The time of each fixed algorithm; infinite where it was not timed.
    pub(crate) fixed_ns: Vec<f64>,
    pub(crate) adaptive: Samples,
    pub(crate) fixed: Vec<Samples>,
}

/// What the adaptive choice ran at a frame of a repeat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Taken {
    /// A position among the fixed algorithms.
    pub(crate) chosen: Option<usize>,
    pub(crate) explored: bool,
}

/// What it told of its decision.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Told {
    pub(crate) reason: Reason,
    pub(crate) load: Load,
    pub(crate) predicted_ns: Option<f64>,
    pub(crate) measured_ns: Option<f64>,
    pub(crate) runner_up: Option<(AlgorithmId, f64)>,
}

impl Frame {
    /// `taken` is what ran at this frame and at the one before it, in each repeat.
    pub(super) fn new(
        objects: usize,
        adaptive: Samples,
        fixed: Vec<Samples>,
        taken: &[(Taken, Option<Taken>)],
    ) -> Self {
        Self {
            objects,
            adaptive_ns: mean_over_kinds(&adaptive, taken),
            unexplored_ns: mean_over_kinds(&adaptive.of(|r| !taken[r].0.explored), taken),
            fixed_ns: fixed.iter().map(Samples::time).collect(),
            adaptive,
            fixed,
        }
    }
}

/// What a frame of the adaptive choice is beside one that continues with what ran before.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Continues,
    /// It costs more than the next one of the same algorithm.
    Switches,
    Explores,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Continues, Self::Switches, Self::Explores];

    fn of(taken: Taken, before: Option<Taken>) -> Self {
        match before {
            _ if taken.explored => Self::Explores,
            Some(before) if before.chosen != taken.chosen => Self::Switches,
            _ => Self::Continues,
        }
    }
}

/// The mean of the times of each kind, weighted by the repeats in which the frame is of that kind. Infinite without samples.
///
/// Not one time of all repeats: that would leave out a dear frame, one that explores or switches, wherever most of the repeats have
/// theirs at other frames.
fn mean_over_kinds(adaptive: &Samples, taken: &[(Taken, Option<Taken>)]) -> f64 {
    let kinds: Vec<Kind> = taken.iter().map(|&(now, before)| Kind::of(now, before)).collect();
    let own = Kind::ALL.map(|kind| adaptive.of(|repeat| kinds[repeat] == kind));
    let sum: f64 = own.iter().filter(|s| s.len() > 0).map(|s| s.time() * s.len() as f64).sum();
    if adaptive.len() == 0 { f64::INFINITY } else { sum / adaptive.len() as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::examples::{samples, taken};

    #[test]
    fn a_dear_frame_counts_though_most_repeats_have_it_elsewhere() {
        let explored = Taken { explored: true, ..taken(1) };
        let stays = (taken(0), Some(taken(0)));
        let adaptive = samples(&[10.0, 10.0, 10.0, 40.0]);
        let fixed = || vec![samples(&[9.0; 4])];
        let frame = Frame::new(5, adaptive.clone(), fixed(), &[stays, stays, stays, (explored, Some(taken(0)))]);
        assert_eq!((frame.adaptive_ns, frame.unexplored_ns), (17.5, 10.0));
        // The first frame after a switch is one of its own kind too.
        let frame = Frame::new(5, adaptive.clone(), fixed(), &[stays, stays, stays, (taken(0), Some(taken(1)))]);
        assert_eq!((frame.adaptive_ns, frame.unexplored_ns), (17.5, 17.5));
        // Noise of one repeat among alike ones is no dear frame.
        let frame = Frame::new(5, samples(&[10.0, 10.0, 10.0, 10.0, 40.0, 10.0]), fixed(), &[stays; 6]);
        assert_eq!(frame.adaptive_ns, 10.0);
    }
}
