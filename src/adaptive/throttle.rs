//! How often to decide: in short frames not in each of them, unless their number of objects changes.

/// Share of the frames' time that decisions and their clock may take.
const SHARE: f64 = 0.01;
/// Share of a decision in the mean, and how many times the mean it counts at most.
const MEAN: f64 = 1.0 / 8.0;
const MOST_RISE: f64 = 4.0;
/// Frames between two decisions, at most.
const MOST_FRAMES: f64 = 128.0;

/// By how much such a share rises with the [`drift`] of the number of objects since the last decision.
pub(super) const SHARE_OF_DRIFT: f64 = 0.1;
/// Costs of two methods grow with powers of the number of objects that differ by no more than this: a drift can't change which is cheaper before it has
/// used up the lead.
const POWERS_APART: f64 = 2.0;
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
    /// Objects at the last decision and in the last frame, and frames since that decision.
    objects: u32,
    before: u32,
    frames: u32,
    rest: f64,
    /// What a decision takes, learning and the clock included.
    decision_ns: f64,
    frame_ns: f64,
    /// How far the number of objects may drift before it tells anything.
    slack: f64,
}

impl DecisionThrottle {
    /// Whether a frame with this many objects is to be decided on again.
    pub(super) fn is_due(&self, objects: u32) -> bool {
        let jumps = objects.abs_diff(self.before) > (self.before / JUMP).max(FEWEST);
        jumps
            || f64::from(self.frames) * (1.0 + SHARE_OF_DRIFT / SHARE * self.telling(drift(objects, self.objects)))
                >= self.rest
    }

    /// What of a drift may change which algorithm is the cheapest.
    pub(super) fn telling(&self, drift: f64) -> f64 {
        (drift - self.slack).max(0.0)
    }

    /// What a decision takes, without a sample, in nanoseconds.
    pub(super) fn decision_ns(&self) -> f64 {
        self.decision_ns
    }

    /// Counts a frame of so many objects. Returns about how long frames take now, in nanoseconds.
    pub(super) fn ran(&mut self, objects: u32) -> f64 {
        self.before = objects;
        self.frames = self.frames.saturating_add(1);
        self.frame_ns
    }

    /// Begins a decision.
    pub(super) fn decide(&mut self, objects: u32) {
        (self.objects, self.frames) = (objects, 0);
    }

    /// The next frame is to be decided on again.
    pub(super) fn wake(&mut self) {
        self.rest = 0.0;
    }

    /// What the decision took, where that is known, and its frame; and how far ahead the one that ran is, as the logarithm of a ratio of costs.
    pub(super) fn took(&mut self, decision_ns: Option<f64>, frame_ns: f64, lead_ln: f64) {
        self.slack = (lead_ln / POWERS_APART).exp_m1();
        if let Some(ns) = decision_ns {
            // The mean of late, for that is what is paid: between two frames a program needs the caches for itself, and a decision waits for memory
            // then. One that was interrupted counts for little.
            let before = if self.decision_ns > 0.0 { self.decision_ns } else { ns };
            self.decision_ns = before + MEAN * (ns.min(MOST_RISE * before) - before);
        }
        self.frame_ns = frame_ns;
        self.rest = (self.decision_ns / (SHARE * frame_ns.max(1.0))).min(MOST_FRAMES).floor();
    }
}
