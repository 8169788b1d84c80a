//! What the physical terms leave unexplained: a ridge regression on a few features.

use crate::fit::columns::Columns;
use anyhow::{Context, Result};
use linfa_linalg::cholesky::SolveCInplace;
use ndarray::{Array1, Array2, Axis};
use sapwise::model::{Feature, ResidualTerm};

/// Penalties to choose from, against standardised features: slopes shrink by about 1 / (1 + penalty).
const PENALTIES: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
/// The penalty where there are too few machines to choose one by leaving them out.
const DEFAULT_PENALTY: f64 = 0.1;
/// Machines that it takes to choose the penalty.
const FEWEST_GROUPS: usize = 3;
/// Machines that are held out one by one for that; of more, as many groups are made of them.
const MOST_FOLDS: usize = 8;
/// Rows that the choice looks at: the four penalties are far apart, and each takes a fit for each fold.
const SEARCH_ROWS: usize = 1500;

/// Natural logarithms of measured over modelled time, and what they may depend on.
pub(crate) struct Residuals {
    /// What each column of `features` is.
    pub(crate) names: &'static [Feature],
    /// Shape (rows, names).
    pub(crate) features: Array2<f64>,
    /// One for each row.
    pub(crate) ln_ratios: Vec<f64>,
    /// One for each row, above zero.
    pub(crate) weights: Vec<f64>,
    /// The physical machine of each row.
    pub(crate) groups: Vec<usize>,
}

/// A fitted residual.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ridge {
    /// The residual where every feature is at its mean.
    pub(crate) intercept: f64,
    /// The slopes, in units of the features.
    pub(crate) terms: Vec<ResidualTerm>,
}

impl Residuals {
    /// The ridge with the penalty that does best on machines that were held out of it, one after the other or of many some at a
    /// time, or with 0.1 where there are fewer than three. Only this residual is fitted again for that choice, not the terms
    /// behind it, and of many rows some.
    ///
    /// # Errors
    /// When the system of a fit can't be solved.
    pub(crate) fn ridge(&self) -> Result<Ridge> {
        let mut groups = self.groups.clone();
        groups.sort_unstable();
        groups.dedup();
        let mut best = (f64::INFINITY, DEFAULT_PENALTY);
        if groups.len() >= FEWEST_GROUPS {
            let step = self.ln_ratios.len().div_ceil(SEARCH_ROWS);
            let some: Vec<usize> = (0..self.ln_ratios.len()).step_by(step).collect();
            let fold = |k: usize| groups.partition_point(|g| *g < self.groups[k]) % MOST_FOLDS;
            for penalty in PENALTIES {
                let mut error = 0.0;
                for left_out in 0..groups.len().min(MOST_FOLDS) {
                    let (held, rest): (Vec<usize>, Vec<usize>) = some.iter().partition(|k| fold(**k) == left_out);
                    if !rest.is_empty() {
                        error += self.error_on(&held, &self.fit(&rest, penalty)?);
                    }
                }
                if error < best.0 {
                    best = (error, penalty);
                }
            }
        }
        let all: Vec<usize> = (0..self.ln_ratios.len()).collect();
        self.fit(&all, best.1)
    }

    /// Weighted squared error of a ridge on some rows.
    fn error_on(&self, rows: &[usize], ridge: &Ridge) -> f64 {
        rows.iter().map(|&k| self.weights[k] * (self.ln_ratios[k] - self.at(ridge, k)).powi(2)).sum()
    }

    /// The ridge of one penalty over some rows.
    pub(crate) fn fit(&self, rows: &[usize], penalty: f64) -> Result<Ridge> {
        let weights: Vec<f64> = rows.iter().map(|&k| self.weights[k]).collect();
        let columns = Columns::new(&self.features.select(Axis(0), rows), &weights).without_lone_rows();
        let targets: Vec<f64> = rows.iter().map(|&k| self.ln_ratios[k]).collect();
        let total: f64 = weights.iter().sum();
        let intercept = targets.iter().zip(&weights).map(|(y, w)| y * w).sum::<f64>() / total;
        if columns.kept.is_empty() {
            return Ok(Ridge { intercept, terms: Vec::new() });
        }
        let centred = targets.iter().map(|y| y - intercept).collect();
        let slopes = weighted_ridge(&columns.values, &centred, &weights, penalty)?;
        let term = |j: usize| ResidualTerm {
            feature: self.names[columns.kept[j]],
            centre: columns.centres[j],
            slope: slopes[j] / columns.scales[j],
        };
        Ok(Ridge { intercept, terms: (0..columns.kept.len()).map(term).collect() })
    }

    /// A residual in one of the rows.
    pub(crate) fn at(&self, ridge: &Ridge, row: usize) -> f64 {
        let position = |t: &ResidualTerm| self.names.iter().position(|f| *f == t.feature);
        let value = |t: &ResidualTerm| position(t).map_or(0.0, |j| self.features[[row, j]]);
        ridge.intercept + ridge.terms.iter().map(|t| t.slope * (value(t) - t.centre)).sum::<f64>()
    }
}

