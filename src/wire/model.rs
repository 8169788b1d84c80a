//! Models in files: the part that predicts. What training says of itself stands beside it under the key `training`.

use super::wire;
use crate::hardware::GpuKind;
use crate::model::{Feature, MethodModel, ModelError, ModelTerm, Range, ResidualTerm, Scale};
use crate::{BackendClass, Term};

/// Whether a key that says no is left out.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_false(flag: &bool) -> bool {
    !flag
}

wire! {
    /// A cost model for every method and class of processor.
    Model = crate::Model, checked ModelError {
        /// Name by which tuning refers to it.
        name: String,
        /// Whether a report behind it is simulated.
        #[serde(default, skip_serializing_if = "is_false")]
        simulated: bool,
        /// Lowest and highest value of each hardware parameter in training.
        ranges: Vec<Range>,
        /// One cost model for each method on each class of processor.
        methods: Vec<MethodModel>,
    }
}

wire! {
    /// Where a hardware parameter lay in training.
    RangeKeys = Range {
        /// Name of the parameter; that of a GPU after `gpu/`.
        parameter: String,
        /// Lowest value.
        min: f64,
        /// Highest value.
        max: f64,
    }
}

wire! {
    /// The cost model of one method on one class of processor, for any number of threads or GPUs.
    MethodModelKeys = MethodModel {
        /// The part of the algorithm's id before the `@`.
        method: String,
        /// The processor that it holds for.
        #[serde(default)]
        backend: BackendClass,
        /// Revision of the algorithm that was timed.
        revision: u32,
        /// Most threads that were timed, of GPUs the most that were timed together.
        max_threads: u32,
        /// Kinds of the GPUs that were timed, without repetition.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        gpu_kinds: Vec<GpuKind>,
        /// Fewest objects that were timed.
        min_objects: u32,
        /// Most objects that were timed.
        max_objects: u32,
        /// The physical terms; no unit is negative.
        terms: Vec<ModelTerm>,
        /// Terms of the fallback, where the algorithm has one.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        fallback_terms: Vec<ModelTerm>,
        /// Constant of the residual.
        residual_intercept: f64,
        /// Slopes of the residual on the natural logarithm of measured over modelled time.
        residual: Vec<ResidualTerm>,
        /// Standard deviation of what remains, in natural logarithms.
        spread_ln: f64,
    }
}

wire! {
    /// One physical term.
    ModelTermKeys = ModelTerm {
        /// What is counted.
        term: Term,
        /// What of the hardware one count costs.
        scale: Scale,
        /// How much of that.
        unit: f64,
    }
}

wire! {
    /// One slope of the residual.
    ResidualTermKeys = ResidualTerm {
        /// What it is a slope on.
        feature: Feature,
        /// Mean of the feature in training, taken off before the slope is applied.
        centre: f64,
        /// The slope.
        slope: f64,
    }
}
