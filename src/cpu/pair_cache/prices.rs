//! Measured costs of frames with kept pairs and of frames from scratch.

use super::width::Width;
use crate::cpu::mean_time::MeanTime;
use crate::load::is_same_pace;

/// Frames from scratch before pairs are kept, and the first of them that counts: the first builds the tree, the second
/// may refit it. The fastest that counts is taken: an interrupted one would make keeping look cheap for good.
const FEWEST_FRAMES: u32 = 6;
const FIRST_COUNTED: u32 = 3;

/// Keeping stops once it has lost the time of this many frames from scratch.
const MOST_LOST: f32 = 4.0;

/// Most frames from scratch that the first frame with kept pairs counts as: it also pays for memory.
const MOST_OF_FIRST: f32 = 3.0;

/// Most multiples of its expected time that a frame counts as: longer ones were interrupted.
const MOST_RISE: f32 = 2.0;

/// After a failure, keeping must promise to be this many times as fast as finding from scratch.
const WARY: f32 = 1.1;

/// Cost of a try with too many pairs, in frames from scratch.
const CROWDED: f32 = 2.0;

/// Fewest frames by which a failed try is judged; missing ones count as promised. One jump of the scene would
/// otherwise prevent the next try for a thousand frames.
const FEWEST_TRIED: f32 = 4.0;

/// Frames without kept pairs over which the memory of a failure falls to an e-th.
const FORGETTING: f32 = 512.0;

/// Measured costs of a box in nanoseconds over the cost model's. The constants of the model are those of another
/// machine, but it shows how costs change with the scene.
#[derive(Debug, Clone)]
pub(super) struct Prices {
    /// False without a fine clock: a frame then takes what the model says.
    timed: bool,
    /// Number of frames from scratch, and their mean cost.
    frames: u32,
    of_scratch: MeanTime,
    /// Mean cost with kept pairs over that, and whether both were measured with the same number of boxes.
    keeping: MeanTime,
    is_beside: bool,
    /// Threads with kept pairs, and from scratch.
    pub(super) keepers: Width,
    pub(super) searchers: Width,
    /// Time lost against frames from scratch, in such frames, since keeping was last ahead.
    lost: f32,
    /// The model's costs with kept pairs and from scratch when keeping began.
    promised: [f32; 2],
    /// Sum and number of the model's costs in the frames since, without the first, which builds.
    kept: [f32; 2],
    failure: Failure,
}

/// The last failure.
#[derive(Debug, Clone, Copy)]
struct Failure {
    /// The work of keeping over the promised one.
    over: f32,
    /// Speed of the boxes after it, in edges a frame, once known; infinite if other algorithms ran then. Keeping
    /// slower boxes is cheaper.
    pace: Option<f32>,
}

impl Prices {
    pub(super) fn new(timed: bool) -> Self {
        Self {
            timed,
            frames: 0,
            of_scratch: MeanTime::default(),
            keeping: MeanTime::default(),
            is_beside: false,
            keepers: Width::new(0),
            searchers: Width::new(0),
            lost: 0.0,
            promised: [0.0; 2],
            kept: [0.0; 2],
            failure: Failure { over: 1.0, pace: None },
        }
    }

    /// Forgets the costs of a box, and half the logarithms of their ratio and of the last failure: with a tenth of the
    /// boxes, keeping may take twice as long beside finding from scratch. In `uniform` that swings between 50 and 3000
    /// boxes, frames take 0.74 to 0.82 × the time with all of it remembered. `widths`: initial positions of the thread
    /// counts with kept pairs and from scratch.
    pub(super) fn forget(&mut self, widths: [usize; 2]) {
        (self.frames, self.of_scratch, self.is_beside) = (0, MeanTime::default(), false);
        self.keepers.restart(widths[0]);
        self.searchers.restart(widths[1]);
        self.change_keeping(f64::sqrt);
        self.failure.over = self.failure.over.sqrt();
    }

