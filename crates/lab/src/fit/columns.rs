//! The columns of a regression: standardised, and only those that add something and do not rest on a single row.

use ndarray::{Array1, Array2, ArrayView1, Axis};

/// Least share of the variation of a column that the columns before it don't explain.
const OWN_SHARE: f64 = 0.02;

/// Leverage above which a row decides a coefficient alone: without that row its error would be over a hundred times
/// as large (Hoaglin and Welsch, The Hat Matrix in Regression and ANOVA, 1978).
const ALONE: f64 = 0.99;

/// Standardised columns. linfa does not warn when columns depend on each other or one row decides a coefficient.
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
    /// The share of each row in the sum of the weights.
    shares: Vec<f64>,
}

impl Columns {
    /// Standardises `values` of shape (rows, columns) under row weights with a sum above zero. Drops each column that
    /// does not vary, varies in one row only, or is a combination of those before it.
    pub(crate) fn new(values: &Array2<f64>, weights: &[f64]) -> Self {
        let varying = Self::varying(values, weights);
        let independent: Vec<usize> = varying.base().into_iter().map(|(j, _)| j).collect();
        varying.select(&independent)
    }

    fn varying(values: &Array2<f64>, weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        let shares: Vec<f64> = weights.iter().map(|w| w / total).collect();
        let mean = |c: ArrayView1<'_, f64>| c.iter().zip(&shares).map(|(v, s)| v * s).sum::<f64>();
        let (mut kept, mut centres, mut scales) = (Vec::new(), Vec::new(), Vec::new());
        let mut standard: Vec<Array1<f64>> = Vec::new();
        for (k, column) in values.columns().into_iter().enumerate() {
            let centre = mean(column);
            let scale = mean(column.mapv(|v| (v - centre).powi(2)).view()).sqrt();
            if scale <= 1e-9 * centre.abs().max(1.0) {
                continue;
            }
            let unit = column.mapv(|v| (v - centre) / scale);
            // The leverages of the column beside the mean alone.
            if unit.iter().zip(&shares).any(|(v, share)| share * (1.0 + v * v) > ALONE) {
                continue;
            }
            kept.push(k);
            centres.push(centre);
            scales.push(scale);
            standard.push(unit);
        }
        let values = Array2::from_shape_fn((values.nrows(), kept.len()), |(i, j)| standard[j][i]);
        Self { kept, centres, scales, values, shares }
    }

    /// Drops, one after the other, the column that owes most to a row that decides a coefficient alone, until no row
    /// does.
    pub(crate) fn without_lone_rows(mut self) -> Self {
        loop {
            let base = self.base();
            let leverages = self.leverages();
            let lone = (0..leverages.len()).max_by(|&a, &b| leverages[a].total_cmp(&leverages[b]));
            let Some(row) = lone.filter(|&row| leverages[row] > ALONE) else { return self };
            let Some((worst, _)) = base.iter().max_by(|a, b| a.1[row].abs().total_cmp(&b.1[row].abs())) else {
                return self;
            };
            let rest: Vec<usize> = (0..self.kept.len()).filter(|j| j != worst).collect();
            self = self.select(&rest);
        }
    }

    /// Returns the leverage of each row in a fit with a mean: the diagonal of the hat matrix. For columns of full
    /// rank.
    fn leverages(&self) -> Vec<f64> {
        let base = self.base();
        let row = |k: usize| self.shares[k] + base.iter().map(|(_, q)| q[k] * q[k]).sum::<f64>();
        (0..self.shares.len()).map(row).collect()
    }

    /// Orthonormalises the columns times the roots of the shares. Returns each with its position, without those that
    /// depend on others.
    fn base(&self) -> Vec<(usize, Array1<f64>)> {
        let roots = Array1::from_iter(self.shares.iter().map(|s| s.sqrt()));
        let mut base: Vec<(usize, Array1<f64>)> = Vec::new();
        for (j, column) in self.values.columns().into_iter().enumerate() {
            let mut own = &column * &roots;
            for _ in 0..2 {
                for (_, q) in &base {
                    let share = q.dot(&own);
                    own.scaled_add(-share, q);
                }
            }
            let length = own.dot(&own).sqrt();
            if length >= OWN_SHARE {
                base.push((j, own / length));
            }
        }
        base
    }

    /// Returns some of the columns, by their positions among those kept.
    fn select(&self, some: &[usize]) -> Self {
        let of = |list: &[f64]| some.iter().map(|&j| list[j]).collect();
        Self {
            kept: some.iter().map(|&j| self.kept[j]).collect(),
            centres: of(&self.centres),
            scales: of(&self.scales),
            values: self.values.select(Axis(1), some),
            shares: self.shares.clone(),
        }
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

    #[test]
    fn leverages_by_hand() {
        // 1 / M + (x - mean)^2 / sum of squares, under the weights.
        let leverages = Columns::new(&array![[1.0], [2.0], [3.0], [6.0]], &[1.0; 4]).leverages();
        let expected = [0.25 + 4.0 / 14.0, 0.25 + 1.0 / 14.0, 0.25, 0.25 + 9.0 / 14.0];
        assert!(leverages.iter().zip(expected).all(|(h, e)| (h - e).abs() < 1e-12), "{leverages:?}");
        // A row of weight two has the leverage of two rows.
        let twice = Columns::new(&array![[1.0], [2.0], [3.0], [3.0], [6.0]], &[1.0; 5]).leverages();
        let weighted = Columns::new(&array![[1.0], [2.0], [3.0], [6.0]], &[1.0, 1.0, 2.0, 1.0]).leverages();
        assert!((weighted[2] - 2.0 * twice[2]).abs() < 1e-12 && (weighted[3] - twice[4]).abs() < 1e-12);
    }

    #[test]
    fn a_column_that_varies_in_one_row_is_dropped() {
        let values = Array2::from_shape_fn((6, 2), |(i, j)| if j == 0 { (i * i) as f64 } else { f64::from(i == 4) });
        assert_eq!(Columns::varying(&values, &[1.0; 6]).kept, [0]);
        assert_eq!(Columns::new(&values, &[1.0; 6]).kept, [0]);
    }

    #[test]
    fn a_column_that_serves_one_row_beside_the_others_is_dropped() {
        // The second column differs from the first one in the last row only.
        let values = Array2::from_shape_fn((8, 3), |(i, j)| {
            let n = i as f64;
            [n, n + if i == 7 { 2.0 } else { 0.0 }, (n - 3.0).powi(2)][j]
        });
        let columns = Columns::new(&values, &[1.0; 8]);
        assert_eq!(columns.kept, [0, 1, 2]);
        assert!((columns.leverages()[7] - 1.0).abs() < 1e-9);
        let columns = columns.without_lone_rows();
        assert_eq!(columns.kept, [0, 2]);
        assert_eq!(columns.values.column(0), Columns::new(&values, &[1.0; 8]).values.column(0));
        assert!(columns.leverages().iter().all(|&h| h <= ALONE));
        assert_eq!(columns.clone().without_lone_rows().kept, columns.kept);
    }
}
