//! The outcome of a replay and the numbers that follow from it.

use super::samples::{Samples, windows};
use sapwise::algorithm::Load;
use sapwise::{AlgorithmId, Reason};
use sapwise_lab::figures::Replay;
use sapwise_tune::stats::{median, quantile};
use serde::Serialize;
use std::ops::Range;

/// The outcome of a replay.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) fixed: Vec<AlgorithmId>,
    pub(crate) frames: Vec<Frame>,
    /// The adaptive choice at every frame of the last complete repeat.
    pub(crate) choices: Vec<Choice>,
    /// Complete repeats.
    pub(crate) repeats: usize,
    pub(crate) interrupted: bool,
    /// Median share of the CPU that other programs took; `None` when the replay was too short to measure it.
    pub(crate) foreign_load: Option<f64>,
    /// Algorithms that could not run, or not to the end, and why.
    pub(crate) notes: Vec<String>,
}

/// The times of a frame over all repeats, in nanoseconds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Frame {
    pub(crate) objects: usize,
    /// The adaptive choice with its decision.
    pub(crate) adaptive_ns: f64,
    /// The best algorithm of every [`WINDOW`](super::WINDOW), or the best single one when that is faster.
    pub(crate) windows_ns: f64,
    /// Each fixed algorithm; infinite when it was not timed.
    pub(crate) fixed_ns: Vec<f64>,
}

/// The adaptive choice at a frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Choice {
    /// A position among the fixed algorithms.
    pub(crate) chosen: Option<usize>,
    pub(crate) reason: Reason,
    pub(crate) load: Load,
    pub(crate) predicted_ns: Option<f64>,
    pub(crate) measured_ns: Option<f64>,
    pub(crate) runner_up: Option<(AlgorithmId, f64)>,
}

impl Choice {
    pub(crate) fn explored(&self) -> bool {
        self.reason == Reason::Explored
    }
}

/// The times of one contestant over some frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Times {
    pub(crate) total_ms: f64,
    pub(crate) median_ms: f64,
    pub(crate) p99_ms: f64,
    pub(crate) worst_ms: f64,
}

impl Times {
    fn of(ns: impl Iterator<Item = f64>) -> Self {
        let ms: Vec<f64> = ns.map(|ns| ns / 1e6).collect();
        let or_none = |value: Option<f64>| value.unwrap_or(f64::INFINITY);
        Self {
            total_ms: ms.iter().sum(),
            median_ms: or_none(median(&ms)),
            p99_ms: or_none(quantile(&ms, 0.99)),
            worst_ms: or_none(ms.iter().copied().max_by(f64::total_cmp)),
        }
    }
}

/// The adaptive choice over some frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Part {
    pub(crate) from_frame: usize,
    /// The last one.
    pub(crate) to_frame: usize,
    /// Its time over that of the fixed algorithm that is best over all frames; null when none ran in all of them.
    pub(crate) over_best_fixed: Option<f64>,
    /// Its time over that of an oracle that runs the best algorithm of every window.
    pub(crate) over_windows: f64,
    pub(crate) adaptive: Times,
    pub(crate) windows: Times,
    /// Changes of the algorithm in the last repeat, explored frames aside.
    pub(crate) switches: usize,
    /// Explored frames of the last repeat.
    pub(crate) explored: usize,
}

/// Kinds of frames of the adaptive choice.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Continues,
    /// It costs more than the next frame of the same algorithm.
    Switches,
    Explores,
}

impl Kind {
    fn of(choices: &[Choice], at: usize) -> Self {
        let now = &choices[at];
        match at.checked_sub(1).map(|before| choices[before].chosen) {
            _ if now.explored() => Self::Explores,
            Some(before) if before != now.chosen => Self::Switches,
            _ => Self::Continues,
        }
    }
}

