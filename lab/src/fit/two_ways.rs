//! Costs of an algorithm that has two ways to do the same and goes the cheaper one.

use super::robust::{Problem, weighted_median};
use ndarray::Array1;

/// Rounds of telling which row went which way; the answer stands still after two or three.
const ROUNDS: usize = 4;
/// Logarithm of the time over that of the other way within which a row is first taken to have gone it.
const LIKE: f64 = 0.2;
/// What the other way costs over the algorithm that it is, where no row went it: what a look at the boxes costs.
const USUAL_FACTOR: f64 = 1.05;
/// Bounds of that factor. Beyond them it is not that way.
const FACTORS: (f64, f64) = (0.8, 1.5);

/// What was fitted.
#[derive(Debug, Clone)]
pub(crate) struct TwoWays {
    /// Units of the terms of the first way.
    pub(crate) units: Vec<f64>,
    /// Cost of the second way over that of the algorithm that it is.
    pub(crate) factor: f64,
}

impl TwoWays {
    /// Fits the first way to the rows that went it, and a factor to the others. `other_ns` is for each row what the algorithm costs that
    /// the second way is.
    ///
    /// A sum of both ways' terms would charge every frame for both. A row that went the second way is a lower bound for the first.
    pub(crate) fn fit(problem: &Problem, other_ns: &[f64]) -> Self {
        let rows = problem.ns.len();
        let off = |k: usize, modelled: f64| (problem.ns[k] / modelled.max(1e-9)).ln().abs();
        let mut other: Vec<bool> = (0..rows).map(|k| !problem.floors[k] && off(k, other_ns[k]) < LIKE).collect();
        let mut found = Self { units: Vec::new(), factor: USUAL_FACTOR };
        for _ in 0..ROUNDS {
            let went = |k: &usize| other[*k];
            let ratios = (0..rows).filter(went).map(|k| (problem.ns[k] / other_ns[k], problem.weights[k])).collect();
            found.factor = weighted_median(ratios).unwrap_or(USUAL_FACTOR).clamp(FACTORS.0, FACTORS.1);
            let floors = (0..rows).map(|k| problem.floors[k] || other[k]).collect();
            found.units = Problem { floors, ..problem.clone() }.units();
            let first = problem.terms.dot(&Array1::from(found.units.clone()));
            let now: Vec<bool> =
                (0..rows).map(|k| !problem.floors[k] && off(k, other_ns[k] * found.factor) < off(k, first[k])).collect();
            if now == other {
                break;
            }
            // All rows of one way leave nothing to fit the first way to.
            if now.iter().zip(&problem.floors).all(|(other, floor)| *other || *floor) {
                break;
            }
            other = now;
        }
        found
    }

    /// What each row costs.
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
    fn rows_are_told_apart_and_each_way_is_found() {
        let n = |k: usize| 2.0_f64.powf(4.0 + 0.25 * (k / 2) as f64);
        let moved = |k: usize| [0.02, 1.0][k % 2];
        let other: Vec<f64> = (0..60).map(|k| 3000.0 + 40.0 * n(k)).collect();
        let first = |k: usize| 200.0 + 8.0 * n(k) + 130.0 * n(k) * moved(k);
        let problem = Problem {
            terms: Array2::from_shape_fn((60, 3), |(k, j)| [1.0, n(k), n(k) * moved(k)][j]),
            ns: (0..60).map(|k| first(k).min(1.1 * other[k])).collect(),
            weights: vec![1.0; 60],
            floors: vec![false; 60],
            groups: vec![0; 60],
        };
        let found = TwoWays::fit(&problem, &other);
        assert!((found.factor - 1.1).abs() < 0.01, "{found:?}");
        let expected = [200.0, 8.0, 130.0];
        assert!(found.units.iter().zip(expected).all(|(u, e)| (u / e - 1.0).abs() < 0.02), "{found:?}");
        let modelled = found.modelled(&problem, &other);
        assert!(modelled.iter().zip(&problem.ns).all(|(m, t)| (m / t - 1.0).abs() < 0.02));
        // One sum for both ways misses by far more.
        let sum = problem.terms.dot(&Array1::from(problem.units()));
        assert!(sum.iter().zip(&problem.ns).any(|(m, t)| (m / t).ln().abs() > 0.3));
    }
}
