//! The outcome of a replay, frame by frame, and the figures that follow from it.

use super::co_runner::Slowdown;
use super::frame::{Frame, Taken, Told};
use super::oracle::Oracle;
use sapwise::AlgorithmId;
use sapwise::stats::quantile;
use std::ops::Range;

/// Repeats below which quartiles say nothing.
const FEWEST_FOR_QUARTILES: usize = 4;

/// The outcome of a replay.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) fixed: Vec<AlgorithmId>,
    pub(crate) frames: Vec<Frame>,
    pub(crate) oracle: Oracle,
    /// One that runs an algorithm for a window of frames at least.
    pub(crate) windows: Oracle,
    /// What ran at every frame, for each repeat that all frames have; one that Ctrl-C cut short is left out.
    pub(crate) repeats: Vec<Vec<Taken>>,
    /// What the adaptive choice told of every frame of the last of these.
    pub(crate) told: Vec<Told>,
    pub(crate) interrupted: bool,
    /// Median over the frames of the share of the CPU that other programs took. `None` where that can't be told, as in a replay
    /// of milliseconds.
    pub(crate) foreign_load: Option<f64>,
    /// What the co-runner did, where there was one.
    pub(crate) slowdown: Option<Slowdown>,
    /// Fixed algorithms that could not run, or not to the end, and why.
    pub(crate) notes: Vec<String>,
}

/// The figures of some frames.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Segment {
    pub(crate) frames: Range<usize>,
    /// Time of the adaptive choice over that of the oracle, less one.
    pub(crate) regret: f64,
    /// The same against the best algorithm of every window.
    pub(crate) window_regret: f64,
    /// The regret of each repeat by itself, from single samples.
    pub(crate) of_repeats: Vec<f64>,
    /// Changes of what runs in the last repeat, frames that explore aside.
    pub(crate) switches: usize,
    /// Frames of the last repeat that explored.
    pub(crate) explored: usize,
    /// The worst frame outside exploration: its time over the oracle's, and its number.
    pub(crate) worst_frame: Option<(f64, usize)>,
}

impl Segment {
    /// The quartiles of the regret over the repeats, the median between them; `None` with too few repeats.
    pub(crate) fn quartiles(&self) -> Option<[f64; 3]> {
        let of = |q: f64| quantile(&self.of_repeats, q);
        let enough = self.of_repeats.len() >= FEWEST_FOR_QUARTILES;
        Some([of(0.25)?, of(0.5)?, of(0.75)?]).filter(|_| enough)
    }
}

/// A fixed algorithm that was not timed at some frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Missed {
    /// The first of these frames, and how many there are.
    pub(crate) first: usize,
    pub(crate) frames: usize,
    /// The total of the others.
    pub(crate) at_least_ms: f64,
}

impl Outcome {
    pub(crate) fn adaptive_ms(&self) -> f64 {
        total_ms(self.frames.iter().map(|f| f.adaptive_ns))
    }

    /// The total of an oracle that runs the best fixed algorithm of every frame and needs no time to choose it.
    pub(crate) fn oracle_ms(&self) -> f64 {
        total_ms(self.oracle.ns.iter().copied())
    }

    /// The total of a fixed algorithm; `None` when it was not timed at all frames.
    pub(crate) fn fixed_ms(&self, k: usize) -> Option<f64> {
        Some(total_ms(self.frames.iter().map(|f| f.fixed_ns[k]))).filter(|ms| ms.is_finite())
    }

    /// The frames at which a fixed algorithm was not timed, if any.
    pub(crate) fn missed(&self, k: usize) -> Option<Missed> {
        let ran = |f: &&Frame| f.fixed_ns[k].is_finite();
        let first = self.frames.iter().position(|f| !ran(&f))?;
        let frames = self.frames.iter().filter(|f| !ran(f)).count();
        Some(Missed { first, frames, at_least_ms: total_ms(self.frames.iter().filter(ran).map(|f| f.fixed_ns[k])) })
    }

