//! What a switch costs: a frame in which an algorithm has nothing to build upon, its first one or one in which it
//! makes again what it keeps.

use crate::broad_phase::{FrameKind, FrameWork};

/// Share of a frame that the first one costs beside: memory that is no longer in a cache, threads that sleep. Learned
/// from then on.
const COLD: f64 = 0.15;
/// A frame made again by an incremental algorithm, over a frame of the other way that its cost curve knows, or over a
/// frame of its own where there is no other way. `pair-cache` over `bvh`, its other way: medians 1.6 to 1.9,
/// quartiles 1.4 to 3.0, in four reports of the two hosts of `datasets/` (frames over 2.5 times the median of their
/// timing, where these are less than a fifth of its frames). Rather more: a first frame is colder than these.
const FROM_NOTHING: f64 = 2.0;

/// Frames of absence after which what an algorithm kept is worth nothing any more.
const FORGOTTEN: u64 = 3;

/// A frame made again may be disturbed: it moves the cost by this share, and by no more than this factor of itself.
const SHARE: f64 = 0.25;
const MOST: f64 = 4.0;

/// Share of the frames that are made again: cost curves come from medians, which leave those frames out. Of what is
/// seen that counts which is beyond the second: a few frames more or less of these are in what is believed of
/// keeping, and to count all that are seen costs 0.5 to 1.0 % in replayed traces.
const REBUILDS: f64 = 0.02;
const MANY_REBUILDS: f64 = 0.15;
/// Frames over which the share that is seen is the mean, and frames after which half of it is forgotten where none of
/// these run.
const REBUILDS_OVER: f64 = 100.0;
const REBUILDS_LAST: f64 = 1000.0;

/// How many there are to keep, where `kept` is as [`Policy::new`](super::policy::Policy::new) has it.
pub(super) fn works(kept: &[Option<usize>]) -> usize {
    kept.iter().flatten().max().map_or(0, |most| most + 1)
}

/// What it costs to switch to each of the candidates.
#[derive(Debug, Clone)]
pub(super) struct SwitchingCosts {
    costs: Vec<SwitchingCost>,
    /// By what is kept.
    works: Vec<KeptWork>,
}

/// What is kept from frame to frame.
#[derive(Debug, Clone)]
struct KeptWork {
    /// The frame that kept it last.
    last: Option<u64>,
    /// The share of frames that made it again of late, and the frame before which that held.
    rebuilds: f64,
    at: u64,
}

#[derive(Debug, Clone)]
struct SwitchingCost {
    /// Where it finds what the frame before left: a position in `SwitchingCosts::works`. `None` where every frame is
    /// made from scratch.
    kept: Option<usize>,
    /// A frame with nothing to build upon over one of the other way.
    over: f64,
}

/// What a candidate is expected to cost, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    /// The mean over its frames.
    pub(super) mean_ns: f64,
    /// A frame without the help of the frame before, as the other way of its curve has it; the same where there is
    /// one way only.
    pub(super) alone_ns: f64,
}

impl SwitchingCosts {
    /// `kept` as [`Policy::new`](super::policy::Policy::new) has it.
    pub(super) fn new(kept: &[Option<usize>]) -> Self {
        let cost = |&kept: &Option<usize>| SwitchingCost {
            kept,
            over: if kept.is_some() { FROM_NOTHING } else { 1.0 + COLD },
        };
        let work = KeptWork { last: None, rebuilds: 0.0, at: 0 };
        Self { costs: kept.iter().map(cost).collect(), works: vec![work; works(kept)] }
    }

    /// Other instances keep, shared by the same candidates as before, nothing yet. False where other candidates share
    /// it.
    pub(super) fn remade(&mut self, kept: &[Option<usize>]) -> bool {
        self.works.iter_mut().for_each(|work| work.last = None);
        self.costs.iter().map(|p| p.kept).eq(kept.iter().copied())
    }

