//! Cost terms fitted to times: non-negative, on logarithmic error, with outliers held back.

use crate::fit::nnls::nnls;
use ndarray::{Array1, Array2};
use sapwise_tune::stats::robust_deviation;

/// Times and the terms that should add up to them.
#[derive(Debug, Clone)]
pub(crate) struct Problem {
    /// Nanoseconds for one unit of each term, shape (rows, terms), best column by column in memory.
    pub(crate) terms: Array2<f64>,
    /// Nanoseconds of each row, above zero.
    pub(crate) ns: Vec<f64>,
    /// Weight of each row.
    pub(crate) weights: Vec<f64>,
    /// Rows whose time is a lower bound: they count only while the sum stays below it.
    pub(crate) floors: Vec<bool>,
}

/// Rounds of reweighting, at most.
const ROUNDS: usize = 15;
/// The iteration ends when no modelled row changes by more than this share.
const STILL: f64 = 1e-4;
/// Residuals beyond this many standard deviations count linearly: Huber's constant for 95 % efficiency.
const HUBER: f64 = 1.345;
/// Least spread, so that a perfect fit does not turn rounding errors into outliers.
const SMALLEST_SPREAD: f64 = 1e-3;

impl Problem {
    /// Returns the units of the terms, none negative; zero for a term that explains nothing.
    ///
    /// Rows are divided by their time, so that the error is relative. A relative error is never below -1 and would
    /// pull every fit down. Reweighting by `ln q / (q (q - 1))`, where `q` is modelled over measured time, makes the
    /// fixed point that of least squares on `ln q`. Outliers get Huber's weight on top.
    pub(crate) fn units(&self) -> Vec<f64> {
        self.units_with(&self.floors)
    }

    /// Does the same with other rows whose time is a lower bound.
    pub(crate) fn units_with(&self, floors: &[bool]) -> Vec<f64> {
        // The first round leaves out the lower bounds.
        let mut weights: Vec<f64> =
            self.weights.iter().zip(floors).map(|(weight, floor)| if *floor { 0.0 } else { *weight }).collect();
        let mut violated = vec![false; self.ns.len()];
        let mut units = Array1::zeros(self.terms.ncols());
        let mut before = Array1::zeros(self.ns.len());
        for _ in 0..ROUNDS {
            units = self.weighted(&weights);
            let modelled = self.terms.dot(&units);
            let moved = |(now, before): (&f64, &f64)| (now - before).abs() > STILL * now.abs();
            if !modelled.iter().zip(&before).any(moved) {
                break;
            }
            weights = self.reweighted(&modelled, floors, &mut violated);
            before = modelled;
        }
        units.to_vec()
    }

    /// Returns the weights of the next round.
    fn reweighted(&self, modelled: &Array1<f64>, floors: &[bool], violated: &mut [bool]) -> Vec<f64> {
        let ratios: Vec<f64> = modelled.iter().zip(&self.ns).map(|(m, t)| (m / t).max(1e-9)).collect();
        let ln: Vec<f64> = ratios.iter().map(|q| q.ln()).collect();
        let measured = ln.iter().zip(floors).filter(|(_, f)| !**f).map(|(ln, _)| *ln);
        let spread = robust_deviation(&measured.collect::<Vec<f64>>()).unwrap_or(0.0).max(SMALLEST_SPREAD);
        let weight = |(k, &q): (usize, &f64)| {
            let weight = self.weights[k] * to_logarithmic(q, ln[k]);
            if floors[k] {
                violated[k] |= q < 1.0;
                // A violated bound holds until it is cleared by a margin, or it would come and go every round.
                weight * if violated[k] && q < 1.5 { 1.0 } else { 0.0 }
            } else {
                weight * (HUBER * spread / ln[k].abs()).min(1.0)
            }
        };
        ratios.iter().enumerate().map(weight).collect()
    }

    fn weighted(&self, weights: &[f64]) -> Array1<f64> {
        let right: Array1<f64> = weights.iter().map(|w| w.sqrt()).collect();
        let scale: Array1<f64> = right.iter().zip(&self.ns).map(|(root, ns)| root / ns).collect();
        let mut a = self.terms.clone();
        a.columns_mut().into_iter().for_each(|mut column| column *= &scale);
        nnls(&a, &right)
    }
}

/// Returns the weight that turns a relative error into a logarithmic one, at a ratio of modelled to measured time and
/// its logarithm.
fn to_logarithmic(q: f64, ln: f64) -> f64 {
    if (q - 1.0).abs() < 1e-6 {
        return 1.0;
    }
    // Bounded, so that a row that is far too low in an early round does not decide that round alone.
    (ln / (q * (q - 1.0))).min(10.0)
}

/// Returns the value at which half of the weight is reached, interpolated between the middles of neighbouring
/// weights, so that it moves without jumps as weights change.
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
        // Constant up to 128 objects, then only known to take at least a nanosecond an object.
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