/// The slopes that make half of the weighted mean of the squared errors plus half of the penalty times the sum of their squares least: one
/// for each column of `x`. Columns and targets are centred under the weights, so that no intercept is left to fit.
fn weighted_ridge(x: &Array2<f64>, y: &Array1<f64>, weights: &[f64], penalty: f64) -> Result<Array1<f64>> {
    let total: f64 = weights.iter().sum();
    let shares = Array1::from_iter(weights.iter().map(|w| w / total));
    let weighted = x * &shares.insert_axis(Axis(1));
    let mut normal = weighted.t().dot(x) + penalty * Array2::<f64>::eye(x.ncols());
    let right = weighted.t().dot(y).insert_axis(Axis(1));
    // Positive definite by the penalty.
    let slopes = normal.solvec_into(right).context("the ridge regression of the residual failed")?;
    Ok(slopes.remove_axis(Axis(1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{Machine, truth};
    use sapwise::model::{MethodModel, ModelTerm, Scale};
    use sapwise::{Backend, BackendClass, Load, Term};
    use sapwise_scenes::Random;

    fn residuals(rows: usize) -> Residuals {
        let mut random = Random::named(11, &[]);
        let features = Array2::from_shape_fn((rows, 4), |(k, j)| {
            let octaves = 4.0 + (k % 13) as f64;
            [octaves, octaves * octaves, [2.0, 3.0, 4.0][k % 3], (k % 4) as f64][j]
        });
        let ln_ratios =
            (0..rows).map(|k| 0.2 + 0.03 * features[[k, 0]] - 0.1 * features[[k, 2]] + 0.01 * random.normal()).collect();
        Residuals {
            names: Feature::of(BackendClass::Cpu),
            features,
            ln_ratios,
            weights: (0..rows).map(|k| 1.0 + (k % 2) as f64).collect(),
            groups: vec![0; rows],
        }
    }

    #[test]
    fn the_slopes_are_where_the_penalised_error_is_least() {
        let data = residuals(120);
        let columns = Columns::new(&data.features, &data.weights);
        let total: f64 = data.weights.iter().sum();
        let mean = data.ln_ratios.iter().zip(&data.weights).map(|(y, w)| y * w).sum::<f64>() / total;
        let centred: Array1<f64> = data.ln_ratios.iter().map(|y| y - mean).collect();
        let slopes = weighted_ridge(&columns.values, &centred, &data.weights, 0.1).unwrap();
        let left = &centred - &columns.values.dot(&slopes);
        let weighted = Array1::from_iter(left.iter().zip(&data.weights).map(|(e, w)| e * w / total));
        let gradient = columns.values.t().dot(&weighted) - 0.1 * &slopes;
        assert!(slopes.len() == 4 && gradient.iter().all(|g| g.abs() < 1e-12), "{gradient}");
    }

    #[test]
    fn the_library_evaluates_a_stored_residual_as_it_was_fitted() {
        let machine = &Machine::family()[3];
        let threads = |k: usize| Backend::Cpu(1 << (k % 4));
        let load = |k: usize| Load::of_objects(1 << (4 + k % 13));
        let names = Feature::of(BackendClass::Cpu);
        let features = Array2::from_shape_fn((52, names.len()), |(k, j)| {
            names[j].value(&machine.hardware(), &threads(k), &load(k)).unwrap()
        });
        let ln_ratios = features.rows().into_iter().map(|f| 0.3 - 0.05 * f[0] + 0.004 * f[1] + 0.1 * f[3]).collect();
        let data = Residuals { names, features, ln_ratios, weights: vec![1.0; 52], groups: vec![0; 52] };
        let ridge = data.ridge().unwrap();
        let terms = vec![ModelTerm { term: Term::Objects, scale: Scale::Cycle, unit: 2.0 }];
        let mut bare = truth().remove(0);
        bare.terms = terms;
        let mut full = bare.clone();
        (full.residual_intercept, full.residual) = (ridge.intercept, ridge.terms.clone());
        for k in 0..52 {
            let cost = |m: &MethodModel| m.curve(&machine.hardware(), &threads(k)).unwrap().cost_ns(&load(k));
            let residual = (cost(&full) / cost(&bare)).ln();
            assert!((residual - data.at(&ridge, k)).abs() < 1e-9, "{residual} {}", data.at(&ridge, k));
        }
    }

    #[test]
    fn a_small_penalty_finds_the_slopes_and_a_machine_held_out_chooses_it() {
        let mut data = residuals(240);
        data.groups = (0..240).map(|k| k / 60).collect();
        let ridge = data.ridge().unwrap();
        let error: f64 = (0..240).map(|k| (data.at(&ridge, k) - data.ln_ratios[k]).powi(2)).sum();
        assert!((error / 240.0).sqrt() < 0.02, "{error} {ridge:?}");
    }

    #[test]
    fn features_that_do_not_vary_are_dropped() {
        let mut data = residuals(60);
        data.features.column_mut(2).fill(3.0);
        data.features.column_mut(3).fill(0.0);
        let ridge = data.ridge().unwrap();
        assert!(ridge.terms.iter().all(|t| matches!(t.feature, Feature::Log2Objects | Feature::Log2ObjectsSquared)));
    }
}
