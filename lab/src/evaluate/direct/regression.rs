//! Regressions of a value on the logarithms of hardware parameters.

use super::super::columns::Columns;
use super::super::figure;
use super::super::yardstick::average;
use anyhow::{Context, Result};
use linfa::DatasetBase;
use linfa::traits::Fit;
use linfa_elasticnet::ElasticNet;
use linfa_linear::LinearRegression;
use ndarray::{Array1, Array2, Axis};
use sapwise::Hardware;

/// Penalties of the elastic net to choose from. Values are logarithms of numbers of objects and columns are standardised, so
/// with the largest a parameter alone must move the border 1.6-fold (e^0.5) in one standard deviation to count.
const PENALTIES: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
/// The share of the lasso in the penalty: half, so that it selects, and keeps parameters together that go together.
const L1_RATIO: f64 = 0.5;
/// The penalty where there are too few machines to choose one by leaving them out.
const DEFAULT_PENALTY: f64 = 0.1;
/// The share of the largest slope by which the last round of coordinate descent may still move one.
const TOLERANCE: f64 = 1e-10;
/// The same while a penalty is chosen: the penalties are a factor of three apart, and this takes a fraction of the rounds.
const COARSE: f64 = 1e-5;
/// Groups of machines that are left out one after the other to choose the penalty, at most.
const MOST_FOLDS: usize = 4;
/// Physical machines that it takes to choose the penalty.
const FEWEST_MACHINES: usize = 3;

/// How values are regressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Regression {
    /// Ordinary least squares.
    LeastSquares,
    /// An elastic net, its penalty chosen by leaving out physical machines of the training.
    ElasticNet,
}

/// What a regression says of a machine.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub(super) value: f64,
    /// There was too little for a regression: it is the mean.
    pub(super) mean: bool,
    /// Rows of high leverage, see [`Columns::far_rows`]. None where a penalty bounds what a row can do.
    pub(super) far_rows: usize,
}

impl Regression {
    /// Values on the logarithms of the parameters, evaluated for a machine. Parameters that are missing anywhere or say
    /// nothing of their own are not used.
    ///
    /// Least squares give the mean when there are not more rows than coefficients, and use fewer parameters when one row alone
    /// would decide a coefficient. An elastic net gives the mean when there are two rows or fewer.
    ///
    /// # Errors
    /// When linfa refuses a fit.
    pub(super) fn estimate(
        self,
        names: &[&str],
        machines: &[&Hardware],
        values: &[f64],
        hardware: &Hardware,
    ) -> Result<Estimate> {
        let logarithm = |h: &Hardware, name: &str| figure(h, name).filter(|v| *v > 0.0).map(f64::ln);
        let there = |name: &&str| machines.iter().chain([&hardware]).all(|h| logarithm(h, name).is_some());
        let names: Vec<&str> = names.iter().copied().filter(there).collect();
        let row = |h: &Hardware| names.iter().map(|name| logarithm(h, name).unwrap_or_default()).collect::<Vec<f64>>();
        let table = Array2::from_shape_fn((machines.len(), names.len()), |(k, j)| {
            logarithm(machines[k], names[j]).unwrap_or_default()
        });
        let (line, far_rows) = match self {
            Self::LeastSquares => Line::least_squares(&table, values)?,
            Self::ElasticNet => {
                let groups: Vec<&str> = machines.iter().map(|h| h.machine.physical_id.as_str()).collect();
                (Line::best_elastic_net(&table, values, &groups)?, 0)
            }
        };
        Ok(Estimate { value: line.at(&row(hardware)), mean: line.columns.kept.is_empty(), far_rows })
    }
}

/// A fitted linear function of a row of figures.
#[derive(Debug, Clone)]
pub(in super::super) struct Line {
    pub(in super::super) columns: Columns,
    /// The value where every figure is at its mean.
    pub(in super::super) intercept: f64,
    /// One for each kept column, against its standardised figures.
    pub(in super::super) slopes: Vec<f64>,
}

impl Line {
    /// Ordinary least squares over a table of shape (rows, figures), and how many rows have a high leverage; the mean when
    /// there are not more rows than coefficients.
    pub(in super::super) fn least_squares(table: &Array2<f64>, values: &[f64]) -> Result<(Self, usize)> {
        let columns = Columns::new(table, &vec![1.0; values.len()]);
        if values.len() <= columns.kept.len() + 1 {
            return Ok((Self::mean(table, values), 0));
        }
        let columns = columns.without_lone_rows();
        if columns.kept.is_empty() {
            return Ok((Self::mean(table, values), 0));
        }
        let data = DatasetBase::new(columns.values.clone(), Array1::from(values.to_vec()));
        let fitted = LinearRegression::new().fit(&data).context("the direct regression of crossovers failed")?;
        let far_rows = columns.far_rows();
        Ok((Self { columns, intercept: fitted.intercept(), slopes: fitted.params().to_vec() }, far_rows))
    }