    /// Learns from a frame from scratch that costs `model` by the model.
    pub(super) fn add_scratch(&mut self, took: Option<f32>, model: f32) {
        self.frames = self.frames.saturating_add(1);
        let counts = self.frames >= FIRST_COUNTED;
        let Some(cost) = took.filter(|_| self.timed && counts).map(|took| took / model) else { return };
        if !self.searchers.ran(cost) {
            return;
        }
        let cost = f64::from(cost);
        let before = self.of_scratch.0.unwrap_or(cost);
        if self.frames <= FEWEST_FRAMES {
            self.of_scratch.0 = Some(before.min(cost));
            return;
        }
        self.of_scratch.add(cost);
        // The first frames after a build looked too cheap; that changes nothing about frames with kept pairs.
        if self.is_beside {
            let over = before / self.of_scratch.0.unwrap_or(cost);
            self.change_keeping(|keeping| keeping * over);
        }
    }

    fn change_keeping(&mut self, change: impl Fn(f64) -> f64) {
        self.keeping.0 = self.keeping.0.map(change);
    }

    /// Returns the measured cost with kept pairs over that from scratch; 1 if unknown.
    fn measured(&self) -> f64 {
        self.keeping.0.unwrap_or(1.0)
    }

    /// Returns whether keeping boxes of this speed is worth a try, by the model's costs. The clock ends a try that
    /// does not pay; the memory of it fades.
    pub(super) fn promise(&mut self, pace: f32, keeping: f32, scratch: f32) -> bool {
        let failed_at = f64::from(*self.failure.pace.get_or_insert(pace));
        let is_slower = f64::from(pace) < failed_at && !is_same_pace(pace.into(), failed_at);
        let over = if is_slower { self.failure.over.min(WARY) } else { self.failure.over };
        let measured = self.measured() as f32;
        over * measured * keeping < scratch && (!self.timed || self.frames >= FEWEST_FRAMES)
    }

    /// Begins a try with these costs by the model.
    pub(super) fn begin(&mut self, keeping: f32, scratch: f32) {
        // The frame that builds is not counted.
        (self.lost, self.promised, self.kept) = (0.0, [keeping, scratch], [0.0, -1.0]);
        self.keepers.resume();
    }

    /// Lets the memory of the last failure fade over frames without kept pairs.
    pub(super) fn fade(&mut self, frames: u64) {
        let kept = (-(frames as f64) / f64::from(FORGETTING)).exp();
        let faded = |over: f64| 1.0 + (over - 1.0) * kept;
        self.failure.pace.get_or_insert(f32::INFINITY);
        self.failure.over = faded(self.failure.over.into()) as f32;
        self.change_keeping(faded);
    }

    /// Ends a try that did not pay, or had too many pairs to keep at any speed.
    pub(super) fn failed(&mut self, too_many: bool) {
        let (work, pace) = match self.kept {
            _ if too_many => (CROWDED * self.promised[1], Some(0.0)),
            [sum, frames] => {
                let counted = frames.max(0.0);
                let judged = counted.max(FEWEST_TRIED);
                ((sum + (judged - counted) * self.promised[0]) / judged, None)
            }
        };
        self.searchers.resume();
        if too_many {
            // Fewer lists may hold more pairs each.
            self.keepers = Width::new(0);
        }
        self.failure = Failure { over: (WARY * work / self.promised[0]).max(WARY), pace };
    }

