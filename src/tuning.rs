//! Tunings: the cheapest algorithm for each load (the paper's fields of optimal performance).

mod crossover;
mod error;
#[cfg(feature = "serde")]
mod file;
mod slice;

use crate::algorithm::BackendClass;
use crate::cost::{Places, Residual};
use crate::{AlgorithmId, Load, Registry, named};
use slice::Slice;
use std::sync::Arc;

pub use crate::cost::{CostCurve, CostTerm, Product, Term};
pub use crossover::Crossover;
pub use error::TuningError;

/// [`Tuning::usual`] runs `k` threads from this number times `k`² objects on.
///
/// A frame of `n` objects on `k` threads takes `a n / k + b k`; `b` is the time to wake one thread and wait for it. So
/// `k` threads are faster than `k / 2` from `n = (b / 2a) k²` on. On the machines of the first reports two threads of
/// `pair-cache` save a fifth from 10 000 objects on.
const OBJECTS_OF_A_THREAD_SQUARED: u32 = 2500;

/// The most threads of [`Tuning::usual`]. Sixteen begin at 640 000 objects, where memory bandwidth bounds a frame.
const MOST_USUAL_THREADS: u32 = 16;

/// Methods on the CPU that [`Tuning::for_running`] replaces by `pair-cache`.
const REPLACED: [&str; 3] = ["sap", "grid-sap", "bvh"];

/// Which algorithm to run under which load, and where that knowledge came from.
///
/// With cost curves the choice depends on the whole [`Load`]. Without them it depends on the number of objects, through
/// `steps`, as in the paper.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "file::TuningFile", into = "file::TuningFile")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Tuning {
    /// Where the tuning came from.
    pub source: Source,
    /// Name of the model that predicted the costs, corrected since or not; `None` without a prediction.
    pub model: Option<String>,
    /// Whether the machine lies outside what the model was trained on.
    pub extrapolated: bool,
    /// In words, what was outside and what that means. Empty when nothing was.
    pub warnings: Vec<String>,
    /// Scenario of `steps` and `crossovers`.
    pub scenario: String,
    /// The cheapest algorithm over the number of objects in that scenario, ascending: each holds until the next
    /// begins. Empty only if there are costs and no loads were given.
    pub steps: Vec<Step>,
    /// Where one step gives way to the next, in the order of `steps`.
    pub crossovers: Vec<Crossover>,
    /// What `low` and `high` of the crossovers are made of, and why some have none.
    pub interval_basis: String,
    /// The cost of each algorithm. Empty: `steps` decide.
    pub costs: Vec<AlgorithmCost>,
}