    /// The elastic net with the penalty that does best on groups that were left out of it, one after the other, of equals the
    /// largest; with 0.1 where there are fewer than three groups.
    fn best_elastic_net(table: &Array2<f64>, values: &[f64], groups: &[&str]) -> Result<Self> {
        let mut held = groups.to_vec();
        held.sort_unstable();
        held.dedup();
        if held.len() < FEWEST_MACHINES {
            return Self::elastic_net(table, values, DEFAULT_PENALTY);
        }
        // Of many machines some are left out together, each with all of its rows.
        let deal = |group: &str| held.iter().position(|h| *h == group).map_or(0, |k| k % MOST_FOLDS);
        let folds: Vec<usize> = groups.iter().map(|group| deal(group)).collect();
        let mut best = (f64::INFINITY, 0.0);
        for penalty in PENALTIES.into_iter().rev() {
            let mut error = 0.0;
            for fold in 0..held.len().min(MOST_FOLDS) {
                let rest: Vec<usize> = (0..values.len()).filter(|&k| folds[k] != fold).collect();
                let known: Vec<f64> = rest.iter().map(|&k| values[k]).collect();
                let line = Self::descend(&table.select(Axis(0), &rest), &known, penalty, COARSE)?;
                let out = (0..values.len()).filter(|&k| folds[k] == fold);
                error += out.map(|k| (values[k] - line.at(&table.row(k).to_vec())).powi(2)).sum::<f64>();
            }
            if error < best.0 {
                best = (error, penalty);
            }
        }
        Self::elastic_net(table, values, best.1)
    }

    /// The elastic net of one penalty. What is least is half the mean of the squared errors, plus half of the penalty times the
    /// sum of the slopes without their signs, plus a quarter of it times that of their squares. The squares give columns that
    /// depend on each other one answer, so that there is no test of rank.
    pub(in super::super) fn elastic_net(table: &Array2<f64>, values: &[f64], penalty: f64) -> Result<Self> {
        Self::descend(table, values, penalty, TOLERANCE)
    }

    fn descend(table: &Array2<f64>, values: &[f64], penalty: f64, tolerance: f64) -> Result<Self> {
        let columns = Columns::varying(table, &vec![1.0; values.len()]);
        if columns.kept.is_empty() {
            return Ok(Self::mean(table, values));
        }
        // Centred here: linfa's tolerance counts the mean as something to explain otherwise.
        let intercept = average(values);
        let centred: Array1<f64> = values.iter().map(|v| v - intercept).collect();
        let data = DatasetBase::new(columns.values.clone(), centred);
        let net = ElasticNet::<f64>::params().penalty(penalty).l1_ratio(L1_RATIO).with_intercept(false).tolerance(tolerance);
        let fitted = net.fit(&data).context("the elastic net of crossovers failed")?;
        Ok(Self { columns, intercept, slopes: fitted.hyperplane().to_vec() })
    }

    fn mean(table: &Array2<f64>, values: &[f64]) -> Self {
        let columns = Columns::new(&table.select(Axis(1), &[]), &vec![1.0; values.len()]);
        Self { columns, intercept: average(values), slopes: Vec::new() }
    }

