//! Coefficients that turn hardware parameters into cost curves.

mod curve;
mod feature;
mod gpu_set;
mod predict;
mod scale;

use crate::hardware::{GpuKind, parameter};
use crate::schema_tag::schema_tag;
use crate::{BackendClass, Term};

pub use feature::Feature;
pub use predict::{ASK, Prediction};
pub use scale::Scale;

schema_tag!(
    /// `model/2`.
    pub ModelSchema = "model/2"
);

/// What stands before the name of a GPU's parameter in a [`Range`]: `gpu/upload_rate_gb_per_s`.
pub const GPU_PREFIX: &str = "gpu/";

/// A cost model for every method and class of processor, shared over machines, thread counts and GPUs, evaluated by plain
/// arithmetic.
///
/// The time of a frame is `sum of unit * scale(hardware, backend) * term(load)`, times `exp` of a ridge residual.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Model {
    /// Always `model/2`.
    pub schema: ModelSchema,
    /// Name by which tuning refer to it.
    pub name: String,
    /// Whether a report behind it is simulated, which makes its predictions no evidence of anything.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "std::ops::Not::not"))]
    pub simulated: bool,
    /// Lowest and highest value of each hardware parameter in training; a machine outside is extrapolated.
    pub ranges: Vec<Range>,
    /// One cost model for each method on each class of processor.
    pub methods: Vec<MethodModel>,
}

/// Where a hardware parameter lay in training.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MethodModel {
    /// The part of the algorithm's id before the `@`.
    pub method: String,
    /// The processor that it holds for. A file that does not say so is from before there were GPUs.
    #[cfg_attr(feature = "model", serde(default))]
    pub backend: BackendClass,
    /// Revision of the algorithm that was timed.
    pub revision: u32,
    /// Most threads that were timed, of GPUs the most that were timed together; more are extrapolated.
    pub max_threads: u32,
    /// Kinds of the GPUs that were timed, without repetition; others are extrapolated. Empty for the CPU.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub gpu_kinds: Vec<GpuKind>,
    /// Fewest objects that were timed; the residual is held constant below.
    pub min_objects: u32,
    /// Most objects that were timed; the residual is held constant above, where its slopes would carry it anywhere.
    pub max_objects: u32,
    /// The physical terms; no unit is negative.
    pub terms: Vec<ModelTerm>,
    /// Terms of the fallback, where the algorithm has one: [`CostCurve::fallback_terms`](crate::CostCurve::fallback_terms).
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Vec::is_empty"))]
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
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

impl Model {
    /// The model that comes with this library: `models/default.json`, whose card is `models/README.md`.
    ///
    /// # Errors
    /// When the file that was built in is no sound model, which the tests rule out.
    #[cfg(feature = "model")]
    pub fn built_in() -> Result<Self, crate::json::JsonError> {
        crate::json::model(include_str!("../models/default.json"))
    }

    /// Names of the hardware parameters that a prediction looks at, those of GPUs aside, each once: for its costs, and to tell
    /// whether the machine is like those of training.
    #[must_use]
    pub fn parameters(&self) -> Vec<&str> {
        let of_method = |m: &MethodModel| {
            let scales = m.terms.iter().chain(&m.fallback_terms).flat_map(|t| t.scale.parameters());
            let features = m.residual.iter().flat_map(|r| r.feature.parameters());
            let cache = (m.backend == BackendClass::Cpu).then_some(&parameter::CACHE_LLC_BYTES);
            scales.chain(features).chain(cache).copied().collect::<Vec<_>>()
        };
        let ranges = self.ranges.iter().map(|r| r.parameter.as_str()).filter(|name| !name.starts_with(GPU_PREFIX));
        let mut names: Vec<&str> = self.methods.iter().flat_map(of_method).chain(ranges).collect();
        names.sort_unstable();
        names.dedup();
        names
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
            let name = format!("{} on the {}", m.method, m.backend);
            if let Some(t) = m.terms.iter().chain(&m.fallback_terms).find(|t| !t.scale.is_of(m.backend)) {
                return Some(format!("{name}: the scale {:?} is of another processor", t.scale));
            }
            if let Some(r) = m.residual.iter().find(|r| !r.feature.is_of(m.backend)) {
                return Some(format!("{name}: the feature {:?} is of another processor", r.feature));
            }
            if let Some(t) = m.terms.iter().chain(&m.fallback_terms).find(|t| !(t.unit.is_finite() && t.unit >= 0.0)) {
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

#[cfg(test)]
mod tests;