    /// Whether a candidate keeps work from frame to frame.
    pub(super) fn keeps(&self, candidate: usize) -> bool {
        self.costs[candidate].kept.is_some()
    }

    /// Whether a candidate finds what another one keeps.
    pub(super) fn share(&self, candidate: usize, other: usize) -> bool {
        self.keeps(candidate) && self.costs[candidate].kept == self.costs[other].kept
    }

    /// What a frame of a candidate takes in the mean, where its cost curve says so much of it and of the other way of
    /// it.
    pub(super) fn mean_ns(&self, candidate: usize, frame: u64, built_ns: f64, alone_ns: f64) -> f64 {
        let Some(kept) = self.costs[candidate].kept else { return built_ns };
        let rebuilds = (self.works[kept].rebuilds_at(frame) - MANY_REBUILDS).max(REBUILDS);
        built_ns + rebuilds * (FROM_NOTHING * alone_ns - built_ns).max(0.0)
    }

    /// What the first frame of a candidate costs beside the mean of its frames, were it to begin now.
    pub(super) fn enter_ns(&self, candidate: usize, frame: u64, expected: Expected) -> f64 {
        if self.remembers(candidate, frame) {
            COLD * expected.mean_ns
        } else {
            self.rebuild_ns(candidate, expected) - expected.mean_ns
        }
    }

    /// What is lost where a candidate is left for one that does not go on with what it keeps: to make that again
    /// later costs so much more.
    pub(super) fn leave_ns(&self, left: usize, other: usize, frame: u64, expected: Expected) -> f64 {
        if !self.remembers(left, frame) || self.share(left, other) {
            return 0.0;
        }
        self.rebuild_ns(left, expected) - expected.mean_ns
    }

    /// What a frame of a candidate takes in which it has nothing to build upon.
    pub(super) fn rebuild_ns(&self, candidate: usize, expected: Expected) -> f64 {
        (self.costs[candidate].over * expected.alone_ns).max(expected.mean_ns)
    }

    /// Takes in that a candidate ran so many frames up to this one, in how many of them all was made again, and how
    /// the last one came about.
    pub(super) fn ran(&mut self, candidate: usize, frame: u64, frames: u32, rebuilt: u32, work: Option<FrameWork>) {
        let Some(kept) = self.costs[candidate].kept else { return };
        let first = frame + 1 - u64::from(frames);
        let goes_on = self.remembers(candidate, first);
        let kept = &mut self.works[kept];
        let keeps = work.is_some_and(|work| work.kind != FrameKind::FromScratch);
        // One that begins makes all in any case.
        if keeps && goes_on {
            let (frames, seen) = (f64::from(frames), f64::from(rebuilt) / f64::from(frames));
            kept.rebuilds = seen + (kept.rebuilds_at(first) - seen) * (-frames / REBUILDS_OVER).exp();
            kept.at = frame + 1;
        }
        kept.last = keeps.then_some(frame);
    }

    /// Learns from a frame of a candidate that had nothing to build upon.
    pub(super) fn learn(&mut self, candidate: usize, ns: f64, expected: Expected) {
        let cost = &mut self.costs[candidate];
        let seen = (ns / expected.alone_ns).clamp(1.0, MOST * cost.over);
        cost.over += if seen.is_finite() { SHARE * (seen - cost.over) } else { 0.0 };
    }

    /// Whether a candidate goes on with what was kept for it before this frame.
    pub(super) fn remembers(&self, candidate: usize, frame: u64) -> bool {
        let last = self.costs[candidate].kept.and_then(|work| self.works[work].last);
        last.is_some_and(|last| frame - last <= FORGOTTEN)
    }
}

impl KeptWork {
    /// The share of frames that make it again, as far as it is not forgotten by this frame.
    fn rebuilds_at(&self, frame: u64) -> f64 {
        self.rebuilds / (1.0 + frame.saturating_sub(self.at) as f64 / REBUILDS_LAST)
    }
}
