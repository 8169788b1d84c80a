//! The fields of optimal performance: for each load the cheapest algorithm.

pub(crate) mod belief;
mod corrected;
mod crossover;
mod error;
mod slice;

use crate::cost::Frame;
use crate::named::named;
use crate::{AlgorithmId, CostCurve, Load, Registry, Residual};
use slice::Slice;
use std::sync::Arc;

pub use corrected::corrected;
pub use crossover::Crossover;
pub use error::TuningError;

/// In [`Tuning::usual`]: `k` threads from this times `k` squared objects. A frame of `n` objects on `k` threads takes `a n / k + b k`, with `b` for
/// waking one and waiting for it, so that k threads take less than half as many from `n = (b / 2 a) k k` on. On both machines of the first reports
/// two threads of `pair-cache` save a fifth or more from 10 000 objects on and now and then lose below.
const OBJECTS_OF_A_THREAD_SQUARED: u32 = 2500;

/// In [`Tuning::usual`]: the most threads. Those of sixteen begin at 640 000 objects, where memory bandwidth bounds a frame, which no core adds to.
const MOST_USUAL_THREADS: u32 = 16;

/// Which algorithm to run under which load, and where that knowledge came from.
///
/// With cost curves the choice depends on the whole [`Load`]; without them on the number of objects alone, through
/// `steps`, as the paper does it and as a hand-written list of thresholds does.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Tuning {
    /// Where the tuning came from.
    pub source: Source,
    /// Name of the model that predicted them, whether they were corrected since or not; `None` where there was no prediction.
    pub model: Option<String>,
    /// Whether the machine lies outside what the model was trained on.
    pub extrapolated: bool,
    /// In words, what was outside and what that means. Empty when nothing was.
    pub warnings: Vec<String>,
    /// Scenario of the slice that `steps` and `crossovers` show.
    pub scenario: String,
    /// The cheapest algorithm over the number of objects in that scenario, ascending: each holds until the next begins. Empty only where there are
    /// costs and no slice was asked for.
    pub steps: Vec<Step>,
    /// Where one step gives way to the next, in the order of `steps`.
    pub crossovers: Vec<Crossover>,
    /// What `low` and `high` of the crossovers are made of, and why some have none.
    pub interval_basis: String,
    /// The cost of each algorithm. Empty: `steps` decide.
    pub costs: Vec<AlgorithmCost>,
}

named! {
    /// Where tuning came from.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Source("source of tuning") {
        /// Written down by hand.
        Default = "default",
        /// From hardware parameters, by a model trained on reports.
        Predicted = "predicted",
        /// From timings of the algorithms on this machine.
        Measured = "measured",
        /// Predicted, then corrected by frames that ran in a program.
        Learned = "learned",
    }
}

/// From this many objects up, this algorithm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// First number of objects.
    pub from_objects: u32,
    /// The algorithm.
    pub algorithm: AlgorithmId,
}

/// The cost of one algorithm.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct AlgorithmCost {
    /// The algorithm.
    pub algorithm: AlgorithmId,
    /// Revision of the algorithm that the curve was measured or predicted for.
    pub revision: u32,
    /// Its cost over the load.
    pub curve: CostCurve,
    /// Standard deviation of the natural logarithm of measured over modelled time.
    pub spread_ln: f64,
}

/// The two cheapest algorithms under a load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ranking {
    /// Position of the cheapest in the list that was ranked.
    pub best: usize,
    /// Its predicted cost in nanoseconds.
    pub best_ns: f64,
    /// Position and predicted cost of the next.
    pub runner_up: Option<(usize, f64)>,
}

impl Step {
    /// From this many objects up, that algorithm.
    #[must_use]
    pub fn new(from_objects: u32, algorithm: AlgorithmId) -> Self {
        Self { from_objects, algorithm }
    }
}

impl AlgorithmCost {
    /// The cost of a revision of an algorithm. `spread_ln` is the standard deviation of the natural logarithm of measured over modelled time.
    #[must_use]
    pub fn new(algorithm: AlgorithmId, revision: u32, curve: CostCurve, spread_ln: f64) -> Self {
        Self { algorithm, revision, curve, spread_ln }
    }

    /// Those of its residuals that there are.
    pub(crate) fn residuals(&self) -> impl Iterator<Item = &Residual> {
        let fallback = self.curve.work.fallback.iter().filter_map(|f| f.work.residual.as_ref());
        self.curve.work.residual.iter().chain(&self.curve.observed).chain(fallback)
    }
}

