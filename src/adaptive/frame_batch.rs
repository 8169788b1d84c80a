//! Frames of one algorithm, added up until they tell its cost.
//!
//! An incremental algorithm runs cheap frames for a while and then an expensive one, in which it rebuilds. What
//! counts is their mean, so that frames are added up before they are compared with what was expected.

use crate::tuning::belief::View;

/// Frames that are added up where an algorithm runs on, and right after it began.
const MOST: u32 = 32;
const FEWEST: u32 = 2;
/// What counts of a frame, at most: this many times what the dearest kind of frame is expected to cost. The rest is
/// another program's.
pub(super) const MOST_OVER: f64 = 2.0;

/// What the tuning says of a frame, without any correction, in nanoseconds: all of it, and the calls in it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Predicted {
    pub(super) ns: f64,
    pub(super) calls_ns: f64,
}

impl Predicted {
    /// Of a frame of so many times the usual work.
    pub(super) fn times(self, work: f64) -> Self {
        Self { ns: work * self.ns, calls_ns: work * self.calls_ns }
    }

    /// Share of the calls.
    pub(super) fn calls(self) -> f64 {
        share(self.calls_ns, self.ns)
    }
}

/// Nothing of nothing is nothing.
fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

/// The sum over some frames in a row.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FrameBatch {
    pub(super) candidate: usize,
    pub(super) frames: u32,
    /// Real time, and time that the tuning predict without any correction, in nanoseconds.
    pub(super) real_ns: f64,
    pub(super) predicted_ns: f64,
    calls_ns: f64,
    view: View,
    /// Frames until it is full.
    room: u32,
}

impl FrameBatch {
    /// The mean load, as what is learned sees it: each frame counts by what is predicted of it, as it does in the
    /// ratio of the sums.
    pub(super) fn view(&self) -> View {
        let mut mean = View::default();
        mean.add(&self.view, share(1.0, self.predicted_ns));
        mean
    }

    /// Share of calls in the predicted time.
    pub(super) fn calls(&self) -> f64 {
        share(self.calls_ns, self.predicted_ns)
    }

    /// Whether a frame belongs to it.
    pub(super) fn takes(&self, candidate: usize) -> bool {
        self.room > 0 && self.candidate == candidate
    }

    pub(super) fn is_full(&self) -> bool {
        self.frames > 0 && self.frames >= self.room
    }

    /// Adds some frames of one load, that took so long together.
    pub(super) fn add(&mut self, frames: u32, ns: f64, predicted: Predicted, view: &View) {
        self.frames += frames;
        self.calls_ns += predicted.calls_ns;
        self.real_ns += ns;
        self.predicted_ns += predicted.ns;
        self.view.add(view, predicted.ns);
    }

    /// An empty one. Where the candidate is the one of before, it has more room than that.
    pub(super) fn next(&self, candidate: usize) -> Self {
        let room = if self.frames > 0 && candidate == self.candidate { (2 * self.room).min(MOST) } else { FEWEST };
        Self { candidate, room, ..Self::default() }
    }
}
