//! Cost terms fitted to times: non-negative, on logarithmic error, with outliers held back.

use crate::fit::nnls::nnls;
use ndarray::{Array1, Array2, Axis};
use sapwise::stats::robust_deviation;

/// Times and the terms that should add up to them.
#[derive(Debug, Clone)]
pub(crate) struct Problem {
    /// Nanoseconds for one unit of each term, shape (rows, terms).
    pub(crate) terms: Array2<f64>,
    /// Nanoseconds of each row, above zero.
    pub(crate) ns: Vec<f64>,
    /// Weight of each row.
    pub(crate) weights: Vec<f64>,
    /// Rows whose time is a lower bound and not a measurement: they count only while the sum stays below.
    pub(crate) floors: Vec<bool>,
    /// The profile of each row.
    pub(crate) groups: Vec<usize>,
}

/// Rounds of reweighting, at most. The units stop moving in the fourth digit after about eight.
const ROUNDS: usize = 15;
/// The units stand still when no row is modelled differently by more than this share.
const STILL: f64 = 1e-9;
/// Rows that the search for a start looks at: which of the ends is nearest to the truth shows in few.
const START_ROWS: usize = 600;
/// Logarithmic error from which on it counts linearly where ends are compared: a factor of 1.65.
const FAR: f64 = 0.5;
/// Profiles that are left out of a start, at most: with many of them no single one takes the start with it.
const MOST_STARTS: usize = 16;
/// Residuals beyond this many standard deviations count linearly (Huber's constant for 95 % efficiency).
pub(crate) const HUBER: f64 = 1.345;
/// A spread below this is taken for this, so that a perfect fit does not turn rounding errors into outliers.
const SMALLEST_SPREAD: f64 = 1e-3;

impl Problem {
    /// The units of the terms, none negative; the unit of a term that explains nothing is zero.
    ///
    /// Rows are divided by their time, so that the error is relative. A relative error can't be below -1 and would pull every
    /// fit down; reweighting by `ln q / (q (q - 1))`, `q` being modelled over measured time, makes the fixed point that
    /// of least squares on `ln q`. Outliers get Huber's weight on top of it.
    ///
    /// Reweighting ends at the fixed point nearest to its start, and a profile whose fork and join was measured hundreds of
    /// times too long, as under contention, can take the start with it. So it starts from all profiles and from all but each
    /// one, and the end with the least error is taken.
    pub(crate) fn units(&self) -> Vec<f64> {
        let profiles = self.profiles();
        if profiles.len() < 2 {
            return self.polished(self.start(None));
        }
        let few = self.some();
        let without = profiles.iter().step_by(profiles.len().div_ceil(MOST_STARTS)).map(|&p| Some(p));
        let starts = std::iter::once(None).chain(without);
        let scored = starts.map(|left_out| (few.error(&few.polished(few.start(left_out))), left_out));
        let best = scored.min_by(|a, b| a.0.total_cmp(&b.0)).and_then(|best| best.1);
        // Not from where the few rows ended: what they tell little of would hold back the rows that tell more as outliers.
        self.polished(self.start(best))
    }

    /// The profiles that have rows, each once.
    fn profiles(&self) -> Vec<usize> {
        let mut profiles = self.groups.clone();
        profiles.sort_unstable();
        profiles.dedup();
        profiles
    }

    /// The same problem with some of its rows, evenly spaced.
    fn some(&self) -> Self {
        let step = self.ns.len().div_ceil(START_ROWS).max(1);
        let rows: Vec<usize> = (0..self.ns.len()).step_by(step).collect();
        Self {
            terms: self.terms.select(Axis(0), &rows),
            ns: rows.iter().map(|&k| self.ns[k]).collect(),
            weights: rows.iter().map(|&k| self.weights[k]).collect(),
            floors: rows.iter().map(|&k| self.floors[k]).collect(),
            groups: rows.iter().map(|&k| self.groups[k]).collect(),
        }
    }

