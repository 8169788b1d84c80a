//! The frames between two decisions.

use crate::broad_phase::FrameWork;

/// Nanoseconds to read the clock twice with cold caches, and the share of the time that this may take.
const CLOCK_NS: f64 = 100.0;
const CLOCK_SHARE: f64 = 0.0025;
/// Most frames from one timed frame to the next.
const MOST_APART: f64 = 32.0;

/// A decision is due early if the mean time of frames is off by the factor `OFF`, after at least `ENOUGH` timed frames
/// and the share `EARLIEST` of the time until the next decision.
const ENOUGH: u32 = 8;
const EARLIEST: f64 = 0.25;
const OFF: f64 = 1.2;

/// The frames of one candidate since the last decision.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Epoch {
    pub(super) frames: u32,
    /// Of the timed frames that did not stand out: their number, nanoseconds, and work in mean frames.
    pub(super) timed: u32,
    pub(super) ns: f64,
    pub(super) work: f64,
    /// Frames from one timed frame to the next.
    apart: u32,
    /// Expected nanoseconds of a mean frame, and the nanoseconds above which a frame stands out.
    mean_ns: f64,
    most_ns: f64,
}

impl Epoch {
    /// Makes an epoch without a frame.
    pub(super) fn expecting(mean_ns: f64, most_ns: f64) -> Self {
        let apart = (CLOCK_NS / (CLOCK_SHARE * mean_ns)).clamp(1.0, MOST_APART) as u32;
        Self { apart, mean_ns, most_ns, ..Self::default() }
    }

    /// Returns whether to time the next frame.
    pub(super) fn is_timed(&self) -> bool {
        self.frames.is_multiple_of(self.apart.max(1))
    }

    /// Adds a frame and returns whether it stood out.
    pub(super) fn add(&mut self, ns: Option<f64>, work: Option<FrameWork>) -> bool {
        self.frames += 1;
        let Some(ns) = ns else { return false };
        let stood_out = ns > self.most_ns;
        if !stood_out {
            self.count(ns, work);
        }
        stood_out
    }

    /// Counts the time of a frame.
    pub(super) fn count(&mut self, ns: f64, work: Option<FrameWork>) {
        self.timed += 1;
        self.ns += ns;
        self.work += work.map_or(1.0, |work| work.over_mean);
    }

    /// Returns whether a decision is due early: times are far from the expectation, and a share of `rest_ns` has
    /// passed.
    pub(super) fn is_off(&self, rest_ns: f64) -> bool {
        let mean_ns = self.ns / f64::from(self.timed.max(1));
        if self.timed < ENOUGH || mean_ns * f64::from(self.frames) < EARLIEST * rest_ns {
            return false;
        }
        let expected_ns = self.mean_ns * self.work;
        self.ns > OFF * expected_ns || expected_ns > OFF * self.ns
    }
}