impl Tuning {
    /// Tuning from a hand-written list of thresholds: from `objects` up, that algorithm.
    ///
    /// # Errors
    /// When the list is empty, does not begin at 0 or is not ascending.
    pub fn from_steps(steps: Vec<Step>) -> Result<Self, TuningError> {
        let tuning = Self { steps, ..Self::empty(Source::Default) };
        tuning.defect().map_or(Ok(tuning), Err)
    }

    /// Tuning for when nothing is known about the machine: borders in objects, written down by hand.
    ///
    /// They are the rounded borders of `uniform` on the machines of the first reports, which have two cores each. More threads than two are
    /// extrapolated, and cautiously so, since nobody learns here what they are worth: each of them has more work the more of them have
    /// to be woken. Any other machine has other borders: predict or measure them. Where boxes move far `pair-cache` runs the strips, so that
    /// one list holds for both.
    #[must_use]
    pub fn usual(registry: &Registry) -> Self {
        let step = |from_objects, method, threads| Step { from_objects, algorithm: AlgorithmId::cpu(method, threads) };
        let mut steps = vec![step(0, "brute", 1), step(80, "pair-cache", 1)];
        let parallel = registry.entries().iter().filter(|e| e.id.method() == "pair-cache" && e.unavailable.is_none());
        let mut counts: Vec<u32> =
            parallel.map(|e| e.id.threads()).filter(|k| (2..=MOST_USUAL_THREADS).contains(k)).collect();
        counts.sort_unstable();
        steps.extend(counts.into_iter().map(|k| step(OBJECTS_OF_A_THREAD_SQUARED * k * k, "pair-cache", k)));
        Self { steps, scenario: "uniform".to_owned(), ..Self::empty(Source::Default) }
    }

    /// Tuning from cost curves, with `steps` and `crossovers` for the slice through `loads`, ascending by objects.
    ///
    /// The loads are interpolated between each other, so a handful per decade is enough. A field narrower than 3 % in objects may
    /// be missed, and an algorithm that is cheaper by less than 2 % has none. Intervals follow from the curves'
    /// `spread_ln`: where the logarithms of two costs differ by less than [`NORMAL_90`](crate::stats::NORMAL_90) standard deviations of that difference.
    #[must_use]
    pub fn from_costs(source: Source, scenario: &str, costs: Vec<AlgorithmCost>, loads: &[Load]) -> Self {
        let spreads: Vec<f64> = costs.iter().map(|c| c.spread_ln).collect();
        let spread = |below: usize, above: usize, _: &Load| spreads[below].hypot(spreads[above]);
        let mut tuning = Self::from_costs_with(source, scenario, costs, loads, spread);
        tuning.interval_basis =
            "90 % of a normal distribution with the spread of measured over modelled time of the two algorithms"
                .to_owned();
        tuning
    }

    /// As [`Tuning::from_costs`], with intervals from `spread`: for two positions in `costs` and a load, the standard deviation of the
    /// logarithm of the ratio of the two costs. Say in [`Tuning::interval_basis`] what that is made of.
    #[must_use]
    pub fn from_costs_with(
        source: Source,
        scenario: &str,
        costs: Vec<AlgorithmCost>,
        loads: &[Load],
        spread: impl Fn(usize, usize, &Load) -> f64,
    ) -> Self {
        let mut tuning = Self { scenario: scenario.to_owned(), costs, ..Self::empty(source) };
        tuning.cut(loads, &spread);
        tuning
    }

    fn empty(source: Source) -> Self {
        Self {
            source,
            model: None,
            extrapolated: false,
            warnings: Vec::new(),
            scenario: String::new(),
            steps: Vec::new(),
            crossovers: Vec::new(),
            interval_basis: String::new(),
            costs: Vec::new(),
        }
    }

    /// The algorithms that this tuning may choose, in the order that [`Tuning::rank`] counts them.
    #[must_use]
    pub fn algorithms(&self) -> Vec<&AlgorithmId> {
        if self.costs.is_empty() {
            let mut list: Vec<&AlgorithmId> = Vec::new();
            for step in &self.steps {
                if !list.contains(&&step.algorithm) {
                    list.push(&step.algorithm);
                }
            }
            return list;
        }
        self.costs.iter().map(|c| &c.algorithm).collect()
    }

