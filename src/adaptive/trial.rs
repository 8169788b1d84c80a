//! Trials: another algorithm than the incumbent runs for a few frames, to learn what it costs.

use crate::stats::normal_density;

/// Share of the time that trials may cost, and frames of the incumbent that they may cost in advance.
const BUDGET: f64 = 0.005;
const IN_ADVANCE: f64 = 8.0;
/// A trial that is expected to save this many times its price is made on credit.
const URGENT: f64 = 17.0;
/// Frames over which the result of a trial is taken to be of use: five seconds of a game.
const HORIZON: f64 = 300.0;
/// Frames of the incumbent that a trial is expected to save beyond its price, at least: candidates that cost nearly the
/// same are left alone. Replays: 1.073 → 1.068, worst 1.31 → 1.21.
const LEAST_GAIN: f64 = 5.0;
/// Frames from the beginning of one trial to the next, at least.
const APART: u64 = 16;
/// A trial ends early once it has cost its price and this many frames of the incumbent.
const OVERRUN: f64 = 1.0;

/// A trial, or the offer of one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial {
    pub(super) candidate: usize,
    /// Frames and extra nanoseconds that are left.
    pub(super) left: u32,
    left_ns: f64,
}

impl Trial {
    pub(super) fn is_over(&self) -> bool {
        self.left == 0 || self.left_ns <= 0.0
    }
}

/// The trial that runs, and what trials have cost.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Trials {
    pub(super) running: Option<Trial>,
    pub(super) begun_at: u64,
    /// Nanoseconds of trials that the budget has not yet covered.
    debt_ns: f64,
}

impl Trials {
    /// Pays back with the budget of frames that took this long together.
    pub(super) fn earn(&mut self, ns: f64) {
        self.debt_ns = (self.debt_ns - BUDGET * ns).max(0.0);
    }

    /// Whether one may begin with this frame, if the incumbent's takes `now_ns`.
    pub(super) fn may_begin(&self, frame: u64, now_ns: f64) -> bool {
        self.running.is_none() && frame >= self.begun_at + APART && self.debt_ns <= IN_ADVANCE * now_ns
    }

    /// The trial of a candidate for some frames, and what it is expected to save beyond its price. `ratio_ln` is the
    /// expected logarithm of its cost over the incumbent's, and `told_ln` the standard deviation by which the trial is
    /// expected to correct that. `None` if it doesn't pay.
    pub(super) fn offer(
        &self,
        candidate: usize,
        frames: u32,
        price_ns: f64,
        now_ns: f64,
        ratio_ln: f64,
        told_ln: f64,
    ) -> Option<(Trial, f64)> {
        let gain_ns = now_ns * HORIZON * expected_gain(ratio_ln, told_ln);
        let affordable = self.debt_ns + price_ns <= IN_ADVANCE * now_ns + gain_ns / URGENT;
        let trial = Trial { candidate, left: frames, left_ns: price_ns + OVERRUN * now_ns };
        (gain_ns > price_ns + LEAST_GAIN * now_ns && affordable).then_some((trial, gain_ns - price_ns))
    }

    /// Takes in a frame of the trial that cost this much more than the incumbent's would have.
    pub(super) fn ran(&mut self, extra_ns: f64) {
        if let Some(trial) = &mut self.running {
            trial.left = trial.left.saturating_sub(1);
            trial.left_ns -= extra_ns;
            self.debt_ns += extra_ns;
        }
    }
}

/// Expected saving, as a share of the incumbent's cost, of learning another's: the mean of what lies below zero of a
/// normal distribution with this mean and deviation, less what a switch without the trial would save.
fn expected_gain(ratio_ln: f64, told_ln: f64) -> f64 {
    if told_ln.is_nan() || told_ln <= 0.0 {
        return 0.0;
    }
    let z = -ratio_ln / told_ln;
    // The logistic curve that comes closest to the cumulative normal distribution, to 1 %.
    let cumulative = 1.0 / (1.0 + (-1.702 * z).exp());
    (told_ln * (normal_density(z) + z * cumulative) - (-ratio_ln).max(0.0)).max(0.0)
}
