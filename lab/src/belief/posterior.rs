//! What a few frames tell about all algorithms: predicted costs, corrected by observations.
//!
//! The natural logarithm of real over predicted cost is taken to be a Gaussian process: for each algorithm a curve over the
//! logarithm of the number of objects, correlated with the curves of its relatives as the [`Prior`] says. An observation of one
//! algorithm at one number of objects moves all of them, each by as much as it has in common with the observed one.

use super::prior::Prior;
use sapwise::{AlgorithmCost, CostTerm, Counts, Load, MOST_UNIT_NS, Term};

/// Knots of each curve: 2^2 to 2^24 objects, every second octave, linear in between.
const KNOTS: usize = 12;
const FIRST_OCTAVE: f64 = 2.0;
const OCTAVES: f64 = 2.0;

/// Kinds of terms: those of [`Term::ALL`] in that order, and the products of users' algorithms, which share one factor.
const KINDS: usize = Term::ALL.len() + 1;

/// Entries of an algorithm in the state: its knots, then the logarithms of the factors on its terms, by kind.
const STRIDE: usize = KNOTS + KINDS;

/// No more than this many standard deviations of a surprise are believed at once. A frame whose threads waited for a core takes fifty
/// times as long as predicted; all of that believed, every relative of its algorithm would pass for slow as well.
const MOST_SURPRISE: f64 = 3.0;
/// Beyond a factor of 150 on a term the time goes with something else.
const MOST_TERM_FACTOR_LN: f64 = 5.0;

/// The costs of all algorithms of a machine, as far as they are known from a prediction and from what was observed.
///
/// Memory grows with the square of the number of algorithms, 900 kB for 16, and is allocated when it is made.
#[derive(Debug, Clone)]
pub struct Posterior {
    pub(super) costs: Vec<AlgorithmCost>,
    prior: Prior,
    /// Of each algorithm, side by side: its curve at the knots, and the factors on its terms.
    pub(super) mean: Vec<f64>,
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
    /// How these hang on the state, and how the state hangs on one of them.
    slopes: Vec<Slope>,
    with: Vec<f64>,
}

/// Between which knots a number of objects lies.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    knot: usize,
    /// Share of the next knot.
    share: f64,
}

impl Place {
    fn of(log2_objects: f64) -> Self {
        let at = ((log2_objects - FIRST_OCTAVE) / OCTAVES).clamp(0.0, (KNOTS - 1) as f64);
        let knot = (at as usize).min(KNOTS - 2);
        Self { knot, share: at - knot as f64 }
    }

    /// The height of a curve, whose knots begin the list.
    fn on(self, knots: &[f64]) -> f64 {
        (1.0 - self.share) * knots[self.knot] + self.share * knots[self.knot + 1]
    }
}

/// How the logarithm of one algorithm's cost under one load hangs on its entries of the state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slope {
    algorithm: usize,
    place: Place,
    /// Shares of the cost by kind of term.
    terms: [f64; KINDS],
}

impl Slope {
    /// What a change of the whole state, or a row of its covariance, means for this logarithm.
    pub(super) fn along(&self, state: &[f64]) -> f64 {
        let (knots, factors) = state[self.algorithm * STRIDE..][..STRIDE].split_at(KNOTS);
        self.place.on(knots) + self.terms.iter().zip(factors).map(|(share, factor)| share * factor).sum::<f64>()
    }

    /// The entries of the state that count, with their weights.
    fn weights(&self) -> impl Iterator<Item = (usize, f64)> {
        let from = self.algorithm * STRIDE;
        let Place { knot, share } = self.place;
        let terms = self.terms.into_iter().enumerate().map(move |(k, share)| (from + KNOTS + k, share));
        [(from + knot, 1.0 - share), (from + knot + 1, share)].into_iter().chain(terms).filter(|w| w.1 != 0.0)
    }
}

