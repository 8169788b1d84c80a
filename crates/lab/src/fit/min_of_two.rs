//! The cost of an algorithm that falls back to another one when that is cheaper: the smaller of two costs.

use crate::fit::robust::{Problem, weighted_median};
use ndarray::Array1;

/// Rounds of deciding which rows fell back. The answer no longer changes after two or three.
const ROUNDS: usize = 4;
/// A row is first assumed to have fallen back if the logarithm of its time over that of the fallback is within this.
const LIKE: f64 = 0.2;
/// Cost of falling back over that of the other algorithm, when no row shows it: it looks at the boxes once more.
const USUAL_FACTOR: f64 = 1.05;
/// Bounds of that factor. Falling back costs no less than the other algorithm, and a row above the upper bound did
/// not fall back.
const FACTORS: (f64, f64) = (1.0, 1.5);

/// The fit.
#[derive(Debug, Clone)]
pub(crate) struct MinOfTwo {
    /// Units of the terms of the algorithm's own method.
    pub(crate) units: Vec<f64>,
    /// Cost of falling back over that of the other algorithm.
    pub(crate) factor: f64,
}

impl MinOfTwo {
    /// Fits the own terms to the rows that did not fall back, and a factor to the others. `other_ns` is the cost of
    /// the other algorithm in each row.
    ///
    /// A sum of the terms of both would charge every frame for both. A row that fell back is a lower bound for the
    /// own terms.
    pub(crate) fn fit(problem: &Problem, other_ns: &[f64]) -> Self {
        let rows = problem.ns.len();
        let off = |k: usize, modelled: f64| (problem.ns[k] / modelled.max(1e-9)).ln().abs();
        let mut other: Vec<bool> = (0..rows).map(|k| !problem.floors[k] && off(k, other_ns[k]) < LIKE).collect();
        let mut found = Self { units: Vec::new(), factor: USUAL_FACTOR };
        for _ in 0..ROUNDS {
            let went = |k: &usize| other[*k];
            let ratios = (0..rows).filter(went).map(|k| (problem.ns[k] / other_ns[k], problem.weights[k])).collect();
            found.factor = weighted_median(ratios).unwrap_or(USUAL_FACTOR).clamp(FACTORS.0, FACTORS.1);
            let floors: Vec<bool> = (0..rows).map(|k| problem.floors[k] || other[k]).collect();
            found.units = problem.units_with(&floors);
            let first = problem.terms.dot(&Array1::from(found.units.clone()));
            let now: Vec<bool> = (0..rows)
                .map(|k| !problem.floors[k] && off(k, other_ns[k] * found.factor) < off(k, first[k]))
                .collect();
            if now == other {
                break;
            }
            // If all rows fell back, there is nothing to fit the own terms to.
            if now.iter().zip(&problem.floors).all(|(other, floor)| *other || *floor) {
                break;
            }
            other = now;
        }
        found
    }

    /// Returns the modelled cost of each row.
    pub(crate) fn modelled(&self, problem: &Problem, other_ns: &[f64]) -> Array1<f64> {
        let mut modelled = problem.terms.dot(&Array1::from(self.units.clone()));
        modelled.iter_mut().zip(other_ns).for_each(|(first, other)| *first = first.min(self.factor * other));
        modelled
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    #[test]
    fn rows_are_told_apart_and_both_costs_are_found() {
        let n = |k: usize| 2.0_f64.powf(4.0 + 0.25 * (k / 2) as f64);
        let moved = |k: usize| [0.02, 1.0][k % 2];
        let other: Vec<f64> = (0..60).map(|k| 3000.0 + 40.0 * n(k)).collect();
        let first = |k: usize| 200.0 + 8.0 * n(k) + 130.0 * n(k) * moved(k);
        let problem = Problem {
            terms: Array2::from_shape_fn((60, 3), |(k, j)| [1.0, n(k), n(k) * moved(k)][j]),
            ns: (0..60).map(|k| first(k).min(1.1 * other[k])).collect(),
            weights: vec![1.0; 60],
            floors: vec![false; 60],
        };
        let found = MinOfTwo::fit(&problem, &other);
        assert!((found.factor - 1.1).abs() < 0.01, "{found:?}");
        let expected = [200.0, 8.0, 130.0];
        assert!(found.units.iter().zip(expected).all(|(u, e)| (u / e - 1.0).abs() < 0.02), "{found:?}");
        let modelled = found.modelled(&problem, &other);
        assert!(modelled.iter().zip(&problem.ns).all(|(m, t)| (m / t - 1.0).abs() < 0.02));
        // One sum for both misses by far more.
        let sum = problem.terms.dot(&Array1::from(problem.units()));
        assert!(sum.iter().zip(&problem.ns).any(|(m, t)| (m / t).ln().abs() > 0.3));
    }
}
