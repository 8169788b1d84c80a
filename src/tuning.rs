//! The fields of optimal performance: for each load the cheapest algorithm.

mod slice;

use crate::cost::Counts;
use crate::schema_tag::schema_tag;
use crate::{AlgorithmId, CostCurve, Load, Registry};

pub(crate) use slice::Slice;

schema_tag!(
    /// `tuning/1`.
    pub TuningSchema = "tuning/1"
);

/// Which algorithm to run under which load, and where that knowledge came from.
///
/// With cost curves the choice depends on the whole [`Load`]; without them on the number of objects alone, through
/// `steps`, as the paper does it and as a hand-written list of thresholds does.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Tuning {
    /// Always `tuning/1`.
    pub schema: TuningSchema,
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
    /// The cheapest algorithm over the number of objects in that scenario, ascending: each holds until the next begins.
    pub steps: Vec<Step>,
    /// Where one step gives way to the next, in the order of `steps`.
    pub crossovers: Vec<Crossover>,
    /// What `low` and `high` of the crossovers are made of, and why some have none.
    pub interval_basis: String,
    /// The cost of each algorithm. Empty: `steps` decide.
    pub costs: Vec<AlgorithmCost>,
    /// The samples by which a prediction was corrected before the first frame, in the order in which they were taken.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub samples: Vec<Observation>,
}

/// Where tuning came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Source {
    /// Written down by hand.
    Default,
    /// From hardware parameters, by a model trained on reports.
    Predicted,
    /// From timings of the algorithms on this machine.
    Measured,
    /// Predicted, then corrected by frames that were run: by samples before the first one ([`Tuning::samples`]), or on line.
    Learned,
}

/// From this many objects up, this algorithm.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Step {
    /// First number of objects.
    pub from_objects: u32,
    /// The algorithm.
    pub algorithm: AlgorithmId,
}

/// A border between two neighbouring tuning.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Crossover {
    /// The cheaper algorithm with fewer objects.
    pub below: AlgorithmId,
    /// The cheaper algorithm with more objects.
    pub above: AlgorithmId,
    /// Number of objects at which both cost the same.
    pub objects: f64,
    /// Lower end of the interval; where it may lie lower still, the least objects of the slice. `None`, like `high`, where no
    /// interval can be claimed: [`Tuning::interval_basis`] says why.
    pub low: Option<f64>,
    /// Upper end of the interval; where it may lie higher still, the most objects of the slice.
    pub high: Option<f64>,
}

/// The cost of one algorithm.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

/// One algorithm, timed on some frames of the slice's scenario.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Observation {
    /// The algorithm.
    pub algorithm: AlgorithmId,
    /// Number of objects.
    pub objects: u32,
    /// What the model predicted for it, without any sample.
    pub predicted_ns: f64,
    /// Median over the frames.
    pub measured_ns: f64,
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

impl Crossover {
    /// Both ends of the interval, where one is claimed.
    #[must_use]
    pub fn interval(&self) -> Option<(f64, f64)> {
        self.low.zip(self.high)
    }

    fn is_sound(&self) -> bool {
        match (self.low, self.high) {
            (Some(low), Some(high)) => 0.0 <= low && low <= self.objects && self.objects <= high,
            (None, None) => self.objects >= 0.0,
            _ => false,
        }
    }
}

impl Tuning {
    /// Tuning from a hand-written list of thresholds: from `objects` up, that algorithm.
    ///
    /// # Errors
    /// A sentence, when the list is empty, does not begin at 0 or is not ascending.
    pub fn from_steps(steps: Vec<Step>) -> Result<Self, String> {
        let tuning = Self { steps, ..Self::empty(Source::Default) };
        tuning.defect().map_or(Ok(tuning), Err)
    }

    /// Tuning for when nothing is known about the machine: borders in objects, written down by hand.
    ///
    /// They are the rounded borders of `uniform` on one machine (two cores of an AMD EPYC 9005 under KVM, AVX-512), with
    /// pinned threads ([`Registry::pin_threads`]) and its two cores standing for all of them. Any other machine has others: predict
    /// or measure them. Where boxes move far `pair-cache` runs the strips, so that one list holds for both.
    #[must_use]
    pub fn usual(registry: &Registry) -> Self {
        let step = |from_objects, method, threads| Step { from_objects, algorithm: AlgorithmId::cpu(method, threads) };
        let mut steps = vec![step(0, "brute", 1), step(80, "pair-cache", 1)];
        let parallel = registry.entries().iter().filter(|e| e.id.method() == "pair-cache" && e.unavailable.is_none());
        if let Some(cores) = parallel.map(|e| e.id.threads()).max().filter(|&cores| cores > 1) {
            steps.push(step(3000, "pair-cache", cores));
        }
        Self { steps, scenario: "uniform".to_owned(), ..Self::empty(Source::Default) }
    }