    /// The value at a row with as many figures as the table has.
    pub(in super::super) fn at(&self, figures: &[f64]) -> f64 {
        let c = &self.columns;
        let term = |j: usize| self.slopes[j] * (figures[c.kept[j]] - c.centres[j]) / c.scales[j];
        self.intercept + (0..self.slopes.len()).map(term).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::synthetic::Machine;
    use super::super::{ALL_OF_CPU, PARAMETERS};
    use super::*;
    use sapwise_scenes::Random;
    use linfa::traits::Predict;
    use sapwise::hardware::ParameterId;

    /// Machines and a border that goes down with their lanes.
    fn power_law() -> (Vec<Hardware>, Vec<f64>) {
        let machines: Vec<Hardware> = Machine::family().iter().map(Machine::hardware).collect();
        let values = machines.iter().map(|h| 5.0 - 0.7 * h.value(ParameterId::SimdLanes).unwrap().ln()).collect();
        (machines, values)
    }

    #[test]
    fn least_squares_find_a_power_law_and_too_few_rows_give_the_mean() {
        let (machines, values) = power_law();
        let known: Vec<&Hardware> = machines[..6].iter().collect();
        let estimate = |count: usize| {
            Regression::LeastSquares.estimate(&PARAMETERS, &known[..count], &values[..count], &machines[6]).unwrap()
        };
        let found = estimate(6);
        assert!((found.value - values[6]).abs() < 1e-6 && !found.mean, "{found:?}");
        let found = estimate(3);
        assert!((found.value - average(&values[..3])).abs() < 1e-12 && found.mean, "{found:?}");
    }

    #[test]
    fn an_elastic_net_finds_a_power_law_among_all_parameters_and_two_rows_give_the_mean() {
        let (machines, values) = power_law();
        let known: Vec<&Hardware> = machines[..6].iter().collect();
        let estimate = |count: usize| {
            Regression::ElasticNet.estimate(&ALL_OF_CPU, &known[..count], &values[..count], &machines[6]).unwrap()
        };
        let found = estimate(6);
        assert!((found.value - values[6]).abs() < 0.1 && !found.mean, "{found:?} {}", values[6]);
        let found = estimate(2);
        assert!((found.value - average(&values[..2])).abs() < 1e-12 && found.mean, "{found:?}");
    }

    #[test]
    fn machines_left_out_choose_the_penalty_where_there_are_three() {
        let mut random = Random::named(31, &[]);
        let table = Array2::from_shape_fn((24, 3), |_| random.normal());
        let law: Vec<f64> = table.rows().into_iter().map(|r| 9.0 + r[0] - 0.5 * r[2]).collect();
        let noise: Vec<f64> = (0..24).map(|_| random.normal()).collect();
        let groups: Vec<&str> = (0..24).map(|k| ["a", "b", "c", "d"][k / 6]).collect();
        let slopes = |values: &[f64], groups: &[&str]| Line::best_elastic_net(&table, values, groups).unwrap().slopes;
        let with = |penalty: f64| Line::elastic_net(&table, &law, penalty).unwrap().slopes;
        assert_eq!(slopes(&law, &groups), with(PENALTIES[0]));
        assert_eq!(slopes(&noise, &groups), [0.0; 3]);
        assert_eq!(slopes(&law, &["a"; 24]), with(DEFAULT_PENALTY));
    }

    #[test]
    fn a_parameter_of_one_machine_only_is_not_used() {
        // Nine machines of which only the last has other lanes; its border is far off for another reason.
        let mut random = Random::named(23, &[]);
        let table = Array2::from_shape_fn((9, 2), |(k, j)| if j == 0 { random.normal() } else { f64::from(k == 8) });
        let values: Vec<f64> = (0..9).map(|k| 5.0 + table[[k, 0]] + if k == 8 { 4.0 } else { 0.0 }).collect();
        let (line, far_rows) = Line::least_squares(&table, &values).unwrap();
        assert_eq!(line.columns.kept, [0]);
        assert!(far_rows <= 1);
        assert_eq!(Line::elastic_net(&table, &values, 0.01).unwrap().columns.kept, [0]);
    }

    #[test]
    fn plain_arithmetic_predicts_what_linfa_does() {
        let mut random = Random::named(29, &[]);
        let table = Array2::from_shape_fn((30, 4), |(_, j)| [3.0, 0.1, 40.0, 7.0][j] * (2.0 + random.normal()));
        let values: Vec<f64> =
            table.rows().into_iter().map(|r| 2.0 + 0.3 * r[0] - 5.0 * r[1] + 0.1 * random.normal()).collect();
        let columns = Columns::new(&table, &[1.0; 30]);
        let data = DatasetBase::new(columns.values.clone(), Array1::from(values.clone()));
        let ours = [Line::least_squares(&table, &values).unwrap().0, Line::elastic_net(&table, &values, 0.1).unwrap()];
        let linfa = [
            LinearRegression::new().fit(&data).unwrap().predict(&columns.values),
            ElasticNet::<f64>::params().penalty(0.1).tolerance(1e-12).fit(&data).unwrap().predict(&columns.values),
        ];
        for (ours, linfa) in ours.iter().zip(&linfa) {
            for k in 0..30 {
                let own = ours.at(&table.row(k).to_vec());
                assert!((own - linfa[k]).abs() < 1e-9, "{own} {}", linfa[k]);
            }
        }
    }
}
