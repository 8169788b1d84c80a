//! The time for which frames on a number of threads wait for other programs.
//!
//! If another program has the core of a helper, the helper waits for the scheduler's next turn, however short the
//! frame. Such a wait is no factor on the cost, and happens in few frames. Its mean counts, which a trial of a few
//! frames does not show.

/// A wait counts as at most this many times the longest expected frame: a breakpoint says nothing about later frames.
pub(super) const MOST_WAIT: f64 = 64.0;
/// Weight of a frame in the mean, and frames on other numbers of threads after which half of the mean is forgotten.
const WEIGHT: f64 = 1.0 / 128.0;
const FORGET_FRAMES: f64 = 800.0;
/// A wait counts only if there was another one at most this many frames earlier; otherwise it is an accident.
const APART: u64 = 64;

/// Mean nanoseconds that a frame waits.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wait {
    mean_ns: f64,
    /// The frame of that mean, and the last frame that waited.
    at: u64,
    last: Option<u64>,
}

impl Wait {
    pub(super) fn ns(&self, frame: u64) -> f64 {
        self.mean_ns / (1.0 + frame.saturating_sub(self.at) as f64 / FORGET_FRAMES)
    }

    /// Records a frame that waited.
    pub(super) fn add(&mut self, ns: f64, frame: u64) {
        let last = self.last.replace(frame);
        if last.is_some_and(|last| frame.saturating_sub(last) <= APART) {
            (self.mean_ns, self.at) = (self.ns(frame) + WEIGHT * ns, frame);
        }
    }

    /// Records `frames` frames up to `frame`, whether they waited or not.
    pub(super) fn pass(&mut self, frames: u32, frame: u64) {
        if self.mean_ns > 0.0 {
            (self.mean_ns, self.at) = ((1.0 - WEIGHT).powf(f64::from(frames)) * self.ns(frame), frame);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clone_that_goes_on_from_an_earlier_frame_may_wait() {
        let mut wait = Wait::default();
        wait.add(64.0e3, 100);
        wait.add(64.0e3, 90);
        assert_eq!(wait.ns(90), 500.0);
    }
}
