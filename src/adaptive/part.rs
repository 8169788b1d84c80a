//! A correction of predicted costs: the natural logarithm of a factor, learned from frames by a scalar Kalman filter.

/// Frames after which half of a correction is forgotten: a core that another program took comes back.
const FORGET_FRAMES: f64 = 2000.0;

/// One factor on predicted costs, as a logarithm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    mean: f64,
    variance: f64,
    /// Variance before the first observation.
    before: f64,
    /// Frame of the last observation.
    at: u64,
}

impl Part {
    /// Makes a factor of 1 whose logarithm has this standard deviation.
    pub(super) fn new(deviation_ln: f64) -> Self {
        let variance = deviation_ln * deviation_ln;
        Self { mean: 0.0, variance, before: variance, at: 0 }
    }

    /// Returns the share of the correction that is not forgotten by this frame.
    fn kept(&self, frame: u64) -> f64 {
        1.0 / (1.0 + frame.saturating_sub(self.at) as f64 / FORGET_FRAMES)
    }

    pub(super) fn mean(&self, frame: u64) -> f64 {
        self.kept(frame) * self.mean
    }

    pub(super) fn variance(&self, frame: u64) -> f64 {
        self.before + self.kept(frame) * (self.variance - self.before)
    }

    /// Takes its share of a surprise. `whole` is the variance of the surprise, this part's included.
    pub(super) fn absorb(&mut self, surprise: f64, whole: f64, frame: u64) {
        let (mean, variance) = (self.mean(frame), self.variance(frame));
        let gain = variance / whole;
        (self.mean, self.variance, self.at) = (mean + gain * surprise, variance * (1.0 - gain), frame);
    }

    /// Keeps this share of the mean and of the certainty.
    pub(super) fn fade(&mut self, keep: f64) {
        self.mean *= keep;
        self.variance = self.before + keep * keep * (self.variance - self.before);
    }

    /// Keeps the mean, and resets the variance to that before the first observation.
    pub(super) fn doubt(&mut self) {
        self.variance = self.before;
    }
}