    /// Position and total of the fixed algorithm with the smallest total.
    pub(crate) fn best_fixed(&self) -> Option<(usize, f64)> {
        let own = (0..self.fixed.len()).filter_map(|k| Some((k, self.fixed_ms(k)?)));
        own.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// What ran at the frames of the last repeat.
    pub(crate) fn last_taken(&self) -> &[Taken] {
        self.repeats.last().map_or(&[], Vec::as_slice)
    }

    /// In how many frames of the last repeat each fixed algorithm ran, those that explored included.
    pub(crate) fn frames_run(&self) -> Vec<usize> {
        let mut counts = vec![0; self.fixed.len()];
        self.last_taken().iter().filter_map(|t| t.chosen).for_each(|k| counts[k] += 1);
        counts
    }

    /// The frames at which the last repeat goes on with another algorithm than before, frames that explore aside.
    pub(crate) fn switches(&self) -> Vec<usize> {
        let mut settled = None;
        let mut switches = Vec::new();
        for (at, taken) in self.last_taken().iter().enumerate().filter(|(_, t)| !t.explored) {
            if settled.is_some_and(|before| before != taken.chosen) {
                switches.push(at);
            }
            settled = Some(taken.chosen);
        }
        switches
    }

    /// The figures of all frames.
    pub(crate) fn whole(&self) -> Segment {
        self.part(0..self.frames.len())
    }

    /// The figures of some frames.
    pub(crate) fn part(&self, range: Range<usize>) -> Segment {
        let frames = &self.frames[range.clone()];
        let over = |ns: f64| frames.iter().map(|f| f.adaptive_ns).sum::<f64>() / ns - 1.0;
        let oracle_ns = &self.oracle.ns[range.clone()];
        let unexplored = frames.iter().map(|f| f.unexplored_ns).zip(oracle_ns).zip(range.clone());
        let worst = unexplored.filter(|((own, _), _)| own.is_finite()).map(|((own, oracle), at)| (own / oracle, at));
        Segment {
            regret: over(oracle_ns.iter().sum()),
            window_regret: over(self.windows.ns[range.clone()].iter().sum()),
            of_repeats: (0..self.repeats.len()).filter_map(|repeat| self.regret_of(range.clone(), repeat)).collect(),
            switches: self.switches().iter().filter(|at| range.contains(at)).count(),
            explored: self.last_taken()[range.clone()].iter().filter(|t| t.explored).count(),
            worst_frame: worst.max_by(|a, b| a.0.total_cmp(&b.0)),
            frames: range,
        }
    }

    /// The regret of one repeat against an oracle that saw the other half of the repeats only.
    fn regret_of(&self, range: Range<usize>, repeat: usize) -> Option<f64> {
        let (mut own, mut oracle) = (0.0, 0.0);
        for at in range {
            let frame = &self.frames[at];
            own += frame.adaptive.at(repeat)?;
            oracle += self.oracle.in_repeat(at, frame, repeat)?;
        }
        Some(own / oracle - 1.0)
    }
}

fn total_ms(ns: impl Iterator<Item = f64>) -> f64 {
    ns.sum::<f64>() / 1e6
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::replay::samples::Samples;
    use sapwise::{Load, Reason};

    pub(crate) fn samples(ns: &[f64]) -> Samples {
        let mut samples = Samples::default();
        ns.iter().enumerate().filter(|(_, ns)| ns.is_finite()).for_each(|(repeat, &ns)| samples.push(repeat, ns));
        samples
    }

    /// A frame of which only the fixed algorithms matter.
    pub(crate) fn frame_of(objects: usize, fixed: Vec<Samples>) -> Frame {
        Frame::new(objects, Samples::default(), fixed, &[])
    }

    pub(crate) fn taken(chosen: usize) -> Taken {
        Taken { chosen: Some(chosen), explored: false }
    }

    /// An outcome of one repeat: objects, the adaptive choice's time, those of the fixed algorithms in milliseconds, and what ran.
    pub(crate) fn outcome(fixed: &[&str], frames: &[(usize, f64, &[f64], Taken)]) -> Outcome {
        let mut before = None;
        let frame = |&(objects, adaptive, fixed, taken): &(usize, f64, &[f64], Taken)| {
            let fixed = fixed.iter().map(|ms| samples(&[ms * 1e6])).collect();
            let frame = Frame::new(objects, samples(&[adaptive * 1e6]), fixed, &[(taken, before)]);
            before = Some(taken);
            frame
        };
        let told = Told {
            reason: Reason::Stayed,
            load: Load::default(),
            predicted_ns: Some(1e6),
            measured_ns: None,
            runner_up: None,
        };
        let frames_of: Vec<Frame> = frames.iter().map(frame).collect();
        Outcome {
            fixed: fixed.iter().map(|id| id.parse().unwrap()).collect(),
            oracle: Oracle::new(&frames_of),
            windows: Oracle::of_windows(&frames_of),
            frames: frames_of,
            repeats: vec![frames.iter().map(|f| f.3).collect()],
            told: vec![told; frames.len()],
            interrupted: false,
            foreign_load: None,
            slowdown: None,
            notes: Vec::new(),
        }
    }

    #[test]
    fn figures_follow_from_the_frames() {
        let explored = Taken { explored: true, ..taken(0) };
        let outcome = outcome(
            &["brute@cpu1", "grid-sap@cpu1"],
            &[
                (10, 1.0, &[1.0, 4.0], taken(0)),
                (20, 3.0, &[5.0, 2.0], taken(1)),
                (30, 9.0, &[9.0, 2.0], explored),
                (30, 2.0, &[1.5, 2.0], taken(1)),
            ],
        );
        assert_eq!((outcome.adaptive_ms(), outcome.oracle_ms()), (15.0, 6.5));
        assert_eq!((outcome.best_fixed(), outcome.switches()), (Some((1, 10.0)), vec![1]));
        assert_eq!(outcome.frames_run(), [2, 2]);
        let whole = outcome.whole();
        assert!((whole.regret - (15.0 / 6.5 - 1.0)).abs() < 1e-12);
        assert_eq!((whole.switches, whole.explored, whole.worst_frame), (1, 1, Some((1.5, 1))));
        assert_eq!((whole.of_repeats.len(), whole.quartiles()), (1, None));
        let part = outcome.part(2..4);
        assert_eq!((part.switches, part.explored), (0, 1));
        assert_eq!(part.worst_frame, Some((2.0 / 1.5, 3)));
        assert!((part.regret - (11.0 / 3.5 - 1.0)).abs() < 1e-12);
        // Where every frame explored there is none outside.
        assert_eq!(outcome.part(2..3).worst_frame, None);
    }

    #[test]
    fn one_that_was_not_timed_everywhere_has_no_total_and_counts_nowhere() {
        let inf = f64::INFINITY;
        let frames: [(usize, f64, &[f64], Taken); 3] =
            [(10, 1.0, &[1.0, 2000.0], taken(0)), (90, 1.0, &[1.0, inf], taken(0)), (10, 1.0, &[1.0, 0.5], taken(0))];
        let outcome = outcome(&["grid-sap@cpu1", "brute@cpu1"], &frames);
        assert_eq!((outcome.fixed_ms(0), outcome.fixed_ms(1)), (Some(3.0), None));
        let missed = Missed { first: 1, frames: 1, at_least_ms: 2000.5 };
        assert_eq!((outcome.missed(0), outcome.missed(1)), (None, Some(missed)));
        // The oracle may have it where it ran all the same.
        assert_eq!((outcome.oracle_ms(), outcome.best_fixed()), (2.5, Some((0, 3.0))));
    }

    #[test]
    fn each_repeat_has_a_regret_of_its_own() {
        let stays = [(taken(0), None); 4];
        let fixed = vec![samples(&[10.0, 12.0, 10.0, 14.0]), samples(&[20.0; 4])];
        let mut outcome = outcome(&["brute@cpu1", "grid-sap@cpu1"], &[(5, 1.0, &[1.0, 2.0], taken(0))]);
        outcome.frames = vec![Frame::new(5, samples(&[10.0, 18.0, 15.0, 14.0]), fixed, &stays)];
        outcome.oracle = Oracle::new(&outcome.frames);
        outcome.repeats = vec![vec![taken(0)]; 4];
        let whole = outcome.whole();
        assert_eq!(whole.of_repeats, [0.0, 0.5, 0.5, 0.0]);
        assert_eq!(whole.quartiles(), Some([0.0, 0.25, 0.5]));
    }
}
