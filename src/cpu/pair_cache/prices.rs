//! What frames cost by the clock: with kept pairs, and from scratch.

use crate::cpu::mean_time::MeanTime;

/// Frames from scratch before pairs are kept, and the first of them that counts: one builds the tree, the next may
/// refit it. The least of those that count is taken: an interrupted one would make keeping look cheap for good.
const FEWEST_FRAMES: u32 = 6;
const FIRST_COUNTED: u32 = 3;

/// Keeping stops when it has cost this many frames from scratch more than finding as many from scratch. To begin costs
/// one or two.
const MOST_LOST: f32 = 4.0;

/// One frame counts as at most this many from scratch.
const MOST_OF_FRAME: f32 = 4.0;

/// A frame that takes so many times the mean was interrupted by the system, unless another one took as long within so
/// many frames before. It counts as the mean. Counted in full, two within ten frames stopped keeping for 500.
const INTERRUPTED: f32 = 2.0;
const APART: u32 = 16;

/// After a failure, keeping must promise to cost this many times less than finding from scratch.
const WARY: f32 = 1.1;

/// If too many pairs had to be kept, that counts as this many times the cost of finding them from scratch.
const CROWDED: f32 = 2.0;

/// Frames without kept pairs over which what a failure has shown falls to an e-th.
const FORGETTING: f32 = 512.0;

/// Measured costs of a box in nanoseconds, over what the cost model says of the frame. The model's constants are those
/// of another machine, but it knows how costs change with the scene.
#[derive(Debug, Clone)]
pub(super) struct Prices {
    /// Without a clock, the model alone decides.
    timed: bool,
    /// By number of threads, and the one in use: a second thread that is slow to wake says nothing of the first.
    widths: Vec<OfWidth>,
    width: usize,
    /// Cost of keeping beyond that of frames from scratch, in such frames, since it was last below.
    lost: f32,
    /// What the model said of keeping and of finding from scratch when keeping began.
    promised: [f32; 2],
    /// Sum and number of the frames since, without the first, which builds.
    kept: [f32; 2],
    /// Frames since one took far longer than the mean one.
    calm: u32,
}

/// What frames on one number of threads have shown.
#[derive(Debug, Clone, Copy)]
struct OfWidth {
    /// Number of frames from scratch.
    frames: u32,
    /// Of the mean frame from scratch.
    scratch: MeanTime,
    /// Measured cost of keeping over the promised one when it last failed.
    over: f32,
}

impl OfWidth {
    fn failed_by(over: f32) -> Self {
        Self { frames: 0, scratch: MeanTime::default(), over }
    }
}

impl Prices {
    /// For this many numbers of threads, of which the first is in use.
    pub(super) fn new(timed: bool, widths: usize) -> Self {
        let widths = vec![OfWidth::failed_by(1.0); widths];
        Self { timed, widths, width: 0, lost: 0.0, promised: [0.0; 2], kept: [0.0; 2], calm: APART }
    }

    /// Goes on with another number of threads.
    pub(super) fn set_width(&mut self, width: usize) {
        self.width = width;
    }

    fn now(&mut self) -> &mut OfWidth {
        &mut self.widths[self.width]
    }

    /// Forgets what a box costs, and not how keeping and finding from scratch compare.
    pub(super) fn forget(&mut self) {
        self.widths.iter_mut().for_each(|w| *w = OfWidth::failed_by(w.over));
        (self.lost, self.promised, self.kept) = (0.0, [0.0; 2], [0.0; 2]);
    }

    /// Learns from a frame from scratch, of which the model says `model`.
    pub(super) fn add_scratch(&mut self, took: f32, model: f32) {
        let of = self.now();
        of.frames = of.frames.saturating_add(1);
        let cost = f64::from(took / model);
        if of.frames > FEWEST_FRAMES {
            of.scratch.add(cost);
        } else if of.frames >= FIRST_COUNTED {
            of.scratch = MeanTime::of(of.scratch.get().map_or(cost, |least| least.min(cost)));
        }
    }

    /// Begins a try of keeping if it is worth one by what the model says, and returns whether. The clock ends a try
    /// that does not pay, whose measured cost counts, less and less, for the next ones.
    pub(super) fn begins(&mut self, keeping: f32, scratch: f32) -> bool {
        let OfWidth { over, frames, .. } = *self.now();
        let begins = over * keeping < scratch && (!self.timed || frames >= FEWEST_FRAMES);
        if begins {
            // The frame that builds is not counted.
            (self.lost, self.promised, self.kept) = (0.0, [keeping, scratch], [0.0, -1.0]);
            self.calm = APART;
        }
        begins
    }

    /// Frames go by in which no pairs are kept.
    pub(super) fn fade(&mut self, frames: u64) {
        let kept = (-(frames as f32) / FORGETTING).exp();
        self.widths.iter_mut().for_each(|w| w.over = 1.0 + (w.over - 1.0) * kept);
    }

    /// On the threads in use, or on others if no frame from scratch has run on these.
    fn of_scratch(&self) -> f32 {
        let mut known = self.widths[self.width..].iter().chain(&self.widths).filter_map(|w| w.scratch.get());
        known.next().unwrap_or(1.0) as f32
    }

    /// Ends a try that did not pay, or that had too many pairs to keep. `model`: what the model says of keeping.
    pub(super) fn failed(&mut self, model: f32, too_many: bool) {
        let cost = match self.kept {
            _ if too_many => CROWDED * self.promised[1],
            [sum, frames] if frames > 0.0 => sum / frames / self.of_scratch(),
            _ => model,
        };
        self.now().over = (WARY * cost / self.promised[0]).max(1.0);
    }