    /// The cheapest algorithms under `load` among those that `usable` admits, which is asked by position in [`Tuning::costs`].
    ///
    /// `None` when there are no cost curves or none is usable.
    #[must_use]
    pub fn rank(&self, load: &Load, usable: impl Fn(usize) -> bool) -> Option<Ranking> {
        let frame = Frame::new(load);
        let mut ranking: Option<Ranking> = None;
        for (k, cost) in self.costs.iter().enumerate().filter(|&(k, _)| usable(k)) {
            let ns = cost.curve.cost_of(&frame);
            ranking = Some(match ranking {
                None => Ranking { best: k, best_ns: ns, runner_up: None },
                Some(r) if ns < r.best_ns => Ranking { best: k, best_ns: ns, runner_up: Some((r.best, r.best_ns)) },
                Some(r) if r.runner_up.is_none_or(|(_, second)| ns < second) => {
                    Ranking { runner_up: Some((k, ns)), ..r }
                }
                Some(r) => r,
            });
        }
        ranking
    }

    /// The step that holds at a number of objects.
    #[must_use]
    pub fn step(&self, objects: u32) -> Option<&Step> {
        self.steps[..self.steps.partition_point(|s| s.from_objects <= objects)].last()
    }

    /// What makes this tuning unusable, if anything.
    #[must_use]
    pub fn defect(&self) -> Option<TuningError> {
        // A slice through no load has no steps, and then the costs decide as ever.
        let starts = self.steps.first().map_or(!self.costs.is_empty(), |s| s.from_objects == 0);
        if !starts {
            return Some(TuningError::NoFirstStep);
        }
        if !self.steps.is_sorted_by(|a, b| a.from_objects < b.from_objects) {
            return Some(TuningError::StepOrder);
        }
        if let Some(c) = self.crossovers.iter().find(|c| !c.is_sound()) {
            return Some(TuningError::Crossover { below: c.below.clone(), above: c.above.clone() });
        }
        let places = || self.costs.iter().flat_map(AlgorithmCost::residuals).map(|r| &r.places);
        for (k, cost) in self.costs.iter().enumerate() {
            let algorithm = || cost.algorithm.clone();
            let other =
                |own: &Residual| places().next().is_some_and(|p| !Arc::ptr_eq(p, &own.places) && **p != *own.places);
            if cost.residuals().any(other) {
                return Some(TuningError::Places { algorithm: algorithm() });
            }
            if let Some(source) = cost.curve.defect() {
                return Some(TuningError::Curve { algorithm: algorithm(), source });
            }
            if !(cost.spread_ln.is_finite() && cost.spread_ln >= 0.0) {
                return Some(TuningError::Spread { algorithm: algorithm(), spread_ln: cost.spread_ln });
            }
            if self.costs[..k].iter().any(|c| c.algorithm == cost.algorithm) {
                return Some(TuningError::Repeated { algorithm: algorithm() });
            }
        }
        None
    }

    /// Notes where along the slice the cheapest algorithm changes.
    ///
    /// `spread` returns the standard deviation of the logarithm of the ratio of two costs under a load.
    fn cut(&mut self, loads: &[Load], spread: &dyn Fn(usize, usize, &Load) -> f64) {
        let slice = Slice::new(loads);
        let steps = slice.steps(&self.costs);
        let crossover = |w: &[(Load, usize)]| {
            let (below, above) = (w[0].1, w[1].1);
            self.crossover(&slice, below, above, w[1].0.objects, &|load| spread(below, above, load))
        };
        self.crossovers = steps.windows(2).map(crossover).collect();
        self.steps = steps
            .iter()
            .enumerate()
            .map(|(k, (load, best))| Step {
                from_objects: if k == 0 { 0 } else { load.objects },
                algorithm: self.costs[*best].algorithm.clone(),
            })
            .collect();
    }

    fn crossover(
        &self,
        slice: &Slice<'_>,
        below: usize,
        above: usize,
        objects: u32,
        spread: &dyn Fn(&Load) -> f64,
    ) -> Crossover {
        let (b, a) = (&self.costs[below], &self.costs[above]);
        let doubt = |load: &Load| crate::stats::NORMAL_90 * spread(load);
        // Positive where the algorithm of the upper field is cheaper.
        let gain = |load: &Load| (b.curve.cost_ns(load) / a.curve.cost_ns(load)).ln();
        let objects = f64::from(objects);
        Crossover {
            below: b.algorithm.clone(),
            above: a.algorithm.clone(),
            objects,
            low: Some(slice.reach(objects, false, |l| gain(l) <= -doubt(l))),
            high: Some(slice.reach(objects, true, |l| gain(l) >= doubt(l))),
        }
    }
}

#[cfg(test)]
mod tests;
