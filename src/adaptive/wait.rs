//! How long frames on some number of threads wait for other programs.
//!
//! A helper whose core another program has waits for the scheduler's next turn, however short the frame. That is no
//! factor on the cost, and comes in few frames: what counts is its mean, which a trial of a few frames does not show.

/// A wait counts at most this many times the longest expected frame: a breakpoint says nothing of later frames.
pub(super) const MOST_WAIT: f64 = 64.0;
/// Weight of a frame in the mean, and frames after which half of the mean is forgotten while no such frame runs.
const WEIGHT: f64 = 1.0 / 128.0;
const FORGET_FRAMES: f64 = 800.0;
/// A wait with none in this many frames before it is an accident, and does not count.
const APART: u64 = 64;

/// Mean nanoseconds that a frame waits.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wait {
    mean_ns: f64,
    /// The frame at which that held, and the last frame that waited.
    at: u64,
    last: Option<u64>,
}

impl Wait {
    pub(super) fn ns(&self, frame: u64) -> f64 {
        self.mean_ns / (1.0 + frame.saturating_sub(self.at) as f64 / FORGET_FRAMES)
    }

    /// Takes in a frame that waited.
    pub(super) fn add(&mut self, ns: f64, frame: u64) {
        let last = self.last.replace(frame);
        if last.is_some_and(|last| frame.saturating_sub(last) <= APART) {
            (self.mean_ns, self.at) = (self.ns(frame) + WEIGHT * ns, frame);
        }
    }

    /// Takes in some frames, waiting or not, of which the last is this one.
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