    /// Weighted error of the measured rows on logarithms, quadratic up to [`FAR`] and linear beyond.
    fn error(&self, units: &[f64]) -> f64 {
        let modelled = self.terms.dot(&Array1::from(units.to_vec()));
        let row = |k: usize| {
            let off = (modelled[k] / self.ns[k]).max(1e-9).ln().abs();
            let off = if self.floors[k] && modelled[k] >= self.ns[k] { 0.0 } else { off };
            self.weights[k] * if off < FAR { off * off } else { FAR * (2.0 * off - FAR) }
        };
        (0..self.ns.len()).map(row).sum()
    }

    /// Weights of the first round: every measured row, but for those of a profile that is left out.
    fn start(&self, left_out: Option<usize>) -> Vec<f64> {
        let start = |k: usize| if self.floors[k] || left_out == Some(self.groups[k]) { 0.0 } else { self.weights[k] };
        (0..self.ns.len()).map(start).collect()
    }

    /// The fixed point of reweighting that is nearest to the fit under these weights.
    fn polished(&self, mut weights: Vec<f64>) -> Vec<f64> {
        let mut violated = vec![false; self.ns.len()];
        let mut units = Vec::new();
        let mut before = Array1::zeros(self.ns.len());
        for _ in 0..ROUNDS {
            units = self.weighted(&weights).to_vec();
            let modelled = self.terms.dot(&Array1::from(units.clone()));
            let moved = modelled
                .iter()
                .zip(&before)
                .any(|(now, before): (&f64, &f64)| (now - before).abs() > STILL * now.abs());
            if !moved {
                break;
            }
            before = modelled;
            weights = self.reweighted(&units, &mut violated);
        }
        units
    }

    /// The weights of the next round, after these units.
    fn reweighted(&self, units: &[f64], violated: &mut [bool]) -> Vec<f64> {
        let modelled = self.terms.dot(&Array1::from(units.to_vec()));
        let ratios: Vec<f64> = modelled.iter().zip(&self.ns).map(|(m, t)| (m / t).max(1e-9)).collect();
        let measured = ratios.iter().zip(&self.floors).filter(|(_, f)| !**f).map(|(q, _)| q.ln());
        let spread = robust_deviation(&measured.collect::<Vec<f64>>()).unwrap_or(0.0).max(SMALLEST_SPREAD);
        let weight = |(k, &q): (usize, &f64)| {
            let weight = self.weights[k] * to_logarithmic(q);
            if self.floors[k] {
                violated[k] |= q < 1.0;
                // Once violated a floor holds until it is cleared by a margin, or it would come and go every round.
                weight * if violated[k] && q < 1.5 { 1.0 } else { 0.0 }
            } else {
                weight * (HUBER * spread / q.ln().abs()).min(1.0)
            }
        };
        ratios.iter().enumerate().map(weight).collect()
    }

    fn weighted(&self, weights: &[f64]) -> Array1<f64> {
        let scale = |k: usize| weights[k].sqrt() / self.ns[k];
        let mut a = self.terms.clone();
        for (k, mut row) in a.rows_mut().into_iter().enumerate() {
            row *= scale(k);
        }
        nnls(&a, &Array1::from_shape_fn(self.ns.len(), |k| scale(k) * self.ns[k]))
    }
}

fn to_logarithmic(q: f64) -> f64 {
    if (q - 1.0).abs() < 1e-6 {
        return 1.0;
    }
    // Bounded above, so that a row that is far too low in an early round does not decide that round alone.
    (q.ln() / (q * (q - 1.0))).min(10.0)
}

/// The value at which half of the weight is reached, interpolated between the middles of neighbouring weights, so that it
/// moves without jumps as weights change. `None` of none.
pub(crate) fn weighted_median(mut values: Vec<(f64, f64)>) -> Option<f64> {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = values.iter().map(|v| v.1).sum::<f64>() / 2.0;
    let mut before: Option<(f64, f64)> = None;
    let mut passed = 0.0;
    for (value, weight) in values {
        let middle = passed + weight / 2.0;
        if middle >= half {
            return Some(match before {
                Some((lower, at)) => lower + (value - lower) * (half - at) / (middle - at),
                None => value,
            });
        }
        before = Some((value, middle));
        passed += weight;
    }
    before.map(|b| b.0)
}