    /// Tuning from cost curves, with `steps` and `crossovers` for the slice through `loads`, ascending by objects.
    ///
    /// The loads are interpolated between each other, so a handful per decade is enough. A field narrower than 3 % in objects may
    /// be missed. Intervals follow from the curves'
    /// `spread_ln`: where the logarithms of two costs differ by less than 1.645 standard deviations of that difference.
    #[must_use]
    pub fn from_costs(source: Source, scenario: &str, costs: Vec<AlgorithmCost>, loads: &[Load]) -> Self {
        let spreads: Vec<f64> = costs.iter().map(|c| c.spread_ln).collect();
        let spread = |below: usize, above: usize, _: &Load| spreads[below].hypot(spreads[above]);
        let mut tuning = Self::from_costs_with(source, scenario, costs, loads, spread);
        tuning.interval_basis =
            "90 % of a normal distribution with the spread of measured over modelled time of the two algorithms".to_owned();
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
            schema: TuningSchema,
            source,
            model: None,
            extrapolated: false,
            warnings: Vec::new(),
            scenario: String::new(),
            steps: Vec::new(),
            crossovers: Vec::new(),
            interval_basis: String::new(),
            costs: Vec::new(),
            samples: Vec::new(),
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
        let counts = Counts::new(load);
        let mut ranking: Option<Ranking> = None;
        for (k, cost) in self.costs.iter().enumerate().filter(|&(k, _)| usable(k)) {
            let ns = cost.curve.cost_of(&counts);
            ranking = Some(match ranking {
                None => Ranking { best: k, best_ns: ns, runner_up: None },
                Some(r) if ns < r.best_ns => Ranking { best: k, best_ns: ns, runner_up: Some((r.best, r.best_ns)) },
                Some(r) if r.runner_up.is_none_or(|(_, second)| ns < second) => Ranking { runner_up: Some((k, ns)), ..r },
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
    pub fn defect(&self) -> Option<String> {
        if self.steps.first().is_none_or(|s| s.from_objects != 0) {
            return Some("the steps don't begin at 0 objects".to_owned());
        }
        if !self.steps.is_sorted_by(|a, b| a.from_objects < b.from_objects) {
            return Some("the steps are not ascending".to_owned());
        }
        if let Some(b) = self.crossovers.iter().find(|b| !b.is_sound()) {
            return Some(format!("the crossover from {} to {} does not lie within its interval", b.below, b.above));
        }
        let is_time = |ns: f64| ns.is_finite() && ns > 0.0;
        if let Some(s) = self.samples.iter().find(|s| !is_time(s.predicted_ns) || !is_time(s.measured_ns)) {
            return Some(format!("the sample of {} at {} objects has no time above zero", s.algorithm, s.objects));
        }
        for (k, cost) in self.costs.iter().enumerate() {
            let id = &cost.algorithm;
            if let Some(defect) = cost.curve.defect() {
                return Some(format!("the cost of {id}: {defect}"));
            }
            if !(cost.spread_ln.is_finite() && cost.spread_ln >= 0.0) {
                return Some(format!("the cost of {id}: a spread of {}", cost.spread_ln));
            }
            if self.costs[..k].iter().any(|c| c.algorithm == *id) {
                return Some(format!("{id} stands there twice"));
            }
        }
        None
    }

    /// Notes where along the slice the cheapest algorithm changes.
    ///
    /// `spread` gives the standard deviation of the logarithm of the ratio of two costs under a load.
    fn cut(&mut self, loads: &[Load], spread: &dyn Fn(usize, usize, &Load) -> f64) {
        let slice = Slice::new(loads);
        let steps = slice.steps(&self.costs);
        let border = |w: &[(Load, usize)]| {
            let (below, above) = (w[0].1, w[1].1);
            self.border(&slice, below, above, w[1].0.objects, &|load| spread(below, above, load))
        };
        self.crossovers = steps.windows(2).map(border).collect();
        self.steps = steps
            .iter()
            .enumerate()
            .map(|(k, (load, best))| Step {
                from_objects: if k == 0 { 0 } else { load.objects },
                algorithm: self.costs[*best].algorithm.clone(),
            })
            .collect();
    }

    fn border(&self, slice: &Slice<'_>, below: usize, above: usize, objects: u32, spread: &dyn Fn(&Load) -> f64) -> Crossover {
        let (b, a) = (&self.costs[below], &self.costs[above]);
        let doubt = |load: &Load| NORMAL_90 * spread(load);
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

/// Deviations of a normal distribution to either side that hold 90 % of it.
const NORMAL_90: f64 = 1.645;

#[cfg(test)]
mod tests;
