//! How sure a prediction is: intervals from machines that were left out of the fit.

use super::curve::Figures;
use super::fold::{Fold, LnErrors, QUANTILES};
use super::{Model, Prediction};
use crate::cost::Counts;
use crate::tuning::Slice;
use crate::{AlgorithmId, CostCurve, Tuning, Load, Source};

/// Share of new machines that an interval is to hold.
const CONFIDENCE: f64 = 0.9;

/// Physical machines that an interval needs: one in so many lies outside it, and of fewer none may have.
pub const FEWEST_MACHINES: u32 = 10;

/// The curves and held-out errors of every fold, for the algorithms of a prediction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Doubt {
    model: String,
    machines: usize,
    folds: Vec<FoldCurves>,
    algorithms: Vec<AlgorithmId>,
    /// By how much the errors of each algorithm are taken larger than in training.
    wider: Vec<f64>,
    /// Why the parameters were not compared with those of training all together, if so.
    untested: Option<String>,
}

/// One fold, its methods replaced by their curves, in the order of the algorithms.
#[derive(Debug, Clone, PartialEq)]
struct FoldCurves {
    fold: Fold,
    curves: Vec<Option<CostCurve>>,
}

/// What the folds say of one cost, or of the ratio of two.
struct Band<'a> {
    folds: Vec<Evidence<'a>>,
    machines: f64,
    wider: f64,
}

struct Evidence<'a> {
    cost: &'a CostCurve,
    over: Option<&'a CostCurve>,
    machines: f64,
    errors: &'a LnErrors,
}

impl Doubt {
    pub(super) fn new(model: &Model, untested: Option<String>) -> Self {
        let without_methods = |f: &Fold| Fold { machines: f.machines, methods: Vec::new(), errors: f.errors.clone() };
        Self {
            model: model.name.clone(),
            machines: model.validation.physical_machines,
            folds: model.folds.iter().map(|f| FoldCurves { fold: without_methods(f), curves: Vec::new() }).collect(),
            algorithms: Vec::new(),
            wider: Vec::new(),
            untested,
        }
    }

    pub(super) fn add(&mut self, id: &AlgorithmId, folds: &[Fold], figures: &mut Figures<'_>, wider: f64) {
        for (mine, fold) in self.folds.iter_mut().zip(folds) {
            mine.curves.push(fold.method(id).and_then(|m| m.formula().curve(figures).ok()));
        }
        self.algorithms.push(id.clone());
        self.wider.push(wider);
    }

    fn position(&self, id: &AlgorithmId) -> Option<usize> {
        self.algorithms.iter().position(|a| a == id)
    }

    /// What the folds say of the ratio of two costs; `None` where too few machines timed both.
    fn of_ratio(&self, a: &AlgorithmId, b: &AlgorithmId) -> Option<Band<'_>> {
        let (first, second) = (self.position(a)?, self.position(b)?);
        let evidence = self.folds.iter().filter_map(|f| {
            let (machines, errors) = f.fold.errors_between(a, b)?;
            let (cost, over) = (f.curves[first].as_ref()?, Some(f.curves[second].as_ref()?));
            Some(Evidence { cost, over, machines: f64::from(machines), errors })
        });
        Band::new(evidence.collect(), self.wider[first].max(self.wider[second]))
    }

    /// What the folds say of one cost; `None` where too few machines timed it.
    fn of_cost(&self, id: &AlgorithmId) -> Option<Band<'_>> {
        let k = self.position(id)?;
        let evidence = self.folds.iter().filter_map(|f| {
            let (machines, errors) = f.fold.errors_of(id)?;
            Some(Evidence { cost: f.curves[k].as_ref()?, over: None, machines: f64::from(machines), errors })
        });
        Band::new(evidence.collect(), self.wider[k])
    }

    /// What the intervals are made of, in a sentence, and why some borders have none.
    fn basis(&self, borders: usize, without: usize) -> String {
        let machines = match self.machines {
            1 => "1 physical machine".to_owned(),
            many => format!("{many} physical machines"),
        };
        let needed = format!("a 90 % interval for a machine never seen takes {FEWEST_MACHINES}");
        let mut text = if self.machines < FEWEST_MACHINES as usize {
            format!("no interval can be claimed: the model {} was trained on {machines}, and {needed}", self.model)
        } else if self.folds.is_empty() {
            format!("no interval can be claimed: the model {} keeps no folds; train it again", self.model)
        } else {
            format!(
                "90 % by jackknife+ from {machines}, left out of the fit in {} parts; what is guaranteed for a machine like them is \
                 80 %",
                self.folds.len()
            )
        };
        if without > 0 && self.machines >= FEWEST_MACHINES as usize && !self.folds.is_empty() {
            text += &format!("; {without} of {borders} borders have none: too few machines timed both, and {needed}");
        }
        let wider = self.wider.iter().copied().fold(1.0, f64::max);
        if wider > 1.0 && without < borders {
            text += &format!(
                "; errors are taken up to {wider:.1} times as large as in training, as far as this machine lies outside"
            );
        }
        if let Some(untested) = &self.untested {
            text += &format!("; {untested}");
        }
        text
    }
}