/// Combines the samples of each frame. `choices` holds the adaptive choices of each repeat.
pub(super) fn frames(
    objects: &[usize],
    adaptive: &[Samples],
    fixed: &[Vec<Samples>],
    choices: &[Vec<Choice>],
) -> Vec<Frame> {
    let windows = windows(fixed);
    let frame = |at: usize| Frame {
        objects: objects[at],
        adaptive_ns: mean_over_kinds(&adaptive[at], &choices.iter().map(|c| Kind::of(c, at)).collect::<Vec<_>>()),
        windows_ns: windows[at],
        fixed_ns: fixed[at].iter().map(Samples::time).collect(),
    };
    let mut frames: Vec<Frame> = (0..objects.len()).map(frame).collect();
    // Noise can mislead the choice for a window.
    if let Some((k, _)) = best_fixed(&frames).filter(|(_, ns)| *ns < windows.iter().sum()) {
        frames.iter_mut().for_each(|f| f.windows_ns = f.fixed_ns[k]);
    }
    frames
}

/// The mean of the times of each kind, weighted by the repeats in which the frame is of that kind. Infinite without
/// samples.
///
/// The median over all repeats would leave out an expensive frame that most repeats have elsewhere.
fn mean_over_kinds(adaptive: &Samples, kinds: &[Kind]) -> f64 {
    let own = [Kind::Continues, Kind::Switches, Kind::Explores].map(|kind| adaptive.of(|repeat| kinds[repeat] == kind));
    let sum: f64 = own.iter().filter(|s| s.len() > 0).map(|s| s.time() * s.len() as f64).sum();
    if adaptive.len() == 0 { f64::INFINITY } else { sum / adaptive.len() as f64 }
}

/// Position and total in nanoseconds of the fixed algorithm with the least total over all frames.
fn best_fixed(frames: &[Frame]) -> Option<(usize, f64)> {
    let count = frames.first().map_or(0, |f| f.fixed_ns.len());
    let totals = (0..count).map(|k| (k, frames.iter().map(|f| f.fixed_ns[k]).sum::<f64>()));
    totals.filter(|(_, ns)| ns.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1))
}

impl Outcome {
    /// Position of the fixed algorithm with the least total; `None` when none was timed at all frames.
    pub(crate) fn best_fixed(&self) -> Option<usize> {
        best_fixed(&self.frames).map(|(k, _)| k)
    }

    /// The times of a fixed algorithm, or the number of frames at which it was not timed.
    pub(crate) fn fixed_times(&self, k: usize) -> Result<Times, usize> {
        match self.frames.iter().filter(|f| f.fixed_ns[k].is_infinite()).count() {
            0 => Ok(Times::of(self.frames.iter().map(|f| f.fixed_ns[k]))),
            missed => Err(missed),
        }
    }

    /// Frames of the last repeat in which each fixed algorithm ran, explored frames included.
    pub(crate) fn frames_run(&self, k: usize) -> usize {
        self.choices.iter().filter(|c| c.chosen == Some(k)).count()
    }

    /// Frames at which the last repeat goes on with another algorithm than before, explored frames aside.
    pub(crate) fn switches(&self) -> Vec<usize> {
        let settled: Vec<usize> = (0..self.choices.len()).filter(|&at| !self.choices[at].explored()).collect();
        let differ = |w: &[usize]| (self.choices[w[0]].chosen != self.choices[w[1]].chosen).then_some(w[1]);
        settled.windows(2).filter_map(differ).collect()
    }

    pub(crate) fn part(&self, range: Range<usize>) -> Part {
        let frames = &self.frames[range.clone()];
        let adaptive = Times::of(frames.iter().map(|f| f.adaptive_ns));
        let windows = Times::of(frames.iter().map(|f| f.windows_ns));
        let best = self.best_fixed().map(|k| Times::of(frames.iter().map(|f| f.fixed_ns[k])));
        Part {
            from_frame: range.start,
            to_frame: range.end - 1,
            over_best_fixed: best.map(|best| adaptive.total_ms / best.total_ms),
            over_windows: adaptive.total_ms / windows.total_ms,
            adaptive,
            windows,
            switches: self.switches().iter().filter(|at| range.contains(at)).count(),
            explored: self.choices[range].iter().filter(|c| c.explored()).count(),
        }
    }