    /// Learns from a frame with kept pairs, in which all may have been made again. `keeping` and `scratch`: what the
    /// model says. Returns whether to go on.
    pub(super) fn pays(&mut self, took: f32, keeping: f32, scratch: f32, rebuilt: bool) -> bool {
        if !self.timed {
            return keeping < scratch;
        }
        let scratch = scratch * self.of_scratch();
        let mut took = took.min(MOST_OF_FRAME * scratch);
        self.kept[1] += 1.0;
        if self.kept[1] > 0.0 {
            let mean = match self.kept {
                [sum, frames] if frames > 1.0 => sum / (frames - 1.0),
                _ => self.promised[0] / self.promised[1] * scratch,
            };
            let stands_out = !rebuilt && took > INTERRUPTED * mean;
            if stands_out && self.calm >= APART {
                took = mean;
            }
            self.calm = if stands_out { 0 } else { self.calm + 1 };
            self.kept[0] += took;
        }
        let over = took / scratch - 1.0;
        // NaN, of 0 over 0, counts as 0.
        self.lost = (self.lost + over).max(0.0);
        self.lost <= MOST_LOST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeping_is_tried_after_six_frames_and_stops_when_it_has_lost_four() {
        let mut prices = Prices::new(true, 1);
        for frame in 0..6 {
            assert!(!prices.begins(10.0, 40.0));
            // The tree is built, and one frame is interrupted.
            prices.add_scratch(if frame < 2 || frame == 4 { 500.0 } else { 50.0 }, 40.0);
        }
        assert!(!prices.begins(41.0, 40.0) && prices.begins(39.0, 40.0));
        // The first frame builds. Then half a frame is saved in each.
        assert!(prices.pays(150.0, 10.0, 40.0, false));
        assert!((0..1000).all(|k| prices.pays(if k % 50 == 0 { 150.0 } else { 25.0 }, 10.0, 40.0, false)));
        // An interruption is no reason to stop, a tenth more in each frame is.
        assert!(prices.pays(5000.0, 10.0, 40.0, false));
        assert!((0..20).all(|_| prices.pays(25.0, 10.0, 40.0, false)));
        let frames = (0..1000).take_while(|_| prices.pays(55.0, 10.0, 40.0, false)).count();
        assert!((30..50).contains(&frames), "{frames}");
        // In a denser scene both cost more.
        assert!(prices.begins(60.0, 80.0));
        assert!((0..1000).all(|_| prices.pays(90.0, 60.0, 80.0, false)));
    }

    #[test]
    fn interruptions_apart_are_no_reason_to_stop_and_frames_that_often_take_long_are() {
        let frames = |every: u32| {
            let mut prices = Prices::new(true, 1);
            (0..10).for_each(|_| prices.add_scratch(50.0, 40.0));
            assert!(prices.begins(30.0, 40.0) && prices.pays(200.0, 30.0, 40.0, false));
            (0..1000).take_while(|k| prices.pays(if k % every == 0 { 5000.0 } else { 40.0 }, 30.0, 40.0, false)).count()
        };
        assert_eq!([frames(1000), frames(20)], [1000; 2]);
        assert!(frames(10) < 50 && frames(2) < 10);
        // What takes long by itself counts each time.
        let mut prices = Prices::new(true, 1);
        (0..10).for_each(|_| prices.add_scratch(50.0, 40.0));
        assert!(prices.begins(30.0, 40.0) && prices.pays(200.0, 30.0, 40.0, true));
        let pays = |k: &u32| {
            let rebuilt = k.is_multiple_of(20);
            prices.pays(if rebuilt { 5000.0 } else { 45.0 }, 30.0, 40.0, rebuilt)
        };
        assert!((0..1000).take_while(pays).count() < 100);
    }

    #[test]
    fn a_failure_counts_for_the_next_promises() {
        let mut prices = Prices::new(true, 1);
        (0..10).for_each(|_| prices.add_scratch(50.0, 40.0));
        assert!(prices.begins(30.0, 40.0));
        while prices.pays(60.0, 30.0, 40.0, false) {}
        prices.failed(30.0, false);
        // Kept pairs cost 48 of these where 30 were promised.
        assert!(!prices.begins(30.0, 40.0) && !prices.begins(23.0, 40.0) && prices.clone().begins(22.0, 40.0));
        let waits = |_: &u32| {
            prices.fade(1);
            !prices.begins(30.0, 40.0)
        };
        let frames = (0..10_000).take_while(waits).count();
        assert!((300..700).contains(&frames), "{frames}");
        prices.failed(30.0, true);
        assert!(!prices.begins(19.0, 40.0));
        prices.fade(10_000);
        assert!(prices.begins(39.0, 40.0));
    }

    #[test]
    fn a_failure_on_two_threads_does_not_count_on_one() {
        let mut prices = Prices::new(true, 2);
        prices.set_width(1);
        (0..10).for_each(|_| prices.add_scratch(50.0, 40.0));
        assert!(prices.begins(30.0, 40.0));
        while prices.pays(90.0, 30.0, 40.0, false) {}
        prices.failed(30.0, false);
        assert!(!prices.begins(30.0, 40.0));
        prices.set_width(0);
        assert!(!prices.begins(30.0, 40.0), "no frame from scratch has run on one thread");
        (0..6).for_each(|_| prices.add_scratch(50.0, 40.0));
        assert!(prices.begins(30.0, 40.0));
    }

    #[test]
    fn without_a_clock_the_model_decides() {
        let mut prices = Prices::new(false, 1);
        assert!(prices.begins(39.0, 40.0) && !prices.begins(41.0, 40.0));
        assert!(prices.pays(1.0e9, 39.0, 40.0, false) && !prices.pays(0.0, 41.0, 40.0, false));
    }
}
