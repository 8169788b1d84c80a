//! What a few frames tell about all algorithms: predicted costs, corrected by observations.
//!
//! The natural logarithm of real over predicted cost is taken to be a Gaussian process: for each algorithm a curve over the
//! logarithm of the number of objects, correlated with the curves of its relatives as the [`Prior`] says. An observation of one
//! algorithm at one number of objects moves all of them, each by as much as it has in common with the observed one.

mod gain;
mod prior;

use crate::{AlgorithmCost, Knot, Load};

pub use gain::Outlook;
pub use prior::{Deviations, Part, Prior, width_correlation};

/// Knots of each curve: 2^2 to 2^24 objects, every second octave, linear in between.
const KNOTS: usize = 12;
const FIRST_OCTAVE: f64 = 2.0;
const OCTAVES: f64 = 2.0;

/// No observation moves a curve by more than this, a factor of 5e8: beyond lies a clock that is wrong.
const MOST_SURPRISE_LN: f64 = 20.0;
/// What a cost curve may hold ([`CostCurve::defect`](crate::CostCurve::defect)).
const MOST_FACTOR_LN: f64 = 50.0;

/// The costs of all algorithms of a machine, as far as they are known from a prediction and from what was observed.
///
/// Memory grows with the square of the number of algorithms, 295 kB for 16, and is allocated when it is made.
#[derive(Debug, Clone)]
pub struct Posterior {
    costs: Vec<AlgorithmCost>,
    prior: Prior,
    /// Of each algorithm at each knot, knots of one algorithm side by side.
    mean: Vec<f64>,
    /// Of `mean`, row by row.
    covariance: Vec<f64>,
    /// Covariance of each entry of `mean` with the observation at hand.
    with: Vec<f64>,
}

/// Logarithms of the costs of all algorithms under one load.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Joint {
    /// Expected natural logarithm of nanoseconds, by algorithm. Infinite where the cost can't be predicted under this load.
    pub mean_ln: Vec<f64>,
    /// Covariance of these, row by row.
    pub covariance: Vec<f64>,
}

impl Joint {
    /// Variance of the logarithm of the ratio of two costs.
    #[must_use]
    pub fn variance_of_ratio(&self, a: usize, b: usize) -> f64 {
        let of = |i: usize, j: usize| self.covariance[i * self.mean_ln.len() + j];
        (of(a, a) + of(b, b) - 2.0 * of(a, b)).max(0.0)
    }
}

/// Between which knots a number of objects lies.
#[derive(Debug, Clone, Copy)]
struct Place {
    knot: usize,
    /// Share of the next knot.
    share: f64,
}

impl Place {
    fn of(load: &Load) -> Self {
        let at = (f64::from(load.objects.max(1)).log2() - FIRST_OCTAVE) / OCTAVES;
        let at = at.clamp(0.0, (KNOTS - 1) as f64);
        let knot = (at as usize).min(KNOTS - 2);
        Self { knot, share: at - knot as f64 }
    }

    /// The value here of an algorithm's curve among the curves of all.
    fn on(self, curves: &[f64], algorithm: usize) -> f64 {
        let at = algorithm * KNOTS + self.knot;
        (1.0 - self.share) * curves[at] + self.share * curves[at + 1]
    }
}

impl Posterior {
    /// What is known before anything was observed.
    #[must_use]
    pub fn new(costs: Vec<AlgorithmCost>, prior: &Prior) -> Self {
        let dimension = costs.len() * KNOTS;
        let mut posterior = Self {
            costs,
            prior: *prior,
            mean: vec![0.0; dimension],
            covariance: vec![0.0; dimension * dimension],
            with: vec![0.0; dimension],
        };
        posterior.forget(1.0);
        posterior
    }

    /// The predicted costs that it corrects. Their order numbers the algorithms.
    #[must_use]
    pub fn predicted(&self) -> &[AlgorithmCost] {
        &self.costs
    }

    /// Takes in that a frame under `load` took the algorithm `ns` nanoseconds. `noise_ln` is the standard deviation of that figure's
    /// logarithm, beside the noise of the prior.
    ///
    /// Gives false, and learns nothing, where the time is no positive number or the predicted cost is none.
    pub fn observe(&mut self, algorithm: usize, load: &Load, ns: f64, noise_ln: f64) -> bool {
        let surprise = ns.ln() - self.costs[algorithm].curve.cost_ns(load).ln();
        if !(surprise.is_finite() && noise_ln.is_finite()) {
            return false;
        }
        let place = Place::of(load);
        let mut with = std::mem::take(&mut self.with);
        let variance = self.covariances(algorithm, place, noise_ln, &mut with);
        let scale = 1.0 / variance;
        let error = surprise.clamp(-MOST_SURPRISE_LN, MOST_SURPRISE_LN) - place.on(&self.mean, algorithm);
        // Joseph's form, for one observation: an error in the gain is of second order in the covariance, which stays that of a
        // real vector. Every product is written so that both halves of the matrix round alike.
        for (i, row) in self.covariance.chunks_exact_mut(with.len()).enumerate() {
            let gain = with[i] * scale;
            if gain == 0.0 {
                continue;
            }
            self.mean[i] += gain * error;
            for (entry, &other) in row.iter_mut().zip(&with) {
                let other_gain = other * scale;
                *entry += variance * (gain * other_gain) - (gain * other + with[i] * other_gain);
            }
        }
        self.with = with;
        true
    }

