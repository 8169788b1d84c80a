//! Cost models: coefficients that turn hardware parameters into cost curves.

mod curve;
mod error;
mod gpu_set;
mod helpers;
mod needed;
mod predict;
mod range;
mod residual;
mod scale;

use crate::hardware::ParameterId;
use sapwise::algorithm::BackendClass;
use sapwise::internals::{GpuKind, Places};
use sapwise::tuning::Term;
use std::sync::Arc;

pub use error::PredictError;
pub use helpers::{HelpersModel, ThreadFigures};
pub use predict::Prediction;
pub use range::Range;
pub use residual::GroupResidual;
pub use scale::Scale;

/// Prefix of a GPU's parameter in a [`Range`]: `gpu/upload_rate_gb_per_s`.
pub const GPU_PREFIX: &str = "gpu/";

/// A cost model for every method and class of processor, shared by machines, thread counts and GPUs, evaluated by
/// plain arithmetic.
///
/// The time of a frame on one thread, or on GPUs, is `sum of unit * scale(hardware, backend) * term(load)`, times
/// `exp` of a [residual](GroupResidual) over the load. [Helpers](HelpersModel) turn it into the time on several
/// threads.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Model {
    /// Name by which tuning refers to it.
    pub name: String,
    /// Lowest and highest value of each hardware parameter in training; a machine outside is extrapolated.
    pub ranges: Vec<Range>,
    /// On held-out machines nine of ten ratios of the times of two algorithms were within a factor of e to this of
    /// their prediction. `None` if fewer than two machines were held out.
    pub ratios_90_ln: Option<f64>,
    /// Loads at which the residuals of all methods are known.
    pub places: Arc<Places>,
    /// One cost model for each method on each class of processor.
    pub methods: Vec<MethodModel>,
}

/// The cost model of one method on one class of processor, for any number of threads or GPUs.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct MethodModel {
    /// The part of the algorithm's id before the `@`.
    pub method: String,
    /// Class of processor.
    #[serde(default)]
    pub backend: BackendClass,
    /// Revision of the algorithm that was timed.
    pub revision: u32,
    /// Most threads, or most GPUs together, that were timed; more are extrapolated.
    pub max_threads: u32,
    /// Kinds of the GPUs that were timed; others are extrapolated. Empty for the CPU.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gpu_kinds: Vec<GpuKind>,
    /// The physical terms, on one thread or on GPUs; no unit is negative.
    pub terms: Vec<ModelTerm>,
    /// The method that it falls back to when that is cheaper, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fallback: Option<FallbackModel>,
    /// What the terms leave unexplained, for each SIMD level of the training; on GPUs for all. Empty if nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub residual: Vec<GroupResidual>,
    /// Whether the residuals depend on how far boxes move, as for incremental methods.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub residual_by_motion: bool,
    /// Effect of several threads; `None` for a method that runs on one thread only, or on GPUs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub helpers: Option<HelpersModel>,
    /// Standard deviation of the remaining error, in natural logarithms.
    pub spread_ln: f64,
}

/// A method that another one falls back to.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub struct FallbackModel {
    /// Its name. It has no fallback itself.
    pub method: String,
    /// Factor on its cost there.
    pub factor: f64,
}

/// One physical term.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub struct ModelTerm {
    /// What is counted.
    pub term: Term,
    /// The unit of hardware that each count takes.
    pub scale: Scale,
    /// How many of that unit: cycles, bytes, fork-joins, round trips or operations for each count.
    pub unit: f64,
}

impl MethodModel {
    /// Creates a method without terms on one thread of a class of processor.
    pub fn new(method: impl Into<String>, backend: BackendClass, revision: u32) -> Self {
        Self {
            method: method.into(),
            backend,
            revision,
            max_threads: 1,
            gpu_kinds: Vec::new(),
            terms: Vec::new(),
            fallback: None,
            residual: Vec::new(),
            residual_by_motion: false,
            helpers: None,
            spread_ln: 0.0,
        }
    }

