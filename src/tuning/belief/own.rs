//! What an algorithm has for itself: a constant and a function of the load.

use super::SIZE;

/// Of an own part, its constant and its curve: tuning that was measured a minute ago is off by this in the next scene.
const OWN_LN: [f64; 2] = [0.05, 0.18];

/// Frames after which what was observed of it counts for less than half: in a hundred frames it may change by 2 % (a
/// standard deviation).
pub(super) const OWN_FRAMES: f64 = 6000.0;

/// What an algorithm has for itself.
#[derive(Debug, Clone)]
pub(super) struct Own {
    pub(super) mean: [f64; SIZE],
    pub(super) covariance: [[f64; SIZE]; SIZE],
    /// The frame at which that held.
    pub(super) at: u64,
}

impl Own {
    pub(super) fn new() -> Self {
        let mut own = Self { mean: [0.0; SIZE], covariance: [[0.0; SIZE]; SIZE], at: 0 };
        own.age(1.0);
        own
    }

    /// The covariance goes back by that share towards what it was before anything was observed.
    pub(super) fn age(&mut self, share: f64) {
        for (i, row) in self.covariance.iter_mut().enumerate() {
            row.iter_mut().for_each(|entry| *entry *= 1.0 - share);
            row[i] += share * Self::before(i);
        }
    }

    /// The variance of an entry before anything was observed.
    pub(super) fn before(entry: usize) -> f64 {
        OWN_LN[usize::from(entry > 0)].powi(2)
    }
}

/// The share of an own part that is forgotten after so many frames. Of the exponential only the beginning: none of
/// this is known to the last digit.
pub(super) fn aged(frames: u64) -> f64 {
    let aged = frames as f64 / OWN_FRAMES;
    aged / (1.0 + aged)
}
