//! Coefficients that turn hardware parameters into cost curves.

use crate::hardware::{Hardware, parameter};
use crate::schema_tag::schema_tag;
use crate::{AlgorithmCost, AlgorithmId, Backend, CostCurve, CostTerm, Knot, Load, Term};

schema_tag!(
    /// `model/1`.
    ModelSchema = "model/1"
);

/// A cost model for every method, shared over machines and thread counts, evaluated by plain arithmetic.
///
/// The time of a frame is `sum of unit * scale(hardware, threads) * term(load)`, times `exp` of a ridge residual.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Model {
    /// Always `model/1`.
    pub schema: ModelSchema,
    /// Name by which fields refer to it.
    pub name: String,
    /// The reports behind it.
    pub trained_on: Vec<TrainingReport>,
    /// Lowest and highest value of each hardware parameter in training; a machine outside is extrapolated.
    pub ranges: Vec<Range>,
    /// One cost model for each method.
    pub methods: Vec<MethodModel>,
    /// How well it did on what it had not seen.
    pub validation: Validation,
}

/// One report that a model was trained on.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TrainingReport {
    /// File name without folders.
    pub file: String,
    /// [`Machine::physical_id`](crate::Machine::physical_id) of its machine.
    pub physical_id: String,
    /// What kind of evidence it is.
    pub label: crate::report::Label,
}

/// Where a hardware parameter lay in training.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Range {
    /// Name of the parameter.
    pub parameter: String,
    /// Lowest value.
    pub min: f64,
    /// Highest value.
    pub max: f64,
}

/// The cost model of one method on the CPU, for any number of threads.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MethodModel {
    /// The part of the algorithm's id before the `@`.
    pub method: String,
    /// Revision of the algorithm that was timed.
    pub revision: u32,
    /// Most threads that were timed; more are extrapolated.
    pub max_threads: u32,
    /// Fewest objects that were timed; the residual is held constant below.
    pub min_objects: u32,
    /// Most objects that were timed; the residual is held constant above, where its slopes would carry it anywhere.
    pub max_objects: u32,
    /// The physical terms; no unit is negative.
    pub terms: Vec<ModelTerm>,
    /// Constant of the residual.
    pub residual_intercept: f64,
    /// Slopes of the residual on the natural logarithm of measured over modelled time.
    pub residual: Vec<ResidualTerm>,
    /// Standard deviation of what remains, in natural logarithms.
    pub spread_ln: f64,
}

/// One physical term.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ModelTerm {
    /// What is counted.
    pub term: Term,
    /// What of the hardware one count costs.
    pub scale: Scale,
    /// How much of that: cycles, bytes, or fork-joins for each count.
    pub unit: f64,
}

/// Nanoseconds that one unit of work takes on a machine, with `k` threads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Scale {
    /// One cycle of one core: 1 / clock. Work that is not divided among threads.
    Cycle,
    /// One cycle of `k` cores: 1 / (clock * measured scaling of `k` threads).
    SharedCycle,
    /// One lane of one cycle of `k` cores: 1 / (clock * lanes * measured scaling of `k` threads).
    SharedLane,
    /// One byte at the memory bandwidth of `k` threads.
    Byte,
    /// One fork and join of a pool that sleeps, as it does between frames; nothing with one thread.
    ForkJoin,
}

/// One slope of the residual.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ResidualTerm {
    /// What it is a slope on.
    pub feature: Feature,
    /// Mean of the feature in training, taken off before the slope is applied.
    pub centre: f64,
    /// The slope.
    pub slope: f64,
}

/// What a residual may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Feature {
    /// Base-2 logarithm of the number of objects.
    Log2Objects,
    /// Its square.
    Log2ObjectsSquared,
    /// Base-2 logarithm of the SIMD lanes.
    Log2Lanes,
    /// Base-2 logarithm of the threads of the algorithm.
    Log2Threads,
}

/// How a model did on machines, or profiles, that were left out of its training.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Validation {
    /// What was left out in turn: `physical machine`, or `profile` where there is one physical machine only. The latter
    /// says little about machines never seen.
    pub held_out: String,
    /// Physical machines in the data.
    pub physical_machines: usize,
    /// Profiles, that is reports, in the data.
    pub profiles: usize,
    /// The methods that were compared.
    pub methods: Vec<MethodScore>,
}

/// The score of one way to choose an algorithm. Regret is the time of its choice over the time of the best, less one.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MethodScore {
    /// Name of the way to choose.
    pub name: String,
    /// Regret, mean over the points of a held-out report, then over the reports.
    pub mean_regret: f64,
    /// 95th percentile over held-out reports of their mean regret.
    pub p95_regret: f64,
    /// Share of all points with a regret over 10 %.
    pub share_over_10_percent: f64,
    /// How much of the gap between the best single algorithm (0) and the oracle (1) it closes.
    pub closed_gap: f64,
}