named! {
    /// The origin of a tuning.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Source("source of tuning") {
        /// Hand-written thresholds.
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
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
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

impl Step {
    /// Makes the step to `algorithm` from `from_objects` objects up.
    pub fn new(from_objects: u32, algorithm: AlgorithmId) -> Self {
        Self { from_objects, algorithm }
    }
}

impl AlgorithmCost {
    /// Makes the cost of a revision of an algorithm.
    pub fn new(algorithm: AlgorithmId, revision: u32, curve: CostCurve, spread_ln: f64) -> Self {
        Self { algorithm, revision, curve, spread_ln }
    }

    /// Returns its residuals: of the work, of the whole curve, and of the fallback.
    fn residuals(&self) -> impl Iterator<Item = &Residual> {
        let fallback = self.curve.work.fallback.iter().filter_map(|f| f.work.residual.as_ref());
        self.curve.work.residual.iter().chain(&self.curve.residual).chain(fallback)
    }
}

impl Tuning {
    /// Makes a tuning of hand-written steps.
    ///
    /// ```
    /// use sapwise::Tuning;
    /// use sapwise::tuning::Step;
    ///
    /// let steps = [(0, "brute@cpu1"), (60, "pair-cache@cpu1")].map(|(from, id)| Step::new(from, id.parse().unwrap()));
    /// let tuning = Tuning::from_steps(steps.to_vec()).expect("steps that ascend from 0");
    /// assert_eq!(tuning.step(100).unwrap().algorithm.method(), "pair-cache");
    /// ```
    ///
    /// # Errors
    /// The list is empty, does not begin at 0 or does not ascend.
    pub fn from_steps(steps: Vec<Step>) -> Result<Self, TuningError> {
        let tuning = Self { steps, ..Self::empty(Source::Default) };
        tuning.defect().map_or(Ok(tuning), Err)
    }

    /// Returns a tuning for an unknown machine: steps by the number of objects.
    ///
    /// The steps are the rounded crossovers of `uniform` on the machines of the first reports, which have two cores.
    /// Those of more than two threads are extrapolated, with more work for each thread. Another machine has other
    /// crossovers: predict or measure them.
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

    /// Makes a tuning of cost curves, with `steps` and `crossovers` along `loads`, which ascend by objects.
    ///
    /// Loads in between are interpolated, so a handful a decade is enough. A field narrower than 3 % in objects may be
    /// missed. An algorithm that is cheaper by less than 2 % gets no field. The interval of a crossover contains the
    /// loads at which the logarithms of the two costs differ by less than [`NORMAL_90`](crate::stats::NORMAL_90)
    /// standard deviations.
    pub fn from_costs(source: Source, scenario: &str, costs: Vec<AlgorithmCost>, loads: &[Load]) -> Self {
        let spreads: Vec<f64> = costs.iter().map(|c| c.spread_ln).collect();
        let spread = |below: usize, above: usize, _: &Load| spreads[below].hypot(spreads[above]);
        let mut tuning = Self::from_costs_with(source, scenario, costs, loads, spread);
        tuning.interval_basis =
            "90 % of a normal distribution with the spread of measured over modelled time of the two algorithms"
                .to_owned();
        tuning
    }

    /// Does the same as [`Tuning::from_costs`], with intervals from `spread`. This gets two positions in `costs` and a
    /// load, and returns the standard deviation of the logarithm of the ratio of the two costs. Describe it in
    /// [`Tuning::interval_basis`].
    pub fn from_costs_with(
        source: Source,
        scenario: &str,
        costs: Vec<AlgorithmCost>,
        loads: &[Load],
        spread: impl Fn(usize, usize, &Load) -> f64,
    ) -> Self {
        let slice = Slice(loads);
        let fields = slice.steps(&costs);
        let crossovers = fields.windows(2).map(|two| {
            let (below, (from, above)) = (two[0].1, two[1]);
            slice.crossover(&costs[below], &costs[above], from.objects, |load| spread(below, above, load))
        });
        let crossovers = crossovers.collect();
        let steps = fields.iter().enumerate().map(|(k, (from, best))| {
            let from_objects = if k == 0 { 0 } else { from.objects };
            Step { from_objects, algorithm: costs[*best].algorithm.clone() }
        });
        let steps = steps.collect();
        Self { scenario: scenario.to_owned(), steps, crossovers, costs, ..Self::empty(source) }
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

    /// Returns the algorithms that this tuning may choose: those of `costs` in their order; without costs, those of
    /// `steps`.
    pub fn algorithms(&self) -> Vec<&AlgorithmId> {
        let mut list: Vec<&AlgorithmId> = self.costs.iter().map(|c| &c.algorithm).collect();
        if list.is_empty() {
            for step in &self.steps {
                if !list.contains(&&step.algorithm) {
                    list.push(&step.algorithm);
                }
            }
        }
        list
    }

    /// Returns the tuning with `brute` on one thread and `pair-cache` as the only built-in methods on the CPU.
    /// `pair-cache` takes the fields of `sap`, `grid-sap` and `bvh`.
    ///
    /// `pair-cache` contains `bvh`: it chooses by its own times between kept pairs and a tree from scratch. Without
    /// `sap` and `grid-sap` the best of the others takes 1.001 to 1.004 times the best of all over the reports of
    /// `datasets/` (1.015 at the portable SIMD level). At 1785 points of 1500 boxes or more, `brute` on several threads
    /// was never the fastest.
    ///
    /// The tuning is unchanged unless it has costs of `bvh` on the CPU, and of `pair-cache` on the same numbers of
    /// threads.
    #[must_use]
    pub fn for_running(mut self) -> Self {
        let stand_in = |id: &AlgorithmId| match id.method() {
            _ if id.backend().class() != BackendClass::Cpu => None,
            method if REPLACED.contains(&method) => Some(AlgorithmId::cpu("pair-cache", id.threads())),
            "brute" if id.threads() > 1 => Some(AlgorithmId::cpu("brute", 1)),
            _ => None,
        };
        let known = |id: &AlgorithmId| self.costs.iter().any(|c| c.algorithm == *id);
        let has_bvh = self.costs.iter().any(|c| c.algorithm.method() == "bvh" && stand_in(&c.algorithm).is_some());
        if !(has_bvh && self.costs.iter().filter_map(|c| stand_in(&c.algorithm)).all(|id| known(&id))) {
            return self;
        }
        self.costs.retain(|c| stand_in(&c.algorithm).is_none());
        let steps = self.steps.iter_mut().map(|step| &mut step.algorithm);
        let sides = self.crossovers.iter_mut().flat_map(|c| [&mut c.below, &mut c.above]);
        for id in steps.chain(sides) {
            if let Some(other) = stand_in(id) {
                *id = other;
            }
        }
        self.steps.dedup_by(|step, before| step.algorithm == before.algorithm);
        self.crossovers.retain(|c| c.below != c.above);
        self
    }

    /// Returns the position in [`Tuning::costs`] of the cheapest algorithm under `load`, and its predicted cost in
    /// nanoseconds. `usable` gets a position and returns whether that algorithm may be chosen. `None` without cost
    /// curves, or if none is usable.
    pub fn cheapest(&self, load: &Load, usable: impl Fn(usize) -> bool) -> Option<(usize, f64)> {
        slice::cheapest(&self.costs, load, usable)
    }

    /// Returns the step for a number of objects.
    pub fn step(&self, objects: u32) -> Option<&Step> {
        self.steps[..self.steps.partition_point(|s| s.from_objects <= objects)].last()
    }

    /// Returns the places of the first residual, which all others share.
    pub(crate) fn places(&self) -> Option<&Arc<Places>> {
        self.costs.iter().flat_map(AlgorithmCost::residuals).map(|residual| &residual.places).next()
    }

    /// Returns the first defect that makes this tuning unusable, if any.
    pub fn defect(&self) -> Option<TuningError> {
        // Without loads there are no steps, and the costs decide.
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
        let places = self.places();
        for (k, cost) in self.costs.iter().enumerate() {
            let algorithm = || cost.algorithm.clone();
            let other = |own: &Residual| places.is_some_and(|p| !Arc::ptr_eq(p, &own.places) && **p != *own.places);
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
}

#[cfg(test)]
mod tests;