    /// Returns the method with its physical terms and helpers alone.
    #[must_use]
    pub fn without_residual(&self) -> Self {
        Self { residual: Vec::new(), ..self.clone() }
    }

    /// Returns what makes it unusable, if anything.
    fn defect(&self, places: usize) -> Option<String> {
        let axes = usize::from(self.backend == BackendClass::Cpu);
        if let Some(t) = self.terms.iter().find(|t| !t.scale.is_of(self.backend)) {
            Some(format!("the scale {} is of another processor", t.scale))
        } else if self.helpers.is_some() && self.backend != BackendClass::Cpu {
            Some("helpers are of the CPU".to_owned())
        } else if self.helpers.is_some_and(|h| !h.is_sound()) {
            Some("its helpers have a value that is negative or not finite".to_owned())
        } else if let Some(t) = self.terms.iter().find(|t| !(t.unit.is_finite() && t.unit >= 0.0)) {
            Some(format!("the term {:?} has the unit {}", t.term, t.unit))
        } else if self.terms.iter().all(|t| t.unit == 0.0) {
            Some("no term is above zero".to_owned())
        } else if !(0.0..f64::INFINITY).contains(&self.spread_ln) {
            Some(format!("its spread is {}", self.spread_ln))
        } else {
            GroupResidual::defect(&self.residual, places, axes)
        }
    }
}

impl Model {
    /// Creates a model of these methods from the ranges of its training.
    pub fn new(name: impl Into<String>, methods: Vec<MethodModel>, ranges: Vec<Range>) -> Self {
        Self { name: name.into(), ranges, ratios_90_ln: None, places: Arc::new(Places::new(Vec::new())), methods }
    }

    /// Returns the hardware parameters that a prediction reads, without those of GPUs, each once: for costs and for
    /// ranges.
    pub fn parameters(&self) -> Vec<ParameterId> {
        let of_method = |m: &MethodModel| {
            let scales = m.terms.iter().flat_map(|t| t.scale.parameters());
            let helpers = m.helpers.iter().flat_map(|_| HelpersModel::PARAMETERS);
            let cpu = [ParameterId::CacheLlcBytes, ParameterId::SimdLanes];
            let cpu = cpu.into_iter().filter(|_| m.backend == BackendClass::Cpu);
            scales.chain(helpers).copied().chain(cpu).collect::<Vec<_>>()
        };
        // This version can't measure a parameter that it does not know.
        let ranges = self.ranges.iter().filter_map(|r| r.parameter.parse().ok());
        let mut ids: Vec<ParameterId> = self.methods.iter().flat_map(of_method).chain(ranges).collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    /// Returns what makes this model unusable, if anything.
    pub fn defect(&self) -> Option<String> {
        let places = self.places.loads();
        let of_range = |r: &Range| Some(format!("the range of {} has {}", r.parameter, r.defect()?));
        let of_method = |m: &MethodModel| {
            let why =
                m.fallback.as_ref().and_then(|f| self.fallback_defect(m, f)).or_else(|| m.defect(places.len()))?;
            Some(format!("{} on the {}: {why}", m.method, m.backend))
        };
        if self.methods.is_empty() {
            Some("it holds no method".to_owned())
        } else if let Some(wrong) = self.ranges.iter().find_map(of_range) {
            Some(wrong)
        } else if self.ratios_90_ln.is_some_and(|ln| !(0.0..=50.0).contains(&ln)) {
            Some("its intervals have a width that is negative or not finite".to_owned())
        } else if let Some(position) = places.iter().position(|load| !load.is_sound()) {
            Some(format!("places[{position}] is a load that is negative or not finite"))
        } else {
            self.methods.iter().find_map(of_method)
        }
    }

    fn fallback_defect(&self, of: &MethodModel, FallbackModel { method, factor }: &FallbackModel) -> Option<String> {
        let known = self.of_method(method, of.backend).is_some_and(|other| other.fallback.is_none());
        (!known || !(0.01..=100.0).contains(factor))
            .then(|| format!("it falls back to {method} at {factor} times its cost, which is no such method"))
    }
}

#[cfg(test)]
mod tests;