/// Cost curves for one machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// One curve for each algorithm that could be predicted.
    pub costs: Vec<AlgorithmCost>,
    /// Whether the machine or an algorithm lies outside what the model was trained on.
    pub extrapolated: bool,
    /// What was outside, what was missing, what was left out.
    pub warnings: Vec<String>,
}

/// Objects at which the correction of a predicted curve is tabulated: 2^3 to 2^24, every octave.
const CORRECTION_OCTAVES: std::ops::RangeInclusive<u32> = 3..=24;

impl Model {
    /// The model that comes with this library: `models/default.json`, whose card is `models/README.md`.
    ///
    /// # Errors
    /// When the file that was built in is no sound model, which the tests rule out.
    #[cfg(feature = "model")]
    pub fn built_in() -> Result<Self, crate::json::JsonError> {
        crate::json::model(include_str!("../models/default.json"))
    }

    /// Predicts the cost curves of `algorithms`, given with the revisions that will run, on a machine.
    ///
    /// # Errors
    /// A sentence, when no algorithm can be predicted.
    pub fn predict(&self, hardware: &Hardware, algorithms: &[(AlgorithmId, u32)]) -> Result<Prediction, String> {
        let mut warnings: Vec<String> = self.ranges.iter().filter_map(|r| r.excess(hardware)).collect();
        if self.ranges.is_empty() {
            warnings.push(format!("the model {} does not say what it was trained on", self.name));
        }
        let mut extrapolated = !warnings.is_empty();
        let mut costs = Vec::new();
        for (id, revision) in algorithms {
            let Backend::Cpu(threads) = *id.backend() else { continue };
            let Some(method) = self.methods.iter().find(|m| m.method == id.method()) else {
                warnings.push(format!("{id} is left out: the model {} was not trained on it", self.name));
                continue;
            };
            if method.revision != *revision {
                warnings.push(format!(
                    "{id} is left out: the model knows its revision {}, this build has {revision}; train on new reports",
                    method.revision
                ));
                continue;
            }
            if threads > method.max_threads {
                warnings.push(format!("{id}: the model has seen {} threads at most", method.max_threads));
                extrapolated = true;
            }
            let sound = |curve: CostCurve| curve.defect().map_or(Ok(curve), Err);
            match method.curve(hardware, threads).and_then(sound) {
                Ok(curve) => costs.push(AlgorithmCost {
                    algorithm: id.clone(),
                    revision: *revision,
                    curve,
                    spread_ln: method.spread_ln,
                }),
                Err(missing) => warnings.push(format!("{id} is left out: {missing}")),
            }
        }
        if costs.is_empty() {
            return Err(format!("the model {} predicts none of these algorithms: {}", self.name, warnings.join("; ")));
        }
        Ok(Prediction { costs, extrapolated, warnings })
    }

    /// What makes this model unusable, if anything.
    #[must_use]
    pub fn defect(&self) -> Option<String> {
        if self.methods.is_empty() {
            return Some("it holds no method".to_owned());
        }
        if let Some(r) = self.ranges.iter().find(|r| !(r.min.is_finite() && r.max.is_finite() && r.min <= r.max)) {
            return Some(format!("the range of {} is {} to {}", r.parameter, r.min, r.max));
        }
        for m in &self.methods {
            let name = &m.method;
            if let Some(t) = m.terms.iter().find(|t| !(t.unit.is_finite() && t.unit >= 0.0)) {
                return Some(format!("{name}: the term {:?} has the unit {}", t.term, t.unit));
            }
            if m.terms.iter().all(|t| t.unit == 0.0) {
                return Some(format!("{name}: no term above zero"));
            }
            let finite = m.residual.iter().all(|r| r.centre.is_finite() && r.slope.is_finite());
            if !finite || !m.residual_intercept.is_finite() || !m.spread_ln.is_finite() || m.spread_ln < 0.0 {
                return Some(format!("{name}: a residual or spread that is not finite"));
            }
        }
        None
    }
}

impl Range {
    /// A warning when the machine lies outside by more than a tenth.
    fn excess(&self, hardware: &Hardware) -> Option<String> {
        let value = hardware.value(&self.parameter)?;
        (value < self.min / 1.1 || value > self.max * 1.1)
            .then(|| format!("{} is {value:.4}, outside the {:.4} to {:.4} of training", self.parameter, self.min, self.max))
    }
}

