//! How often to decide: in short frames not in each of them, unless their number of objects changes.

/// Share of the frames' time that decisions and their clock may take, but for those for which a switch waits to be
/// paid.
const SHARE: f64 = 0.004;
/// Share of a decision in the mean, and how many times the mean it counts at most.
const MEAN: f64 = 1.0 / 8.0;
const MOST_RISE: f64 = 4.0;
/// Frames between two decisions, at most. A frame that stands out, frames that are off and numbers that jump call for
/// one all the same.
const MOST_FRAMES: f64 = 1024.0;

/// By how much such a share rises with the [`drift`] of the number of objects since the last decision.
pub(super) const SHARE_OF_DRIFT: f64 = 0.02;
/// A number that differs from that of the frame before by a quarter, and by so many, is decided on at once.
const JUMP: u32 = 4;
const FEWEST: u32 = 16;

/// How far a number of objects is from another: the ratio of the greater to the less, less one.
pub(super) fn drift(objects: u32, before: u32) -> f64 {
    let (low, high) = (objects.min(before).max(1), objects.max(before).max(1));
    f64::from(high) / f64::from(low) - 1.0
}

/// Counts the frames until the next decision.
#[derive(Debug, Clone, Default)]
pub(super) struct DecisionThrottle {
    /// Objects at the last decision, objects and pairs in the last frame, and frames since that decision.
    objects: u32,
    before: u32,
    frames: u32,
    pairs_before: u64,
    /// Frames that need no decision where nothing changes, and whether the next one needs one for another reason.
    rest: f64,
    due: bool,
    /// What a decision takes, learning and the clock included.
    decision_ns: f64,
    frame_ns: f64,
}

impl DecisionThrottle {
    /// Whether a frame with this many objects is to be decided on again.
    pub(super) fn is_due(&self, objects: u32) -> bool {
        let jumps = objects.abs_diff(self.before) > (self.before / JUMP).max(FEWEST);
        self.due
            || jumps
            || f64::from(self.frames) * (1.0 + SHARE_OF_DRIFT / SHARE * drift(objects, self.objects)) >= self.rest
    }

    /// What a decision takes, without a sample, in nanoseconds.
    pub(super) fn decision_ns(&self) -> f64 {
        self.decision_ns
    }

    /// About how long frames take now, in nanoseconds.
    pub(super) fn frame_ns(&self) -> f64 {
        self.frame_ns
    }

    /// About how long frames take that need no decision where nothing changes, in nanoseconds.
    pub(super) fn rest_ns(&self) -> f64 {
        self.rest * self.frame_ns
    }

    /// Objects and pairs of the last frame.
    pub(super) fn before(&self) -> (u32, u64) {
        (self.before, self.pairs_before)
    }

    /// Counts a frame of so many objects and pairs.
    pub(super) fn ran(&mut self, objects: u32, pairs: u64) {
        self.frames = self.frames.saturating_add(1);
        (self.before, self.pairs_before) = (objects, pairs);
    }

    /// Begins a decision.
    pub(super) fn decide(&mut self, objects: u32) {
        (self.objects, self.frames, self.due) = (objects, 0, false);
    }

    /// The next frame is to be decided on again.
    pub(super) fn wake(&mut self) {
        self.due = true;
    }

    /// The next decision is that many frames away at most.
    pub(super) fn rest_no_longer_than(&mut self, frames: f64) {
        self.rest = self.rest.min(frames);
    }

    /// What the decision took, where that is known, and its frame.
    pub(super) fn took(&mut self, decision_ns: Option<f64>, frame_ns: f64) {
        if let Some(ns) = decision_ns {
            // The mean of late, for that is what is paid: between two frames a program needs the caches for itself,
            // and a decision waits for memory then. One that was interrupted counts for little.
            let before = if self.decision_ns > 0.0 { self.decision_ns } else { ns };
            self.decision_ns = before + MEAN * (ns.min(MOST_RISE * before) - before);
        }
        self.frame_ns = frame_ns;
        self.rest = (self.decision_ns / (SHARE * frame_ns.max(1.0))).min(MOST_FRAMES).floor();
    }
}