    /// Fills `with` with the covariance of each curve with an observation, and gives the variance of that observation.
    fn covariances(&self, algorithm: usize, place: Place, noise_ln: f64, with: &mut [f64]) -> f64 {
        let dimension = self.mean.len();
        let row = |knot: usize| &self.covariance[(algorithm * KNOTS + knot) * dimension..][..dimension];
        for (w, (a, b)) in with.iter_mut().zip(row(place.knot).iter().zip(row(place.knot + 1))) {
            *w = (1.0 - place.share) * a + place.share * b;
        }
        place.on(with, algorithm).max(0.0) + self.noise(algorithm, noise_ln)
    }

    /// Variance of an observation of an algorithm around its curve.
    fn noise(&self, algorithm: usize, noise_ln: f64) -> f64 {
        let class = self.costs[algorithm].algorithm.backend().class();
        self.prior.of(class).noise_ln.powi(2) + noise_ln.powi(2)
    }

    /// Trusts what was observed less by that share, 0 to 1: the machine may have changed since. What is expected stays; how sure
    /// that is goes back towards the prior.
    pub fn forget(&mut self, share: f64) {
        let Self { costs, prior, covariance, .. } = self;
        let dimension = costs.len() * KNOTS;
        for (a, one) in costs.iter().enumerate() {
            let class = one.algorithm.backend().class();
            for (b, other) in costs.iter().enumerate().filter(|(_, c)| c.algorithm.backend().class() == class) {
                let apart: [f64; KNOTS] = std::array::from_fn(|k| {
                    prior.of(class).covariance(&one.algorithm, &other.algorithm, k as f64 * OCTAVES)
                });
                for k in 0..KNOTS {
                    for l in 0..KNOTS {
                        let entry = &mut covariance[(a * KNOTS + k) * dimension + b * KNOTS + l];
                        *entry += share * (apart[k.abs_diff(l)] - *entry);
                    }
                }
            }
        }
    }

    /// The costs as they are expected now: the predicted curves with corrections, and with the spread that is left.
    #[must_use]
    pub fn costs(&self) -> Vec<AlgorithmCost> {
        let corrected = |(a, cost): (usize, &AlgorithmCost)| {
            let mut cost = cost.clone();
            let own = (0..KNOTS).map(|k| FIRST_OCTAVE + OCTAVES * k as f64);
            let mut octaves: Vec<f64> = cost.curve.correction.iter().map(|k| k.log2_objects).chain(own).collect();
            octaves.sort_by(f64::total_cmp);
            octaves.dedup();
            let knot = |log2_objects: f64| {
                let at = ((log2_objects - FIRST_OCTAVE) / OCTAVES).clamp(0.0, (KNOTS - 1) as f64);
                let knot = (at as usize).min(KNOTS - 2);
                let learned = Place { knot, share: at - knot as f64 }.on(&self.mean, a);
                let ln_factor = cost.curve.ln_correction(log2_objects) + learned;
                Knot { log2_objects, ln_factor: ln_factor.clamp(-MOST_FACTOR_LN, MOST_FACTOR_LN) }
            };
            let correction = octaves.into_iter().map(knot).collect();
            cost.curve.correction = correction;
            cost.spread_ln = self.spread_ln(a);
            cost
        };
        self.costs.iter().enumerate().map(corrected).collect()
    }

    /// Root of the mean variance of an algorithm's logarithmic cost over the knots, noise included.
    fn spread_ln(&self, algorithm: usize) -> f64 {
        let dimension = self.mean.len();
        let knots = algorithm * KNOTS..(algorithm + 1) * KNOTS;
        let sum: f64 = knots.map(|i| self.covariance[i * dimension + i].max(0.0)).sum();
        (sum / KNOTS as f64 + self.noise(algorithm, 0.0)).sqrt()
    }

    /// Expected logarithms of the costs under a load, and how they hang together. `joint` keeps its memory.
    ///
    /// The noise of single observations is not in it: what is uncertain here is the curve.
    pub fn joint(&self, load: &Load, joint: &mut Joint) {
        let place = Place::of(load);
        let count = self.costs.len();
        joint.mean_ln.clear();
        joint.mean_ln.extend((0..count).map(|a| self.mean_ln(a, load, place)));
        joint.covariance.clear();
        let dimension = self.mean.len();
        for a in 0..count {
            let at = (a * KNOTS + place.knot) * dimension;
            let (low, high) = (&self.covariance[at..at + dimension], &self.covariance[at + dimension..at + 2 * dimension]);
            let of = |b: usize| (1.0 - place.share) * place.on(low, b) + place.share * place.on(high, b);
            joint.covariance.extend((0..count).map(of));
        }
    }

    /// Expected natural logarithm of an algorithm's nanoseconds under a load, which lies at `place`.
    fn mean_ln(&self, algorithm: usize, load: &Load, place: Place) -> f64 {
        let predicted = self.costs[algorithm].curve.cost_ns(load).ln();
        if predicted.is_finite() { predicted + place.on(&self.mean, algorithm) } else { f64::INFINITY }
    }
}

#[cfg(test)]
mod tests;
