//! How often to decide: in short frames not in each of them, unless their number of objects changes.

/// Share of the frames' time that decisions and their clock may take.
const SHARE: f64 = 0.004;
/// Share of a decision in the mean, and how many times the mean it counts at most.
const MEAN: f64 = 1.0 / 8.0;
const MOST_RISE: f64 = 4.0;
/// Frames between two decisions, at most. A frame that stands out, frames that are off and numbers that jump call for one all the same.
const MOST_FRAMES: f64 = 1024.0;

/// By how much such a share rises with the [`drift`] of the number of objects since the last decision.
pub(super) const SHARE_OF_DRIFT: f64 = 0.02;
/// Costs of two methods grow with powers of the number of objects that differ by no more than this: a drift can't change which is cheaper before it has
/// used up the lead.
const POWERS_APART: f64 = 2.0;
/// A number that differs from that of the frame before by a quarter, and by so many, is decided on at once.
const JUMP: u32 = 4;
const FEWEST: u32 = 16;
/// Pairs of the frame before that differ from those at the last decision by half, and by so many, are decided on at once. Of what lies between no change and
/// the square of that of the objects, as in a world that fills up, the drift of the objects tells already.
const PAIRS_JUMP: f64 = 0.5;
const FEWEST_PAIRS: f64 = 64.0;

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
    /// Pairs of the frame that was decided on, once that is known, and of the last frame.
    pairs: Option<u64>,
    pairs_before: u64,
    /// Frames that need no decision where nothing changes, and whether the next one needs one for another reason.
    rest: f64,
    due: bool,
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
        self.due
            || jumps
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
        let decided = *self.pairs.get_or_insert(pairs);
        if pairs != decided && self.pairs_jump(objects, pairs as f64, decided as f64) {
            self.wake();
        }
    }

    /// Whether so many pairs of so many objects are others than those at the last decision, beyond what the number of objects tells.
    fn pairs_jump(&self, objects: u32, pairs: f64, decided: f64) -> bool {
        let filled = decided * (f64::from(objects.max(1)) / f64::from(self.objects.max(1))).powi(2);
        let off = (decided.min(filled) - pairs).max(pairs - decided.max(filled));
        off > (PAIRS_JUMP * decided.min(filled)).max(FEWEST_PAIRS)
    }

    /// Begins a decision.
    pub(super) fn decide(&mut self, objects: u32) {
        (self.objects, self.frames, self.pairs, self.due) = (objects, 0, None, false);
    }

    /// The next frame is to be decided on again.
    pub(super) fn wake(&mut self) {
        self.due = true;
    }

    /// The next decision is that many frames away at most.
    pub(super) fn rest_no_longer_than(&mut self, frames: f64) {
        self.rest = self.rest.min(frames);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_that_the_number_of_objects_explains_call_for_no_decision() {
        let is_due = |objects: u32, pairs: u64| {
            let mut throttle = DecisionThrottle::default();
            throttle.decide(1000);
            throttle.took(Some(1e4), 1e5, f64::INFINITY);
            throttle.ran(1000, 1000);
            throttle.ran(objects, pairs);
            throttle.is_due(objects)
        };
        // A scene that crowds, or thins out.
        assert!(!is_due(1000, 1400) && is_due(1000, 1600) && !is_due(1000, 600) && is_due(1000, 400));
        // One that grows has as many pairs each, or fills up.
        assert!(!is_due(1200, 1200) && !is_due(1200, 1440) && !is_due(1200, 1900) && is_due(1200, 2000));
        assert!(!is_due(800, 400) && is_due(800, 300) && is_due(800, 1400) && is_due(600, 0));
    }
}
