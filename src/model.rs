//! Coefficients that turn hardware parameters into cost curves.

mod curve;
mod error;
mod gpu_set;
mod helpers;
mod needed;
mod predict;
mod scale;

use crate::cost::Places;
use crate::hardware::{GpuKind, ParameterId};
use crate::{BackendClass, Term};
use std::sync::Arc;

pub use error::{ModelError, PredictError};
pub use helpers::{HelpersModel, ThreadFigures};
pub use predict::Prediction;
pub use scale::Scale;

/// What stands before the name of a GPU's parameter in a [`Range`]: `gpu/upload_rate_gb_per_s`.
pub const GPU_PREFIX: &str = "gpu/";

/// A cost model for every method and class of processor, shared over machines, thread counts and GPUs, evaluated by plain
/// arithmetic.
///
/// The time of a frame on one thread, or on GPUs, is `sum of unit * scale(hardware, backend) * term(load)`, times `exp` of a
/// [residual](crate::Residual) over the load; [helpers](HelpersModel) make of it what several threads take.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Model {
    /// Name by which tuning refers to it.
    pub name: String,
    /// Whether a report behind it is simulated, which makes its predictions no evidence of anything.
    pub simulated: bool,
    /// Lowest and highest value of each hardware parameter in training; a machine outside is extrapolated.
    pub ranges: Vec<Range>,
    /// On machines held out of the training nine of ten ratios of the times of two algorithms lay within a factor of e to this of their prediction;
    /// `None` where fewer than two machines were held out.
    pub ratios_90_ln: Option<f64>,
    /// Loads at which the residuals of all methods are known.
    pub places: Arc<Places>,
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
    /// The physical terms, on one thread or on GPUs; no unit is negative.
    pub terms: Vec<ModelTerm>,
    /// The method that it falls back to where that is cheaper, if it does.
    pub fallback: Option<FallbackModel>,
    /// What the terms leave unexplained: a weight for each of [`Model::places`]. Empty: nothing.
    pub residual: Vec<f64>,
    /// Whether the residual tells loads apart by how far boxes move, as of incremental methods.
    pub residual_by_motion: bool,
    /// What several threads make of it; `None` of a method that runs on one thread only, or on GPUs.
    pub helpers: Option<HelpersModel>,
    /// Standard deviation of what remains, in natural logarithms.
    pub spread_ln: f64,
}

/// A method that another one falls back to.
#[derive(Debug, Clone, PartialEq)]
pub struct FallbackModel {
    /// Its name. It falls back to none itself.
    pub method: String,
    /// How many times as much it costs there.
    pub factor: f64,
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

impl MethodModel {
    /// A method on a class of processor, of which nothing was timed: no terms, one thread.
    #[must_use]
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

    /// The same by its physical terms alone.
    #[must_use]
    pub fn without_residual(&self) -> Self {
        Self { residual: Vec::new(), ..self.clone() }
    }

    /// What can not be of it, if anything.
    fn defect(&self, places: usize) -> Option<String> {
        if let Some(t) = self.terms.iter().find(|t| !t.scale.is_of(self.backend)) {
            return Some(format!("the scale {} is of another processor", t.scale));
        }
        if self.helpers.is_some() && self.backend != BackendClass::Cpu {
            return Some("helpers are of the CPU".to_owned());
        }
        if self.helpers.is_some_and(|h| !h.is_sound()) {
            return Some("helpers with a figure that is negative or no number".to_owned());
        }
        if let Some(t) = self.terms.iter().find(|t| !(t.unit.is_finite() && t.unit >= 0.0)) {
            return Some(format!("the term {:?} has the unit {}", t.term, t.unit));
        }
        if self.terms.iter().all(|t| t.unit == 0.0) {
            return Some("no term above zero".to_owned());
        }
        if !self.residual.is_empty() && self.residual.len() != places {
            return Some(format!("a residual of {} weights for {places} places", self.residual.len()));
        }
        let finite = self.residual.iter().all(|w| w.is_finite()) && self.spread_ln.is_finite();
        (!finite || self.spread_ln < 0.0).then(|| "a residual or spread that is not finite".to_owned())
    }
}

impl Model {
    /// A model of these methods, from the ranges of its training.
    #[must_use]
    pub fn new(name: impl Into<String>, methods: Vec<MethodModel>, ranges: Vec<Range>) -> Self {
        Self {
            name: name.into(),
            simulated: false,
            ranges,
            ratios_90_ln: None,
            places: Arc::new(Places::new(Vec::new())),
            methods,
        }
    }

    /// The same with intervals, which hold nine of ten ratios of two times within a factor of e to this.
    #[must_use]
    pub fn with_intervals(self, ratios_90_ln: Option<f64>) -> Self {
        Self { ratios_90_ln, ..self }
    }

    /// The same with the places that the residuals of its methods have weights for.
    #[must_use]
    pub fn with_places(self, places: Arc<Places>) -> Self {
        Self { places, ..self }
    }

    /// The hardware parameters that a prediction looks at, those of GPUs aside, each once: for its costs, and to tell whether the machine
    /// is like those of training.
    #[must_use]
    pub fn parameters(&self) -> Vec<ParameterId> {
        let of_method = |m: &MethodModel| {
            let scales = m.terms.iter().flat_map(|t| t.scale.parameters());
            let helpers = m.helpers.iter().flat_map(|_| HelpersModel::PARAMETERS);
            let cache = (m.backend == BackendClass::Cpu).then_some(&ParameterId::CacheLlcBytes);
            scales.chain(helpers).chain(cache).copied().collect::<Vec<_>>()
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
        if self.ratios_90_ln.is_some_and(|ln| !(0.0..=50.0).contains(&ln)) {
            return Some(ModelError::Intervals);
        }
        if let Some(position) = self.places.loads().iter().position(|load| !load.is_sound()) {
            return Some(ModelError::Place { position });
        }
        self.methods.iter().find_map(|m| {
            let method = format!("{} on the {}", m.method, m.backend);
            let found =
                |f: &FallbackModel| self.of_method(&f.method, m.backend).is_some_and(|other| other.fallback.is_none());
            if let Some(f) = m.fallback.as_ref().filter(|f| !found(f) || !(0.01..=100.0).contains(&f.factor)) {
                let why =
                    format!("it falls back to {} at {} times its cost, which is no such method", f.method, f.factor);
                return Some(ModelError::Method { method, why });
            }
            m.defect(self.places.loads().len()).map(|why| ModelError::Method { method, why })
        })
    }
}

#[cfg(test)]
mod tests;
