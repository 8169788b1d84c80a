//! What frames cost by the clock: with kept pairs, and from scratch.

use crate::cpu::mean_time::MeanTime;

/// Frames from scratch before pairs are kept: one that builds the tree, and two that may refit it.
const FEWEST_FRAMES: u32 = 3;

/// Keeping stops when it has cost this many frames from scratch more than finding as many from scratch. To begin costs
/// one or two.
const MOST_LOST: f32 = 6.0;

/// One frame counts as at most this many from scratch: an interruption by the system says nothing.
const MOST_OF_FRAME: f32 = 4.0;

/// Measured costs of a box in nanoseconds, over what the cost model says of the frame. The model's constants are those
/// of another machine, but it knows how costs change with the scene.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prices {
    /// Without a clock, the model alone decides.
    timed: bool,
    /// Number of frames from scratch.
    frames: u32,
    /// Of the mean frame from scratch.
    scratch: MeanTime,
    /// Cost of keeping beyond that of frames from scratch, in such frames, since it was last below.
    lost: f32,
}

impl Prices {
    pub(super) fn new(timed: bool) -> Self {
        Self { timed, frames: 0, scratch: MeanTime::default(), lost: 0.0 }
    }

    /// Forgets all that was learned.
    pub(super) fn forget(&mut self) {
        *self = Self::new(self.timed);
    }

    /// Learns from a frame from scratch, of which the model says `model`.
    pub(super) fn add_scratch(&mut self, took: f32, model: f32) {
        self.frames = self.frames.saturating_add(1);
        if self.frames < FEWEST_FRAMES {
            self.scratch = MeanTime::default();
        }
        self.scratch.add(f64::from(took / model));
    }

    /// Returns whether keeping is worth a try. The clock ends a try that does not pay.
    pub(super) fn promises(&self, keeping: f32, scratch: f32) -> bool {
        keeping < scratch && (!self.timed || self.frames >= FEWEST_FRAMES)
    }

    fn of_scratch(&self) -> f32 {
        self.scratch.get().unwrap_or(1.0) as f32
    }

    /// Keeping begins.
    pub(super) fn begin(&mut self) {
        self.lost = 0.0;
    }

    /// Learns from a frame with kept pairs. `keeping` and `scratch`: what the model says. Returns whether to go on.
    pub(super) fn pays(&mut self, took: f32, keeping: f32, scratch: f32) -> bool {
        if !self.timed {
            return keeping < scratch;
        }
        let over = (took / (scratch * self.of_scratch())).min(MOST_OF_FRAME) - 1.0;
        // NaN, of 0 over 0, counts as 0.
        self.lost = (self.lost + over).max(0.0);
        self.lost <= MOST_LOST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeping_is_tried_after_three_frames_and_stops_when_it_has_lost_six() {
        let mut prices = Prices::new(true);
        for _ in 0..3 {
            assert!(!prices.promises(10.0, 40.0));
            prices.add_scratch(50.0, 40.0);
        }
        assert!(prices.promises(39.0, 40.0) && !prices.promises(41.0, 40.0));
        prices.begin();
        // The first frame builds. Then half a frame is saved in each.
        assert!(prices.pays(150.0, 10.0, 40.0));
        assert!((0..1000).all(|k| prices.pays(if k % 50 == 0 { 150.0 } else { 25.0 }, 10.0, 40.0)));
        // An interruption is no reason to stop, a tenth more in each frame is.
        assert!(prices.pays(5000.0, 10.0, 40.0));
        assert!((0..10).all(|_| prices.pays(25.0, 10.0, 40.0)));
        let frames = (0..1000).take_while(|_| prices.pays(55.0, 10.0, 40.0)).count();
        assert!((50..70).contains(&frames), "{frames}");
        // In a denser scene both cost more.
        prices.begin();
        assert!((0..1000).all(|_| prices.pays(90.0, 60.0, 80.0)));
    }

    #[test]
    fn without_a_clock_the_model_decides() {
        let mut prices = Prices::new(false);
        assert!(prices.promises(39.0, 40.0) && !prices.promises(41.0, 40.0));
        assert!(prices.pays(1.0e9, 39.0, 40.0) && !prices.pays(0.0, 41.0, 40.0));
    }
}
