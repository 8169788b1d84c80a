//! When to decide: seldom in short frames, soon if the number of objects changes.

/// Share of the frames' time that decisions may take, and its rise for each unit of [`drift`] of the number of objects
/// since the last decision.
const SHARE: f64 = 0.004;
const SHARE_OF_DRIFT: f64 = 0.02;
/// Most frames between two decisions.
const MOST_FRAMES: f64 = 1024.0;
/// A decision is due at once if the number of objects jumps: by more than one part in `JUMP_PART` of the previous
/// frame's number, and by more than `JUMP_LEAST`.
const JUMP_PART: u32 = 4;
const JUMP_LEAST: u32 = 16;
/// Weight of a decision in the mean time of decisions, and the cap on its time, in multiples of that mean.
const WEIGHT: f64 = 1.0 / 8.0;
const MOST_RISE: f64 = 4.0;

/// Returns how far a number of objects is from another: the ratio of the greater to the smaller, less 1.
pub(super) fn drift(objects: u32, before: u32) -> f64 {
    let (low, high) = (objects.min(before).max(1), objects.max(before).max(1));
    f64::from(high) / f64::from(low) - 1.0
}

/// Counts the frames until the next decision.
#[derive(Debug, Clone, Default)]
pub(super) struct Pace {
    /// Objects at the last decision; objects of the last frame; frames since that decision; pairs of the last frame.
    objects: u32,
    pub(super) before: u32,
    frames: u32,
    pub(super) pairs_before: u64,
    /// Frames until the next decision if nothing changes; whether one is due at once.
    rest: f64,
    due: bool,
    /// Mean nanoseconds of a decision, and nanoseconds of a frame.
    pub(super) decision_ns: f64,
    pub(super) frame_ns: f64,
}

impl Pace {
    /// Returns whether a decision is due before a frame of `objects` objects.
    pub(super) fn is_due(&self, objects: u32) -> bool {
        let jumps = objects.abs_diff(self.before) > (self.before / JUMP_PART).max(JUMP_LEAST);
        let frames = f64::from(self.frames);
        self.due || jumps || frames * (1.0 + SHARE_OF_DRIFT / SHARE * drift(objects, self.objects)) >= self.rest
    }

    /// Returns the nanoseconds until the next decision if nothing changes.
    pub(super) fn rest_ns(&self) -> f64 {
        self.rest * self.frame_ns
    }

    /// Counts a frame.
    pub(super) fn ran(&mut self, objects: u32, pairs: u64) {
        self.frames = self.frames.saturating_add(1);
        (self.before, self.pairs_before) = (objects, pairs);
    }

    /// Records a decision for `objects` objects that took `ns`.
    pub(super) fn decided(&mut self, objects: u32, ns: f64) {
        (self.objects, self.frames, self.due) = (objects, 0, false);
        // A decision that was interrupted counts for little.
        let before = if self.decision_ns > 0.0 { self.decision_ns } else { ns };
        self.decision_ns = before + WEIGHT * (ns.min(MOST_RISE * before) - before);
    }

    /// Sets the frames until the next decision, within limits, after a frame of `frame_ns`.
    pub(super) fn set_rest(&mut self, frame_ns: f64, (least, most): (f64, f64)) {
        self.frame_ns = frame_ns;
        let frames = (self.decision_ns / (SHARE * frame_ns.max(1.0))).min(MOST_FRAMES).floor();
        self.rest = frames.min(most).max(least);
    }

    /// Makes a decision due before the next frame.
    pub(super) fn wake(&mut self) {
        self.due = true;
    }
}