impl Posterior {
    /// What is known before anything was observed.
    #[must_use]
    pub fn new(costs: Vec<AlgorithmCost>, prior: &Prior) -> Self {
        let dimension = costs.len() * STRIDE;
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
    /// Returns false, and learns nothing, where the time is no positive number, the predicted cost is none, there is no such algorithm, or the
    /// prior is unsound.
    pub fn observe(&mut self, algorithm: usize, load: &Load, ns: f64, noise_ln: f64) -> bool {
        if algorithm >= self.costs.len() {
            return false;
        }
        let (mean_ln, slope) = self.look(algorithm, &Counts::new(load));
        let surprise = ns.ln() - mean_ln;
        if !(surprise.is_finite() && noise_ln.is_finite()) {
            return false;
        }
        let mut with = std::mem::take(&mut self.with);
        let variance = self.covariances(&slope, noise_ln, &mut with);
        // A prior that holds no sound figures.
        if !(variance.is_finite() && variance > 0.0) {
            self.with = with;
            return false;
        }
        let scale = 1.0 / variance;
        let error = surprise.clamp(-MOST_SURPRISE * variance.sqrt(), MOST_SURPRISE * variance.sqrt());
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

    /// Fills `with` with the covariance of each entry of the state with an observation, and returns the variance of that observation.
    pub(super) fn covariances(&self, slope: &Slope, noise_ln: f64, with: &mut [f64]) -> f64 {
        with.fill(0.0);
        for (entry, weight) in slope.weights() {
            let row = &self.covariance[entry * with.len()..][..with.len()];
            with.iter_mut().zip(row).for_each(|(w, c)| *w += weight * c);
        }
        slope.along(with).max(0.0) + self.noise(slope.algorithm, noise_ln)
    }

    /// Expected natural logarithm of an algorithm's nanoseconds, infinite where there is none, and how it hangs on the state.
    pub(super) fn look(&self, algorithm: usize, counts: &Counts<'_>) -> (f64, Slope) {
        let curve = &self.costs[algorithm].curve;
        let (knots, factors) = self.mean[algorithm * STRIDE..][..STRIDE].split_at(KNOTS);
        let place = Place::of(counts.log2_objects());
        let cost = |terms: &[CostTerm]| {
            let (mut sum, mut parts) = (0.0, [0.0; KINDS]);
            for t in terms {
                let k = position(t.term);
                let ns = t.unit_ns * counts.of(t.term, curve.cache_bytes) * term_factor(factors[k]);
                sum += ns;
                parts[k] += ns;
            }
            (sum, parts)
        };
        let (mut sum, mut parts) = cost(&curve.terms);
        if !curve.fallback_terms.is_empty() {
            let other = cost(&curve.fallback_terms);
            if other.0 < sum {
                (sum, parts) = other;
            }
        }
        let mean_ln = sum.ln() + curve.ln_correction(counts.log2_objects()) + place.on(knots);
        if !mean_ln.is_finite() {
            return (f64::INFINITY, Slope { algorithm, place, terms: [0.0; KINDS] });
        }
        (mean_ln, Slope { algorithm, place, terms: parts.map(|part| part / sum) })
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
        let dimension = costs.len() * STRIDE;
        for (a, one) in costs.iter().enumerate() {
            let class = one.algorithm.backend().class();
            let deviations = prior.of(class);
            for (b, other) in costs.iter().enumerate().filter(|(_, c)| c.algorithm.backend().class() == class) {
                let mut back = |k: usize, l: usize, before: f64| {
                    let entry = &mut covariance[(a * STRIDE + k) * dimension + b * STRIDE + l];
                    *entry += share * (before - *entry);
                };
                let apart: [f64; KNOTS] =
                    std::array::from_fn(|k| deviations.covariance(&one.algorithm, &other.algorithm, k as f64 * OCTAVES));
                for k in 0..STRIDE {
                    for l in 0..STRIDE {
                        let before = match (k < KNOTS, l < KNOTS) {
                            (true, true) => apart[k.abs_diff(l)],
                            (false, false) if k == l => deviations.covariance_of_terms(
                                Term::ALL.get(k - KNOTS).copied(),
                                &one.algorithm,
                                &other.algorithm,
                            ),
                            _ => 0.0,
                        };
                        back(k, l, before);
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
            let (knots, factors) = self.mean[a * STRIDE..][..STRIDE].split_at(KNOTS);
            cost.curve.correction = cost.curve.corrected_by(own, |log2_objects| Place::of(log2_objects).on(knots));
            for term in cost.curve.terms.iter_mut().chain(&mut cost.curve.fallback_terms) {
                let factor = term_factor(factors[position(term.term)]);
                term.unit_ns = (term.unit_ns * factor).min(MOST_UNIT_NS);
            }
            cost.spread_ln = self.spread_ln(a);
            cost
        };
        self.costs.iter().enumerate().map(corrected).collect()
    }

    /// Root of the mean variance of an algorithm's logarithmic cost, noise included: over the knots, and at each over its terms, as
    /// if one of them had all the time.
    fn spread_ln(&self, algorithm: usize) -> f64 {
        let at = |i: usize, j: usize| self.covariance[(algorithm * STRIDE + i) * self.mean.len() + algorithm * STRIDE + j];
        let terms = &self.costs[algorithm].curve.terms;
        let sum: f64 = terms
            .iter()
            .map(|t| KNOTS + position(t.term))
            .flat_map(|t| (0..KNOTS).map(move |k| (k, t)))
            .map(|(k, t)| (at(k, k) + at(t, t) + 2.0 * at(k, t)).max(0.0))
            .sum();
        (sum / (terms.len() * KNOTS).max(1) as f64 + self.noise(algorithm, 0.0)).sqrt()
    }

    /// Expected logarithms of the costs under a load, and how they hang together. `joint` keeps its memory.
    ///
    /// The noise of single observations is not in it: what is uncertain here is the curve.
    pub fn joint(&self, load: &Load, joint: &mut Joint) {
        let counts = Counts::new(load);
        let Joint { mean_ln, covariance, slopes, with } = joint;
        mean_ln.clear();
        slopes.clear();
        for a in 0..self.costs.len() {
            let (ln, slope) = self.look(a, &counts);
            mean_ln.push(ln);
            slopes.push(slope);
        }
        covariance.clear();
        with.resize(self.mean.len(), 0.0);
        for a in &*slopes {
            self.covariances(a, 0.0, with);
            covariance.extend(slopes.iter().map(|b| b.along(with)));
        }
    }
}

/// Which kind a term is.
fn position(term: Term) -> usize {
    Term::ALL.iter().position(|t| *t == term).unwrap_or(Term::ALL.len())
}

/// The factor on a term, from its logarithm in the state.
fn term_factor(ln: f64) -> f64 {
    ln.clamp(-MOST_TERM_FACTOR_LN, MOST_TERM_FACTOR_LN).exp()
}

#[cfg(test)]
mod tests;
