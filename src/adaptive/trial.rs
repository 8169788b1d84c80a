//! Trials: another algorithm than the incumbent runs for a few frames, to measure its cost.

use crate::stats::normal_density;

/// The exploration budget as a share of the time, and the frames of the incumbent that trials may cost in advance.
const BUDGET: f64 = 0.005;
const IN_ADVANCE: f64 = 8.0;
/// A trial whose expected saving is this many times its price runs on credit.
const URGENT: f64 = 17.0;
/// Frames over which the result of a trial counts as useful: five seconds of a game.
const HORIZON: f64 = 300.0;
/// Least expected saving of a trial beyond its price, in frames of the incumbent: candidates that cost nearly the same
/// are not tried. Replays: 1.073 → 1.068, worst 1.31 → 1.21.
const LEAST_GAIN: f64 = 5.0;
/// Fewest frames from the beginning of one trial to that of the next.
const APART: u64 = 16;
/// A trial ends early when it has cost its price plus this many frames of the incumbent.
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

/// The trial that runs, and the cost of trials.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Trials {
    pub(super) running: Option<Trial>,
    pub(super) begun_at: u64,
    /// Nanoseconds of trials that the budget has not covered yet.
    debt_ns: f64,
}

impl Trials {
    /// Pays back the debt with the budget that frames of `ns` in all have earned.
    pub(super) fn earn(&mut self, ns: f64) {
        self.debt_ns = (self.debt_ns - BUDGET * ns).max(0.0);
    }

    /// Returns whether a trial may begin with this frame. A frame of the incumbent takes `now_ns`.
    pub(super) fn may_begin(&self, frame: u64, now_ns: f64) -> bool {
        self.running.is_none() && frame >= self.begun_at + APART && self.debt_ns <= IN_ADVANCE * now_ns
    }

    /// Returns the trial of a candidate and its expected saving beyond its price, or `None` if it does not pay.
    /// `ratio_ln` is the expected logarithm of the candidate's cost over the incumbent's, `told_ln` the standard
    /// deviation of its correction by the trial.
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

    /// Records a frame of the trial that cost `extra_ns` more than one of the incumbent.
    pub(super) fn ran(&mut self, extra_ns: f64) {
        if let Some(trial) = &mut self.running {
            trial.left = trial.left.saturating_sub(1);
            trial.left_ns -= extra_ns;
            self.debt_ns += extra_ns;
        }
    }
}

/// Returns the expected saving from knowing a candidate's cost, as a share of the incumbent's cost: the mean of the
/// part below zero of a normal distribution with this mean and deviation, less the saving of a switch without a trial.
fn expected_gain(ratio_ln: f64, told_ln: f64) -> f64 {
    if told_ln.is_nan() || told_ln <= 0.0 {
        return 0.0;
    }
    let z = -ratio_ln / told_ln;
    // The logistic curve that comes closest to the cumulative normal distribution, to 1 %.
    let cumulative = 1.0 / (1.0 + (-1.702 * z).exp());
    (told_ln * (normal_density(z) + z * cumulative) - (-ratio_ln).max(0.0)).max(0.0)
}