/// The least of values, which ascend and have weights, up to which at least this much weight is reached; `None` where all have less.
pub(crate) fn value_at_weight(values: &[(f64, f64)], weight: f64) -> Option<f64> {
    let mut passed = 0.0;
    let reached = values.iter().find(|v| {
        passed += v.1;
        passed >= weight
    });
    reached.map(|v| v.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_scenes::Random;

    #[test]
    fn weighted_medians_ignore_far_values_and_follow_weights() {
        assert_eq!(weighted_median(Vec::new()), None);
        assert_eq!(weighted_median(vec![(3.0, 1.0)]), Some(3.0));
        assert_eq!(weighted_median(vec![(1.0, 1.0), (9e9, 1.0), (2.0, 1.0)]), Some(2.0));
        assert_eq!(weighted_median(vec![(1.0, 1.0), (2.0, 1.0)]), Some(1.5));
        assert!(weighted_median(vec![(1.0, 9.0), (2.0, 1.0)]).unwrap() <= 1.1);
    }

    fn line(ns: impl Fn(f64) -> f64) -> Problem {
        let n = |k: usize| 2.0_f64.powf(4.0 + 0.5 * k as f64);
        Problem {
            terms: Array2::from_shape_fn((25, 2), |(k, j)| if j == 0 { 1.0 } else { n(k) }),
            ns: (0..25).map(|k| ns(n(k))).collect(),
            weights: vec![1.0; 25],
            floors: vec![false; 25],
            groups: vec![0; 25],
        }
    }

    #[test]
    fn exact_times_give_exact_units_and_outliers_are_held_back() {
        let units = line(|n| 500.0 + 3.0 * n).units();
        assert!((units[0] - 500.0).abs() < 1e-6 && (units[1] - 3.0).abs() < 1e-9, "{units:?}");
        let mut disturbed = line(|n| 500.0 + 3.0 * n);
        disturbed.ns[7] *= 4.0;
        disturbed.ns[20] *= 4.0;
        let units = disturbed.units();
        assert!((units[0] / 500.0 - 1.0).abs() < 0.02 && (units[1] / 3.0 - 1.0).abs() < 0.02, "{units:?}");
    }

    #[test]
    fn noise_does_not_pull_the_fit_down() {
        let mut random = Random::named(3, &[]);
        let mut noisy = line(|n| 3.0 * n);
        noisy.ns.iter_mut().for_each(|t| *t *= (0.3 * random.normal()).exp());
        let modelled = noisy.terms.dot(&Array1::from(noisy.units()));
        let mean: f64 = modelled.iter().zip(&noisy.ns).map(|(m, t)| (m / t).ln()).sum::<f64>() / 25.0;
        assert!(mean.abs() < 0.05, "{mean}");
    }

    #[test]
    fn a_floor_forces_growth_only_where_it_is_violated() {
        // Constant up to 128 objects, then dropped: at 65 536 it took at least 60 000.
        let mut dropped = line(|n| if n <= 128.0 { 500.0 } else { n });
        for k in 7..25 {
            dropped.floors[k] = true;
        }
        let units = dropped.units();
        let modelled = dropped.terms.dot(&Array1::from(units.clone()));
        assert!(modelled[24] > 0.5 * dropped.ns[24] && (modelled[0] / 500.0 - 1.0).abs() < 0.3, "{units:?}");
        let mut harmless = line(|n| 500.0 + 3.0 * n);
        harmless.ns[24] /= 10.0;
        harmless.floors[24] = true;
        assert!((harmless.units()[1] - 3.0).abs() < 1e-9);
    }
}