    /// Returns the picture of this replay, with paragraphs below it.
    pub(crate) fn picture(&self, title: &str, caption: Vec<String>) -> Replay {
        let times = |k: usize| self.frames.iter().map(|f| f.fixed_ns[k]).collect();
        Replay {
            title: title.to_owned(),
            chosen_ns: self.frames.iter().map(|f| f.adaptive_ns).collect(),
            chosen: self.choices.iter().map(|c| c.chosen).collect(),
            fixed: self.fixed.iter().enumerate().map(|(k, id)| (id.to_string(), times(k))).collect(),
            caption,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::samples::tests::samples;
    use super::*;

    pub(crate) fn choice(chosen: usize, reason: Reason) -> Choice {
        let (load, runner_up) = (Load::default(), None);
        Choice { chosen: Some(chosen), reason, load, predicted_ns: Some(1e6), measured_ns: None, runner_up }
    }

    /// Makes an outcome of one repeat: objects, milliseconds of the adaptive choice and of the fixed algorithms, and
    /// the choice.
    pub(crate) fn outcome(fixed: &[&str], list: &[(usize, f64, &[f64], Choice)]) -> Outcome {
        let choices: Vec<Choice> = list.iter().map(|f| f.3.clone()).collect();
        let adaptive: Vec<Samples> = list.iter().map(|f| samples(&[f.1 * 1e6])).collect();
        let times: Vec<Vec<Samples>> =
            list.iter().map(|f| f.2.iter().map(|ms| samples(&[ms * 1e6])).collect()).collect();
        let objects: Vec<usize> = list.iter().map(|f| f.0).collect();
        Outcome {
            fixed: fixed.iter().map(|id| id.parse().unwrap()).collect(),
            frames: frames(&objects, &adaptive, &times, std::slice::from_ref(&choices)),
            choices,
            repeats: 1,
            interrupted: false,
            foreign_load: None,
            notes: Vec::new(),
        }
    }

    #[test]
    fn an_expensive_frame_counts_though_most_repeats_have_it_elsewhere() {
        use Kind::{Continues, Explores, Switches};
        let adaptive = samples(&[10.0, 10.0, 10.0, 40.0]);
        assert_eq!(mean_over_kinds(&adaptive, &[Continues, Continues, Continues, Explores]), 17.5);
        assert_eq!(mean_over_kinds(&adaptive, &[Continues, Continues, Continues, Switches]), 17.5);
        // Noise in one of several repeats of the same kind does not count.
        let adaptive = samples(&[10.0, 10.0, 10.0, 10.0, 40.0, 10.0]);
        assert_eq!(mean_over_kinds(&adaptive, &[Continues; 6]), 10.0);
    }

    #[test]
    fn numbers_follow_from_the_frames() {
        let outcome = outcome(
            &["brute@cpu1", "grid-sap@cpu1", "sap@cpu1"],
            &[
                (10, 1.0, &[1.0, 4.0, 5.0], choice(0, Reason::First)),
                (20, 3.0, &[5.0, 2.0, f64::INFINITY], choice(1, Reason::Switched)),
                (30, 9.0, &[9.0, 2.0, 5.0], choice(0, Reason::Explored)),
                (30, 2.0, &[1.5, 2.0, 5.0], choice(1, Reason::Stayed)),
            ],
        );
        assert_eq!((outcome.best_fixed(), outcome.switches()), (Some(1), vec![1]));
        assert_eq!((outcome.frames_run(0), outcome.fixed_times(2)), (2, Err(1)));
        let whole = outcome.part(0..4);
        assert_eq!((whole.over_best_fixed, whole.over_windows), (Some(1.5), 1.5));
        assert_eq!((whole.switches, whole.explored, whole.adaptive.total_ms), (1, 1, 15.0));
        assert_eq!((whole.adaptive.worst_ms, whole.adaptive.median_ms), (9.0, 2.5));
        let part = outcome.part(2..4);
        assert_eq!((part.switches, part.explored, part.over_best_fixed), (0, 1, Some(11.0 / 4.0)));
    }
}
