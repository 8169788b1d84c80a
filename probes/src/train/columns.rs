//! Columns of a regression: standardised, and only those that say something of their own.

use ndarray::{Array1, Array2, ArrayView1};

/// Share of its variation that a column must have for itself, beside the columns before it.
const OWN_SHARE: f64 = 0.02;

/// Standardised columns of full rank. linfa answers without a warning when columns depend on each other, so whoever calls it
/// goes through this first.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    /// Positions of the columns that were kept, in the given order.
    pub(crate) kept: Vec<usize>,
    /// Mean of each kept column.
    pub(crate) centres: Vec<f64>,
    /// Standard deviation of each kept column, above zero.
    pub(crate) scales: Vec<f64>,
    /// The kept columns, less their mean, over their standard deviation; shape (rows, kept).
    pub(crate) values: Array2<f64>,
}

impl Columns {
    /// Standardises `values` of shape (rows, columns) under row weights with a sum above zero, and drops each column that
    /// does not vary or is a combination of those before it.
    pub(crate) fn new(values: &Array2<f64>, weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        let mean = |c: ArrayView1<'_, f64>| c.iter().zip(weights).map(|(v, w)| v * w).sum::<f64>() / total;
        let (mut kept, mut centres, mut scales) = (Vec::new(), Vec::new(), Vec::new());
        let mut standard: Vec<Array1<f64>> = Vec::new();
        // Orthogonal to each other under the weights, for the test of rank.
        let mut base: Vec<Array1<f64>> = Vec::new();
        let roots = Array1::from_iter(weights.iter().map(|w| (w / total).sqrt()));
        for (k, column) in values.columns().into_iter().enumerate() {
            let centre = mean(column);
            let scale = mean(column.mapv(|v| (v - centre).powi(2)).view()).sqrt();
            if scale <= 1e-9 * centre.abs().max(1.0) {
                continue;
            }
            let unit = column.mapv(|v| (v - centre) / scale);
            let mut own = &unit * &roots;
            for _ in 0..2 {
                for q in &base {
                    let share = q.dot(&own);
                    own.scaled_add(-share, q);
                }
            }
            let length = own.dot(&own).sqrt();
            if length < OWN_SHARE {
                continue;
            }
            base.push(own / length);
            kept.push(k);
            centres.push(centre);
            scales.push(scale);
            standard.push(unit);
        }
        let values = Array2::from_shape_fn((values.nrows(), kept.len()), |(i, j)| standard[j][i]);
        Self { kept, centres, scales, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn constant_and_dependent_columns_are_dropped() {
        let values = array![
            [1.0, 5.0, 2.0, 0.3, 3.0],
            [2.0, 5.0, 4.0, 0.1, 4.0],
            [3.0, 5.0, 6.0, 0.9, 5.0],
            [4.0, 5.0, 8.0, 0.2, 6.0]
        ];
        let columns = Columns::new(&values, &[1.0; 4]);
        assert_eq!(columns.kept, [0, 3]);
        assert!(columns.values.column(0).sum().abs() < 1e-12);
        assert!((columns.values.column(1).mapv(|v| v * v).sum() / 4.0 - 1.0).abs() < 1e-12);
    }
}
