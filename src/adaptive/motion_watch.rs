//! How far boxes move in a frame: looked at now and then.
//!
//! Where boxes speed up, what an incremental algorithm was predicted to cost changes by factors within a few dozen
//! frames, and a prediction for the pace of before would be taken for a machine that is slower.

use crate::aabb::Aabb;
use crate::clock::Instant;
#[cfg(test)]
use crate::clock::counted;
use crate::load::{Displacement, Motion, is_same_pace};

/// Share of the frames' time for looking how far boxes move.
const SHARE: f64 = 0.002;

/// A look that the system interrupts seems dear. No look counts as more than so many times the one before.
const COST_RISES: f64 = 2.0;

/// Finds out how far boxes move, where that pays.
#[derive(Debug, Clone, Default)]
pub(super) struct MotionWatch {
    displacement: Displacement,
    state: State,
    /// How far the boxes moved when that was last found out.
    motion: Option<Motion>,
    /// What a look takes, and the time of the frames since the last one, in nanoseconds.
    look_ns: f64,
    passed_ns: f64,
}

/// How far boxes move shows in two frames in a row and in no others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum State {
    #[default]
    Resting,
    /// The boxes of this frame are to be remembered once its pairs are found.
    Due,
    /// Those of the next frame are to be compared with them.
    Watching,
}

impl MotionWatch {
    /// How far the boxes move in a frame, where that was found out.
    pub(super) fn motion(&self) -> Option<Motion> {
        self.motion
    }

    /// Compares the boxes of a frame with those of the frame before, which are [remembered](Self::ran). Whether they
    /// move at another pace than when this was looked at last.
    pub(super) fn look(&mut self, boxes: &[Aabb]) -> bool {
        let started = Instant::now();
        let motion = self.displacement.motion(boxes);
        #[cfg(test)]
        counted::spend(counted::LOOK_NS);
        // To remember the boxes takes about as long as to compare them.
        self.found(motion, 2.0 * started.elapsed().as_nanos() as f64)
    }

    /// Takes in what a look has found, and how long it took. Whether that is another pace.
    fn found(&mut self, motion: Option<Motion>, took_ns: f64) -> bool {
        let as_before = self.motion.zip(motion).is_some_and(|(before, now)| is_same_pace(before.moved, now.moved));
        self.look_ns = if self.look_ns > 0.0 { took_ns.min(self.look_ns * COST_RISES) } else { took_ns };
        (self.motion, self.passed_ns, self.state) = (motion, 0.0, State::Resting);
        !as_before
    }

    /// Frames have passed that took so long.
    pub(super) fn passed(&mut self, ns: f64) {
        self.passed_ns += ns;
    }

    /// The frame that runs now is to be remembered, unless it is already.
    pub(super) fn want(&mut self) {
        if self.state == State::Resting {
            self.state = State::Due;
        }
    }

    /// Remembers the boxes of a frame that was decided on and has run, where that is due or pays. Whether the next
    /// frame is to be [looked at](Self::look) for that.
    pub(super) fn ran(&mut self, boxes: &[Aabb]) -> bool {
        // Not when it is decided: a frame may be decided on twice before it runs, and the boxes have not moved in
        // between.
        let due = self.state == State::Due || self.pays();
        if due {
            self.watch(boxes);
        }
        due
    }

    fn pays(&self) -> bool {
        self.state == State::Resting && self.look_ns > 0.0 && self.passed_ns * SHARE >= self.look_ns
    }

    /// Remembers these boxes: the next frame is to show how far they move.
    fn watch(&mut self, boxes: &[Aabb]) {
        self.displacement.watch(boxes);
        self.state = State::Watching;
    }

    /// After a frame that failed nothing is known of the one before.
    pub(super) fn failed(&mut self) {
        (self.motion, self.state) = (None, State::Resting);
    }
}