impl MethodModel {
    /// The cost curve of this method with `threads` threads on a machine.
    ///
    /// # Errors
    /// Names the hardware parameter that is missing.
    pub fn curve(&self, hardware: &Hardware, threads: u32) -> Result<CostCurve, String> {
        let mut terms: Vec<CostTerm> = Vec::new();
        for t in self.terms.iter().filter(|t| t.unit > 0.0) {
            let unit_ns = t.unit * t.scale.nanoseconds(hardware, threads)?;
            match terms.iter_mut().find(|c| c.term == t.term) {
                Some(same) => same.unit_ns += unit_ns,
                None => terms.push(CostTerm { term: t.term, unit_ns }),
            }
        }
        let mut correction = Vec::new();
        if !self.residual.is_empty() || self.residual_intercept != 0.0 {
            for octave in CORRECTION_OCTAVES {
                let objects = (1 << octave).min(self.max_objects).max(self.min_objects);
                let load = Load { objects, ..Load::default() };
                correction
                    .push(Knot { log2_objects: f64::from(octave), ln_factor: self.ln_residual(hardware, threads, &load)? });
            }
        }
        Ok(CostCurve { terms, cache_bytes: need(hardware, parameter::CACHE_LLC_BYTES)?, correction })
    }

    fn ln_residual(&self, hardware: &Hardware, threads: u32, load: &Load) -> Result<f64, String> {
        let mut sum = self.residual_intercept;
        for r in &self.residual {
            sum += r.slope * (r.feature.value(hardware, threads, load)? - r.centre);
        }
        Ok(sum)
    }
}

impl Feature {
    /// The feature of an algorithm with `threads` threads on a machine under a load.
    ///
    /// # Errors
    /// Names the hardware parameter that is missing.
    pub fn value(self, hardware: &Hardware, threads: u32, load: &Load) -> Result<f64, String> {
        let octaves = f64::from(load.objects.max(1)).log2();
        Ok(match self {
            Self::Log2Objects => octaves,
            Self::Log2ObjectsSquared => octaves * octaves,
            Self::Log2Lanes => need(hardware, parameter::SIMD_LANES)?.log2(),
            Self::Log2Threads => f64::from(threads).log2(),
        })
    }
}

impl Scale {
    /// Nanoseconds that one unit takes with `threads` threads.
    ///
    /// # Errors
    /// Names the hardware parameter that is missing.
    pub fn nanoseconds(self, hardware: &Hardware, threads: u32) -> Result<f64, String> {
        let cycle = || {
            let measured = need(hardware, parameter::CLOCK_MEASURED_GHZ);
            measured.or_else(|e| need(hardware, parameter::CLOCK_REPORTED_GHZ).map_err(|_| e)).map(|ghz| 1.0 / ghz)
        };
        Ok(match self {
            Self::Cycle => cycle()?,
            Self::SharedCycle => cycle()? / speed_up(hardware, threads)?,
            Self::SharedLane => cycle()? / speed_up(hardware, threads)? / need(hardware, parameter::SIMD_LANES)?,
            Self::Byte => 1.0 / bandwidth(hardware, threads)?,
            Self::ForkJoin if threads == 1 => 0.0,
            Self::ForkJoin => need(hardware, parameter::FORK_JOIN_COLD_NS)?,
        })
    }
}

/// A parameter that must be there and above zero.
fn need(hardware: &Hardware, name: &str) -> Result<f64, String> {
    match hardware.value(name) {
        Some(value) if value > 0.0 && value.is_finite() => Ok(value),
        Some(value) => Err(format!("the hardware parameter {name} is {value}")),
        None => Err(format!("the hardware parameter {name} is missing; measure it with `sapwise probe --hardware-only`")),
    }
}

/// Work of `threads` threads over work of one, interpolated on logarithmic axes between one, two and all.
fn speed_up(hardware: &Hardware, threads: u32) -> Result<f64, String> {
    if threads <= 1 {
        return Ok(1.0);
    }
    let cores = need(hardware, parameter::USABLE_CORES)?;
    let all = need(hardware, parameter::SCALING_ALL_THREADS_RATIO)?;
    let k = f64::from(threads);
    if k >= cores {
        return Ok(all);
    }
    let two = need(hardware, parameter::SCALING_TWO_THREADS_RATIO)?;
    let share = if cores > 2.0 { (k / 2.0).ln() / (cores / 2.0).ln() } else { 1.0 };
    Ok((two.ln() * (1.0 - share) + all.ln() * share).exp())
}

/// Memory bandwidth of `threads` threads in GB/s, which is bytes per nanosecond.
fn bandwidth(hardware: &Hardware, threads: u32) -> Result<f64, String> {
    let one = need(hardware, parameter::BANDWIDTH_ONE_THREAD_GB_PER_S)?;
    if threads <= 1 {
        return Ok(one);
    }
    let all = need(hardware, parameter::BANDWIDTH_ALL_THREADS_GB_PER_S)?;
    Ok((one * f64::from(threads)).min(all))
}
