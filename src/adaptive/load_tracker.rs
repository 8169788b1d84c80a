//! The load of the next frame: from a sample now and then, from the frame before in between; and when to decide by it.

use super::motion_watch::MotionWatch;
use super::passed::Passed;
use super::throttle::{DecisionThrottle, SHARE_OF_DRIFT, drift};
use crate::aabb::Aabb;
use crate::clock::Instant;
#[cfg(test)]
use crate::clock::counted;
use crate::load::{FramePlan, Load};

/// Share of the frames' time that samples may take where the number of objects holds still. With [`SHARE_OF_DRIFT`] a
/// scene that doubles is sampled when 45 times the sample's cost has passed, one that grows by a sixteenth after 310
/// times.
const SHARE: f64 = 0.002;

/// A sample that the system interrupts looks dear. Taken at its word it would put off the next one for seconds of
/// frames, over which a change of the scene goes unseen.
const COST_RISES: f64 = 2.0;

/// Samples are at least this many frames apart where nothing drifts: what `moved` tells changes slowly.
const SAMPLE_EVERY: u32 = 32;

/// Keeps the estimate of the load up to date.
// A frame without a decision looks at what stands first alone: see `Runner`.
#[repr(C)]
#[derive(Debug, Clone, Default)]
pub(super) struct LoadTracker {
    throttle: DecisionThrottle,
    /// The next frame is to show how far boxes move. Stands here, for a frame without a decision does not ask
    /// `motion`, which lies in other lines of memory.
    watching: bool,
    load: Load,
    /// What was worked out about the next frame.
    plan: FramePlan,
    /// Objects when the load was sampled, and frames and their time since.
    sampled: u32,
    age: u32,
    passed_ns: f64,
    /// What a sample takes: the last one, but at most `COST_RISES` times what the one before was taken to be.
    sample_ns: f64,
    /// What the sample of the last decision took, where it had one.
    sampled_ns: f64,
    motion: MotionWatch,
    /// Objects and pairs of the frame before.
    before: Option<(u32, u64)>,
}

impl LoadTracker {
    /// How far the boxes move in a frame, in edges, where that was found out.
    pub(super) fn moved(&self) -> Option<f64> {
        self.motion.motion().map(|m| m.moved)
    }

    /// The load that was estimated last.
    pub(super) fn load(&self) -> Load {
        self.load
    }

    /// What was worked out about the frame that is to run.
    pub(super) fn plan(&self) -> &FramePlan {
        &self.plan
    }

    /// Whether the next frame is to be decided on again.
    pub(super) fn is_due(&self, boxes: &[Aabb]) -> bool {
        self.throttle.is_due(count(boxes))
    }

    /// Brings the load up to date: sampled where that pays, else scaled from the last sample.
    pub(super) fn decide(&mut self, boxes: &[Aabb]) {
        let objects = count(boxes);
        let pairs = self.before.map(|(n, pairs)| scaled(pairs as f64, objects, n));
        self.look(boxes);
        let motion = self.motion.motion();
        self.sampled_ns = 0.0;
        let mut plan = FramePlan::default();
        if self.is_sample_due(objects) {
            let started = Instant::now();
            (self.load, plan) = Load::planned(boxes, pairs, motion);
            #[cfg(test)]
            counted::spend(counted::sample_ns(boxes.len()));
            let took = started.elapsed().as_nanos() as f64;
            self.sampled_ns = took;
            self.sample_ns = if self.sample_ns > 0.0 { took.min(self.sample_ns * COST_RISES) } else { took };
            self.motion.want();
            (self.sampled, self.age, self.passed_ns) = (objects, 0, 0.0);
        } else {
            self.load = self.load.rescaled(objects, pairs.unwrap_or(self.load.pairs));
            self.load = motion.map_or(self.load, |motion| self.load.with_motion(motion));
        }
        self.plan = plan.with_moved(self.moved()).with_pairs(pairs);
        self.throttle.decide(objects);
    }