impl<'a> Band<'a> {
    fn new(folds: Vec<Evidence<'a>>, wider: f64) -> Option<Self> {
        let machines = folds.iter().map(|f| f.machines).sum();
        (machines >= f64::from(FEWEST_MACHINES)).then_some(Self { folds, machines, wider })
    }

    /// How many of the machines an end of the interval must have on its inner side, the new machine counted among those outside.
    fn needed(&self) -> f64 {
        // The shares of the machines add up but for rounding.
        CONFIDENCE * (self.machines + 1.0) - 1e-9
    }

    /// Whether the ratio is certain to be above 1, with `sign` -1 below it: for that many machines no error as large as theirs
    /// would turn it.
    fn is_sure(&self, load: &Load, sign: f64) -> bool {
        let counts = Counts::new(load);
        let agreeing = |f: &Evidence<'_>| {
            let margin = sign * f.ln(&counts);
            let overcome = f.errors.partition_point(|e| self.wider * e < margin);
            f.machines * overcome.checked_sub(1).map_or(0.0, |k| QUANTILES[k])
        };
        self.folds.iter().map(agreeing).sum::<f64>() >= self.needed()
    }

    /// The ends of the interval, in logarithms.
    fn ends(&self, load: &Load) -> (f64, f64) {
        let counts = Counts::new(load);
        let end = |sign: f64| {
            let mut values: Vec<(f64, f64)> = Vec::with_capacity(self.folds.len() * QUANTILES.len());
            for f in &self.folds {
                let (ln, mut below) = (f.ln(&counts), 0.0);
                for (share, error) in QUANTILES.iter().zip(f.errors) {
                    values.push((sign * ln + self.wider * error, f.machines * (share - below)));
                    below = *share;
                }
            }
            values.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut sum = 0.0;
            let reached = values.iter().find(|v| {
                sum += v.1;
                sum >= self.needed()
            });
            sign * reached.or(values.last()).map_or(f64::INFINITY, |v| v.0)
        };
        (end(-1.0), end(1.0))
    }
}

impl Evidence<'_> {
    fn ln(&self, counts: &Counts<'_>) -> f64 {
        (self.cost.cost_of(counts) / self.over.map_or(1.0, |o| o.cost_of(counts))).ln()
    }
}

impl Prediction {
    /// The tuning, with `steps` and `crossovers` for the slice through `loads`, ascending by objects.
    ///
    /// The interval of a border ends where 0 leaves the jackknife+ interval of the logarithm of the two costs' ratio: at each load
    /// the ratios that the folds predict, less and plus their errors on the machines that they left out, of which 90 % lie within.
    /// With several machines in a fold that is CV+. The guarantee is 1 - 2 * 10 %, and in practice coverage is near 90 % (Barber,
    /// Candès, Ramdas and Tibshirani, "Predictive inference with the jackknife+", 2021, arXiv 1905.02928). Every machine has the
    /// same weight, however many points were timed on it (Lee, Barber and Willett, "Distribution-free inference with hierarchical
    /// data", arXiv 2306.06342). The errors are those at all loads, not those near the border. With fewer than
    /// [`FEWEST_MACHINES`] machines that timed both algorithms a border has no interval.
    #[must_use]
    pub fn tuning(self, scenario: &str, loads: &[Load]) -> Tuning {
        let Self { costs, extrapolated, warnings, doubt } = self;
        let mut tuning = Tuning::from_costs(Source::Predicted, scenario, costs, loads);
        let slice = Slice::new(loads);
        let mut without = 0;
        for border in &mut tuning.crossovers {
            let interval = doubt.of_ratio(&border.below, &border.above).map(|band| {
                let low = slice.reach(border.objects, false, |l| band.is_sure(l, -1.0));
                (low, slice.reach(border.objects, true, |l| band.is_sure(l, 1.0)))
            });
            (border.low, border.high) = interval.unzip();
            without += usize::from(interval.is_none());
        }
        tuning.interval_basis = doubt.basis(tuning.crossovers.len(), without);
        tuning.model = Some(doubt.model);
        (tuning.extrapolated, tuning.warnings) = (extrapolated, warnings);
        tuning
    }

    /// The 90 % interval of an algorithm's time under a load, in nanoseconds, made as those of [`Prediction::tuning`]. `None`
    /// where fewer than [`FEWEST_MACHINES`] machines timed its role, or it was not predicted.
    #[must_use]
    pub fn interval_ns(&self, algorithm: &AlgorithmId, load: &Load) -> Option<(f64, f64)> {
        let (low, high) = self.doubt.of_cost(algorithm)?.ends(load);
        Some((low.exp(), high.exp()))
    }
}
