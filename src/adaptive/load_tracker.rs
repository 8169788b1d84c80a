//! The load of the next frame: estimated from a sample now and then, scaled from the last sample in between.

use super::epoch::Epoch;
use super::pace::{Pace, drift};
use crate::aabb::Aabb;
#[cfg(test)]
use crate::clock::counted;
use crate::clock::{Instant, elapsed_ns};
use crate::load::{Displacement, FramePlan, Load, Motion, is_same_pace};

/// Shares of the frames' time that samples, and that looks at the motion, may take.
const SAMPLE_SHARE: f64 = 0.002;
const LOOK_SHARE: f64 = 0.002;

/// Cap on the time of a sample or a look, in multiples of the previous one. Otherwise an interruption by the system
/// would delay the next one for seconds.
const COST_RISES: f64 = 2.0;

/// Fewest frames between two samples, unless the number of objects [drifts](drift) by more than `DRIFTED`.
const SAMPLE_EVERY: u32 = 32;
const DRIFTED: f64 = 1.0 / 16.0;

/// The state of a look at the motion, which takes two consecutive frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
enum Watch {
    #[default]
    Resting,
    /// Remember the boxes of this frame once it has run.
    Due,
    /// Compare the boxes of the next frame with the remembered ones.
    Watching,
}

/// Keeps the load and the motion up to date.
// A frame without a decision reads only the first fields: see `Runner`.
#[repr(C)]
#[derive(Debug, Clone, Default)]
pub(super) struct LoadTracker {
    pub(super) pace: Pace,
    watch: Watch,
    /// The last estimate.
    pub(super) load: Load,
    /// The plan for the next frame, from its sample.
    pub(super) plan: FramePlan,
    /// Objects at the last sample; frames and nanoseconds since; nanoseconds of a sample.
    sampled: Option<u32>,
    pub(super) age: u32,
    since_sample_ns: f64,
    sample_ns: f64,
    /// The motion at the last look; nanoseconds since; nanoseconds of a look.
    pub(super) motion: Option<Motion>,
    since_look_ns: f64,
    look_ns: f64,
    displacement: Displacement,
    /// Whether a frame has run since the last failure.
    knows_pairs: bool,
}

impl LoadTracker {
    /// Sets the load of a first frame from the number of its boxes alone.
    pub(super) fn begin(&mut self, boxes: &[Aabb]) {
        self.load = Load::of_objects(count(boxes)).with_motion(Motion::MOST);
        self.watch = Watch::Due;
    }

    /// Updates the load. Returns the nanoseconds of the sample, 0 if none was due: samples have a budget of their own.
    pub(super) fn update(&mut self, boxes: &[Aabb]) -> f64 {
        let started = Instant::now();
        let objects = count(boxes);
        self.look(boxes);
        let pairs = self.knows_pairs.then(|| scaled(self.pace.pairs_before as f64, objects, self.pace.before));
        let mut plan = FramePlan::default();
        let mut spent_ns = 0.0;
        if self.is_sample_due(objects) {
            (self.load, plan) = Load::planned(boxes, pairs, self.motion);
            #[cfg(test)]
            counted::spend(counted::sample_ns(boxes.len()));
            spent_ns = elapsed_ns(started);
            self.sample_ns = capped(spent_ns, self.sample_ns);
            self.watch = self.watch.max(Watch::Due);
            (self.sampled, self.age, self.since_sample_ns) = (Some(objects), 0, 0.0);
        } else {
            self.load = self.load.rescaled(objects, pairs.unwrap_or(self.load.pairs));
            self.load = self.motion.map_or(self.load, |motion| self.load.with_motion(motion));
        }
        self.plan = plan.with_moved(self.motion.map(|motion| motion.moved)).with_pairs(pairs);
        spent_ns
    }

    fn is_sample_due(&self, objects: u32) -> bool {
        let Some(sampled) = self.sampled else { return true };
        let rested = self.age >= SAMPLE_EVERY || drift(objects, sampled) > DRIFTED;
        // A sample of fewer boxes takes less.
        let fewer = f64::from(objects.min(sampled)) / f64::from(sampled.max(1));
        rested && self.since_sample_ns * SAMPLE_SHARE >= self.sample_ns * fewer
    }

    /// Compares the boxes with the remembered ones of the previous frame, if there are any. Returns whether the pace
    /// has changed.
    fn look(&mut self, boxes: &[Aabb]) -> bool {
        if self.watch != Watch::Watching {
            return false;
        }
        let started = Instant::now();
        let motion = self.displacement.motion(boxes);
        #[cfg(test)]
        counted::spend(counted::LOOK_NS);
        // Remembering the boxes takes about as long as comparing them.
        self.look_ns = capped(2.0 * elapsed_ns(started), self.look_ns);
        let same = self.motion.zip(motion).is_some_and(|(before, now)| is_same_pace(before.moved, now.moved));
        (self.motion, self.since_look_ns, self.watch) = (motion, 0.0, Watch::Resting);
        !same
    }

    /// Records a frame that needed no decision.
    pub(super) fn went_on(&mut self, boxes: &[Aabb], pairs: u64, epoch: &Epoch) {
        self.pace.ran(count(boxes), pairs);
        if self.look(boxes) {
            self.pace.wake();
        }
        if epoch.is_off(self.pace.rest_ns()) {
            self.watch = self.watch.max(Watch::Due);
            self.pace.wake();
        }
    }

    /// Records a frame that was decided, belongs to a trial, or stood out.
    pub(super) fn ran(&mut self, boxes: &[Aabb], pairs: u64) {
        self.look(boxes);
        // The plan holds for this frame only.
        self.plan = FramePlan::default();
        self.pace.ran(count(boxes), pairs);
        self.knows_pairs = true;
        // Not at the decision, because a frame may be decided twice before it runs.
        let pays = self.look_ns > 0.0 && self.since_look_ns * LOOK_SHARE >= self.look_ns;
        if self.watch == Watch::Due || pays {
            self.displacement.watch(boxes);
            self.watch = Watch::Watching;
        }
    }

    /// Records the time of frames.
    pub(super) fn passed(&mut self, frames: u32, ns: f64) {
        self.age = self.age.saturating_add(frames);
        self.since_sample_ns += ns;
        self.since_look_ns += ns;
    }

    /// Records a failed frame: nothing is known about the previous frame any more.
    pub(super) fn failed(&mut self) {
        (self.knows_pairs, self.motion, self.watch) = (false, None, Watch::Resting);
        self.sampled = None;
        self.pace.wake();
    }
}

/// Returns the number of boxes. Algorithms refuse more than 32 bits can count.
pub(super) fn count(boxes: &[Aabb]) -> u32 {
    u32::try_from(boxes.len()).unwrap_or(u32::MAX)
}

/// Scales a count with the number of objects.
fn scaled(count: f64, objects: u32, before: u32) -> f64 {
    if before == 0 { count } else { count * f64::from(objects) / f64::from(before) }
}

fn capped(ns: f64, before_ns: f64) -> f64 {
    if before_ns > 0.0 { ns.min(COST_RISES * before_ns) } else { ns }
}