    /// Looks how far the boxes of a frame have moved, where those of the frame before were remembered. Whether they
    /// move at another pace.
    fn look(&mut self, boxes: &[Aabb]) -> bool {
        std::mem::take(&mut self.watching) && self.motion.look(boxes)
    }

    /// Frames since the last sample.
    #[cfg(test)]
    pub(super) fn age(&self) -> u32 {
        self.age
    }

    fn is_sample_due(&self, objects: u32) -> bool {
        let drift = drift(objects, self.sampled);
        let rested = self.age >= SAMPLE_EVERY || drift > 1.0 / 16.0;
        self.before.is_none() || rested && self.passed_ns * (SHARE + SHARE_OF_DRIFT * drift) >= self.sample_ns
    }

    /// Takes note of a frame that ran without a decision, the last of those that have `passed`, and of its wanted
    /// pairs: every algorithm has the same number of them. Unwanted ones that some algorithms find count as their
    /// slowness.
    pub(super) fn passes(&mut self, boxes: &[Aabb], pairs: u64, passed: &Passed) {
        self.throttle.ran(count(boxes), pairs);
        // A look alone takes a tenth of a decision, and most looks find the pace of before.
        if self.look(boxes) {
            self.throttle.wake();
        }
        if passed.is_off(self.throttle.rest_ns()) {
            // Boxes may move at another pace.
            self.motion.want();
            self.throttle.wake();
        }
        if passed.is_over_budget() {
            self.throttle.wake();
        }
    }

    /// Takes in the frames that ran without a decision.
    pub(super) fn went_on(&mut self, passed: &Passed) {
        self.before = Some(self.throttle.before());
        self.age = self.age.saturating_add(passed.frames);
        let ns = f64::from(passed.frames) * passed.mean_ns().unwrap_or(self.throttle.frame_ns());
        self.passed_ns += ns;
        self.motion.passed(ns);
    }

    /// Takes in a frame that was decided on, or stood out among those that were not: its wanted pairs, and how long it
    /// took in nanoseconds.
    pub(super) fn ran(&mut self, boxes: &[Aabb], pairs: u64, ns: f64) {
        // One that was not decided on: the next one would be compared with the one before it.
        self.look(boxes);
        // What was worked out for this frame holds for no other.
        self.plan = FramePlan::default();
        self.throttle.ran(count(boxes), pairs);
        self.before = Some(self.throttle.before());
        self.age = self.age.saturating_add(1);
        self.passed_ns += ns;
        self.motion.passed(ns);
        self.watching |= self.motion.ran(boxes);
    }

    /// What of the last decision, which took so many nanoseconds, was no sample: samples have a share of the time of
    /// their own.
    pub(super) fn without_sample(&self, decision_ns: f64) -> f64 {
        (decision_ns - self.sampled_ns).max(0.0)
    }

    /// What a decision without its sample took, where that is known, and its frame, in nanoseconds.
    pub(super) fn took(&mut self, decision_ns: Option<f64>, frame_ns: f64) {
        self.throttle.took(decision_ns, frame_ns);
    }

    /// What a decision takes in the mean, without a sample, in nanoseconds.
    pub(super) fn decision_ns(&self) -> f64 {
        self.throttle.decision_ns()
    }

    /// The next decision is that many frames away at most.
    pub(super) fn rest_no_longer_than(&mut self, frames: f64) {
        self.throttle.rest_no_longer_than(frames);
    }

    /// The next frame is to be decided on again.
    pub(super) fn wake(&mut self) {
        self.throttle.wake();
    }

    /// After a frame that failed nothing is known of the one before, and the next one is decided on again.
    pub(super) fn failed(&mut self) {
        self.before = None;
        self.motion.failed();
        self.watching = false;
        self.wake();
    }
}

/// Boxes of a frame; an algorithm refuses more than this can tell.
fn count(boxes: &[Aabb]) -> u32 {
    u32::try_from(boxes.len()).unwrap_or(u32::MAX)
}

/// A count that grows in proportion to the objects.
fn scaled(count: f64, objects: u32, before: u32) -> f64 {
    if before == 0 { count } else { count * f64::from(objects) / f64::from(before) }
}
