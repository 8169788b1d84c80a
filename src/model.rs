//! Coefficients that turn hardware parameters into cost curves.

mod curve;
mod error;
mod feature;
mod gpu_set;
mod needed;
mod predict;
mod scale;

use crate::hardware::{GpuKind, ParameterId};
use crate::{BackendClass, Term};

pub use error::{ModelError, PredictError};
pub use feature::Feature;
pub use predict::{ASK, Prediction};
pub use scale::Scale;

/// What stands before the name of a GPU's parameter in a [`Range`]: `gpu/upload_rate_gb_per_s`.
pub const GPU_PREFIX: &str = "gpu/";

/// A cost model for every method and class of processor, shared over machines, thread counts and GPUs, evaluated by plain
/// arithmetic.
///
/// The time of a frame is `sum of unit * scale(hardware, backend) * term(load)`, times `exp` of a ridge residual.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Model {
    /// Name by which tuning refers to it.
    pub name: String,
    /// Whether a report behind it is simulated, which makes its predictions no evidence of anything.
    pub simulated: bool,
    /// Lowest and highest value of each hardware parameter in training; a machine outside is extrapolated.
    pub ranges: Vec<Range>,
    /// One cost model for each method on each class of processor.
    pub methods: Vec<MethodModel>,
}

/// Where a hardware parameter lay in training.
#[derive(Debug, Clone, PartialEq)]
pub struct Range {
    /// Name of the parameter; that of a GPU after [`GPU_PREFIX`].
    pub parameter: String,
    /// Lowest value.
    pub min: f64,
    /// Highest value.
    pub max: f64,
}

/// The cost model of one method on one class of processor, for any number of threads or GPUs.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MethodModel {
    /// The part of the algorithm's id before the `@`.
    pub method: String,
    /// The processor that it holds for. A file that does not say so is from before there were GPUs.
    pub backend: BackendClass,
    /// Revision of the algorithm that was timed.
    pub revision: u32,
    /// Most threads that were timed, of GPUs the most that were timed together; more are extrapolated.
    pub max_threads: u32,
    /// Kinds of the GPUs that were timed, without repetition; others are extrapolated. Empty for the CPU.
    pub gpu_kinds: Vec<GpuKind>,
    /// Fewest objects that were timed; the residual is held constant below.
    pub min_objects: u32,
    /// Most objects that were timed; the residual is held constant above, where its slopes would carry it anywhere.
    pub max_objects: u32,
    /// The physical terms; no unit is negative.
    pub terms: Vec<ModelTerm>,
    /// Terms of the fallback, where the algorithm has one: [`CostCurve::fallback_terms`](crate::CostCurve::fallback_terms).
    pub fallback_terms: Vec<ModelTerm>,
    /// Constant of the residual.
    pub residual_intercept: f64,
    /// Slopes of the residual on the natural logarithm of measured over modelled time.
    pub residual: Vec<ResidualTerm>,
    /// Standard deviation of what remains, in natural logarithms.
    pub spread_ln: f64,
}

/// One physical term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelTerm {
    /// What is counted.
    pub term: Term,
    /// What of the hardware one count costs.
    pub scale: Scale,
    /// How much of that: cycles, bytes, fork-joins, round trips or operations for each count.
    pub unit: f64,
}

/// One slope of the residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualTerm {
    /// What it is a slope on.
    pub feature: Feature,
    /// Mean of the feature in training, taken off before the slope is applied.
    pub centre: f64,
    /// The slope.
    pub slope: f64,
}

impl MethodModel {
    /// A method on a class of processor, of which nothing was timed: no terms, one thread, no objects.
    #[must_use]
    pub fn new(method: impl Into<String>, backend: BackendClass, revision: u32) -> Self {
        Self {
            method: method.into(),
            backend,
            revision,
            max_threads: 1,
            gpu_kinds: Vec::new(),
            min_objects: 0,
            max_objects: 0,
            terms: Vec::new(),
            fallback_terms: Vec::new(),
            residual_intercept: 0.0,
            residual: Vec::new(),
            spread_ln: 0.0,
        }
    }

    /// The same by its physical terms alone.
    #[must_use]
    pub fn without_residual(&self) -> Self {
        Self { residual: Vec::new(), residual_intercept: 0.0, ..self.clone() }
    }

    /// What can not be of it, if anything.
    fn defect(&self) -> Option<String> {
        let terms = || self.terms.iter().chain(&self.fallback_terms);
        if let Some(t) = terms().find(|t| !t.scale.is_of(self.backend)) {
            return Some(format!("the scale {} is of another processor", t.scale));
        }
        if let Some(r) = self.residual.iter().find(|r| !r.feature.is_of(self.backend)) {
            return Some(format!("the feature {} is of another processor", r.feature));
        }
        if let Some(t) = terms().find(|t| !(t.unit.is_finite() && t.unit >= 0.0)) {
            return Some(format!("the term {:?} has the unit {}", t.term, t.unit));
        }
        if self.terms.iter().all(|t| t.unit == 0.0) {
            return Some("no term above zero".to_owned());
        }
        let finite = self.residual.iter().all(|r| r.centre.is_finite() && r.slope.is_finite());
        (!finite || !self.residual_intercept.is_finite() || !self.spread_ln.is_finite() || self.spread_ln < 0.0)
            .then(|| "a residual or spread that is not finite".to_owned())
    }
}

impl Model {
    /// A model of these methods, from the ranges of its training.
    #[must_use]
    pub fn new(name: impl Into<String>, methods: Vec<MethodModel>, ranges: Vec<Range>) -> Self {
        Self { name: name.into(), simulated: false, ranges, methods }
    }

    /// The hardware parameters that a prediction looks at, those of GPUs aside, each once: for its costs, and to tell whether the machine
    /// is like those of training.
    #[must_use]
    pub fn parameters(&self) -> Vec<ParameterId> {
        let of_method = |m: &MethodModel| {
            let scales = m.terms.iter().chain(&m.fallback_terms).flat_map(|t| t.scale.parameters());
            let features = m.residual.iter().flat_map(|r| r.feature.parameters());
            let cache = (m.backend == BackendClass::Cpu).then_some(&ParameterId::CacheLlcBytes);
            scales.chain(features).chain(cache).copied().collect::<Vec<_>>()
        };
        // A range of a parameter that this version does not know is none that it can measure.
        let ranges = self.ranges.iter().filter_map(|r| r.parameter.parse().ok());
        let mut ids: Vec<ParameterId> = self.methods.iter().flat_map(of_method).chain(ranges).collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    /// What makes this model unusable, if anything.
    #[must_use]
    pub fn defect(&self) -> Option<ModelError> {
        if self.methods.is_empty() {
            return Some(ModelError::NoMethod);
        }
        if let Some(r) = self.ranges.iter().find(|r| !(r.min.is_finite() && r.max.is_finite() && r.min <= r.max)) {
            return Some(ModelError::Range { parameter: r.parameter.clone() });
        }
        self.methods.iter().find_map(|m| {
            let method = format!("{} on the {}", m.method, m.backend);
            m.defect().map(|why| ModelError::Method { method, why })
        })
    }
}

#[cfg(test)]
mod tests;