    /// Learns from a frame with kept pairs. `work`, `scratch`: its cost by the model, and that of one from scratch.
    /// Returns whether to go on.
    pub(super) fn pays(&mut self, took: Option<f32>, work: f32, scratch: f32) -> bool {
        let took = took.filter(|_| self.timed);
        self.kept[1] += 1.0;
        let is_first = self.kept[1] <= 0.0;
        if !is_first {
            self.kept[0] += work;
            if took.is_some_and(|took| !self.keepers.ran(took / work)) {
                return true;
            }
        }
        let of_scratch = self.of_scratch.0.unwrap_or(1.0) as f32;
        let (expected, scratch) = (work * of_scratch, scratch * of_scratch);
        let took = took.unwrap_or(expected);
        let mut most = MOST_OF_FIRST * scratch;
        if !is_first {
            most = MOST_RISE * expected * self.measured() as f32;
            (self.keeping.0, self.is_beside) = (Some(self.measured()), true);
            self.keeping.add(f64::from(took / expected));
        }
        // NaN, of 0 over 0, counts as 0.
        self.lost = (self.lost + took.min(most) / scratch - 1.0).max(0.0);
        self.lost <= MOST_LOST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn begins(prices: &mut Prices, pace: f32, keeping: f32, scratch: f32) -> bool {
        let begins = prices.promise(pace, keeping, scratch);
        if begins {
            prices.begin(keeping, scratch);
        }
        begins
    }

    /// Returns prices after frames from scratch that took 50 ns a box (40 by the model) and the beginning of a try
    /// that promises 30. Boxes move by a tenth of an edge.
    fn keeping() -> Prices {
        let mut prices = Prices::new(true);
        (0..10).for_each(|_| prices.add_scratch(Some(50.0), 40.0));
        assert!(begins(&mut prices, 0.1, 30.0, 40.0) && prices.pays(Some(200.0), 90.0, 40.0));
        prices
    }

    #[test]
    fn keeping_is_tried_after_six_frames_and_stops_when_it_has_lost_four() {
        let mut prices = Prices::new(true);
        for frame in 0..6 {
            assert!(!begins(&mut prices, 0.1, 10.0, 40.0));
            // The tree is built, and one frame is interrupted.
            prices.add_scratch(Some(if frame < 3 || frame == 4 { 500.0 } else { 50.0 }), 40.0);
        }
        assert!(!begins(&mut prices, 0.1, 41.0, 40.0) && begins(&mut prices, 0.1, 39.0, 40.0));
        // The first frame builds. Then half a frame is saved in each.
        assert!(prices.pays(Some(1500.0), 90.0, 40.0));
        assert!((0..1000).all(|k| prices.pays(Some(if k % 50 == 0 { 150.0 } else { 25.0 }), 10.0, 40.0)));
        // A tenth more in each frame is a reason to stop.
        let frames = (0..1000).take_while(|_| prices.pays(Some(55.0), 10.0, 40.0)).count();
        assert!((30..50).contains(&frames), "{frames}");
        // In a denser scene both cost more.
        assert!(begins(&mut prices, 0.01, 15.0, 80.0));
        assert!((0..1000).all(|_| prices.pays(Some(90.0), 15.0, 80.0)));
    }

    #[test]
    fn interruptions_are_no_reason_to_stop_and_frames_that_have_much_to_do_are() {
        let frames = |every: u32, work: f32| {
            let mut prices = keeping();
            let pays = |k: &u32| {
                let (took, work) = if k.is_multiple_of(every) { (5000.0, work) } else { (40.0, 30.0) };
                prices.pays(Some(took), work, 40.0)
            };
            (0..1000).take_while(pays).count()
        };
        assert_eq!([1000, 20, 10].map(|every| frames(every, 30.0)), [1000; 3]);
        assert!(frames(2, 30.0) < 20);
        assert!(frames(1000, 4000.0) < 10 && frames(20, 1000.0) < 100);
    }

    /// Returns the largest integer promise for which keeping would begin.
    fn begins_at(prices: &Prices, pace: f32) -> i32 {
        (0..40).rev().find(|&keeping| begins(&mut prices.clone(), pace, keeping as f32, 40.0)).unwrap()
    }

    #[test]
    fn slow_frames_count_for_the_next_promises() {
        let mut prices = keeping();
        while prices.pays(Some(52.0), 30.0, 40.0) {}
        prices.failed(false);
        // Frames took 1.39 times what their work promised.
        assert_eq!([0.1, 0.01].map(|pace| begins_at(&prices, pace)), [26; 2]);
        let waits = |_: &u32| {
            prices.fade(1);
            !begins(&mut prices, 0.1, 30.0, 40.0)
        };
        let frames = (0..10_000).take_while(waits).count();
        assert!((150..500).contains(&frames), "{frames}");
    }

    #[test]
    fn more_work_than_promised_counts_unless_boxes_move_more_slowly() {
        let mut prices = keeping();
        while prices.pays(Some(75.0), 60.0, 40.0) {}
        prices.failed(false);
        // Kept pairs were twice the promised work, at this pace.
        assert!(!begins(&mut prices, 0.1, 30.0, 40.0));
        assert_eq!([0.1, 0.2, 0.09, 0.01].map(|pace| begins_at(&prices, pace)), [18, 18, 18, 36]);
        prices.failed(true);
        assert_eq!([0.1, 0.01].map(|pace| begins_at(&prices, pace)), [13; 2]);
        // Other algorithms ran in the frames after it: at which pace it failed is unknown.
        prices.failed(false);
        prices.fade(1);
        assert_eq!([0.1, 0.01].map(|pace| begins_at(&prices, pace)), [36; 2]);
        prices.fade(10_000);
        assert_eq!(begins_at(&prices, 0.1), 39);
    }

    #[test]
    fn one_jump_of_the_scene_does_not_prevent_the_next_try() {
        let mut prices = keeping();
        prices.pays(Some(900.0), 600.0, 40.0);
        prices.failed(false);
        // Of four frames one did twenty times the promised work.
        assert_eq!(begins_at(&prices, 0.1), 6);
        prices.forget([0; 2]);
        (0..10).for_each(|_| prices.add_scratch(Some(50.0), 40.0));
        assert!(begins_at(&prices, 0.1) > 11);
    }

    #[test]
    fn a_failure_by_too_low_a_cost_from_scratch_is_soon_made_good() {
        let mut prices = keeping();
        // Soon after the build, frames from scratch took 50 ns a box. Those with kept pairs take 56, and promised 40.
        while prices.pays(Some(56.0), 32.0, 40.0) {}
        prices.failed(false);
        assert!(!begins(&mut prices, 0.1, 32.0, 40.0));
        let frames = (0..100).take_while(|_| {
            prices.add_scratch(Some(90.0), 40.0);
            !begins(&mut prices, 0.1, 32.0, 40.0)
        });
        assert!((1..12).contains(&frames.count()));
    }

    #[test]
    fn number_of_boxes_that_changes_often_does_not_make_keeping_look_cheap() {
        let mut prices = keeping();
        (0..100).for_each(|_| assert!(prices.pays(Some(40.0), 30.0, 40.0)));
        let mut before = prices.measured();
        for _ in 0..20 {
            prices.forget([0; 2]);
            // The first frames after a build are cheap.
            (0..20).for_each(|k| prices.add_scratch(Some(if k < 6 { 50.0 } else { 60.0 }), 40.0));
            before = before.sqrt();
        }
        assert_eq!(prices.measured(), before);
    }

    #[test]
    fn threads_that_are_slow_to_wake_are_no_reason_to_stop() {
        let mut prices = keeping();
        let mut tried = 0;
        for frame in 0..5000 {
            let width = prices.keepers.next(1);
            tried += width;
            assert!(prices.pays(Some([30.0, 400.0][width]), 30.0, 40.0), "frame {frame}");
        }
        assert!((1..40).contains(&tried), "{tried} frames");
    }

    #[test]
    fn without_a_clock_the_model_decides() {
        let mut prices = Prices::new(false);
        assert!(begins(&mut prices, 0.1, 39.0, 40.0) && !begins(&mut prices, 0.1, 41.0, 40.0));
        assert!((0..100).all(|_| prices.pays(Some(1.0e9), 39.0, 40.0)));
        assert!(!(0..100).all(|_| prices.pays(Some(0.0), 43.0, 40.0)));
    }
}
