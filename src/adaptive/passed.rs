//! Frames between two decisions: what they tell is added up, and taken in by the next decision.
//!
//! What is believed of costs lies in no cache when a frame of a program begins. A frame that only adds to a few sums
//! leaves it there.

use crate::broad_phase::{FrameKind, FrameWork};

/// Two looks at a clock, in nanoseconds, in code that lies in no cache, and the share of the frames' time that they
/// may take.
const CLOCK_NS: f64 = 100.0;
const SHARE: f64 = 0.0025;
/// One frame in so many is timed at least.
const MOST_APART: f64 = 32.0;

/// After so many timed frames, and this share of the time until the next decision, they call for one where their mean
/// is off by this factor.
const ENOUGH: u32 = 8;
const EARLIEST: f64 = 0.25;
const OFF: f64 = 1.2;

/// What is expected of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Usual {
    /// What a frame of the mean work takes, in nanoseconds.
    pub(super) mean_ns: f64,
    /// A frame that takes longer tells more than its time: it waited, or something changed.
    pub(super) most_ns: f64,
    /// What they may cost, where they are of a trial.
    pub(super) trial: Option<Budget>,
}

/// What the frames of a trial may cost beside what frames cost otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Budget {
    /// What a frame of the mean work takes otherwise, and what is left, in nanoseconds.
    pub(super) now_ns: f64,
    pub(super) left_ns: f64,
    /// It goes on with what the one that is settled on keeps: what is made again in a frame would have been made
    /// again by either.
    pub(super) shares: bool,
}

/// The frames since the last decision.
#[derive(Debug, Clone, Default)]
pub(super) struct Passed {
    pub(super) frames: u32,
    /// How the last one came about, and in how many all was made again.
    pub(super) work: Option<FrameWork>,
    pub(super) rebuilt: u32,
    /// Of those that were timed: their number, time in nanoseconds, and work in frames of the mean one.
    pub(super) timed: u32,
    pub(super) ns: f64,
    pub(super) over_mean: f64,
    usual: Usual,
    /// One frame in so many is timed.
    apart: u32,
}

impl Passed {
    /// Of frames of which so much is expected; none has passed yet.
    pub(super) fn expecting(usual: Usual) -> Self {
        // A trial is made for what its frames tell.
        let most_apart = if usual.trial.is_some() { 1.0 } else { MOST_APART };
        let apart = (CLOCK_NS / (SHARE * usual.mean_ns)).clamp(1.0, most_apart) as u32;
        Self { usual, apart, ..Self::default() }
    }

    /// Whether the next frame is to be timed.
    pub(super) fn is_timed(&self) -> bool {
        self.frames.is_multiple_of(self.apart.max(1))
    }

    /// Whether a frame that took so long tells no more than that.
    pub(super) fn is_usual(&self, ns: f64) -> bool {
        ns <= self.usual.most_ns
    }

    /// Adds a frame.
    pub(super) fn add(&mut self, work: Option<FrameWork>, ns: Option<f64>) {
        self.frames += 1;
        self.work = work;
        self.rebuilt += u32::from(work.is_some_and(|work| work.kind == FrameKind::Rebuilt));
        if let Some(ns) = ns {
            self.timed += 1;
            self.ns += ns;
            self.over_mean += work.map_or(1.0, |work| work.over_mean);
        }
    }

    /// Whether they have cost more than a trial may. Looked at here after each frame: decisions every few frames
    /// would cost more than the trial.
    pub(super) fn is_over_budget(&self) -> bool {
        let Some(Budget { now_ns, left_ns, shares }) = self.usual.trial else { return false };
        let work = if shares { self.over_mean } else { f64::from(self.timed) };
        self.ns - work * now_ns > left_ns
    }

    /// Whether the times differ so much from what was expected that the decision may have to be another, where the
    /// next one was to be so many nanoseconds away. In time, for that is what is lost: frames that are ten times as
    /// long as expected are looked at ten times as soon.
    pub(super) fn is_off(&self, rest_ns: f64) -> bool {
        let passed_ns = self.mean_ns().unwrap_or_default() * f64::from(self.frames);
        if self.timed < ENOUGH || passed_ns < EARLIEST * rest_ns {
            return false;
        }
        let expected_ns = self.usual.mean_ns * self.over_mean;
        self.ns > OFF * expected_ns || expected_ns > OFF * self.ns
    }

    /// Mean time of those that were timed, in nanoseconds, if any was.
    pub(super) fn mean_ns(&self) -> Option<f64> {
        (self.timed > 0).then(|| self.ns / f64::from(self.timed))
    }
}
