//! Models in files: the part that predicts. What training says of itself stands beside it under the key `training`.

use super::wire;
use crate::hardware::GpuKind;
use crate::model::{FallbackModel, HelpersModel, MethodModel, ModelError, ModelTerm, Range, Scale};
use crate::{BackendClass, Places, Term};
use std::sync::Arc;

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
        /// Nine of ten ratios of the times of two algorithms lay within a factor of e to this of their prediction; null where that is not known.
        ratios_90_ln: Option<f64>,
        /// Loads at which the residuals of all methods are known.
        #[serde(with = "places")]
        #[cfg_attr(feature = "schema", schemars(with = "Vec<crate::Load>"))]
        places: Arc<Places>,
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
        /// The physical terms; no unit is negative.
        terms: Vec<ModelTerm>,
        /// The method that it falls back to where that is cheaper, if it does.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        fallback: Option<FallbackModel>,
        /// What the terms leave unexplained: for each of `places` what its likeness counts, as the logarithm of a factor.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        residual: Vec<f64>,
        /// Whether the residual tells loads apart by how far boxes move.
        #[serde(default, skip_serializing_if = "is_false")]
        residual_by_motion: bool,
        /// What several threads make of it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        helpers: Option<HelpersModel>,
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
    /// A method that another one falls back to.
    FallbackModelKeys = FallbackModel {
        /// Its name.
        method: String,
        /// How many times as much it costs there.
        factor: f64,
    }
}

wire! {
    /// How a method calls its helpers.
    HelpersModelKeys = HelpersModel {
        /// Cycles of the caller for each helper that it calls.
        call_cycles: f64,
        /// Share of a cold fork and join by which they come late.
        late_share: f64,
        /// Share of the work of one thread that stays with it.
        serial_share: f64,
        /// Boxes that keep one thread busy; 0: all threads work in every frame.
        boxes_per_thread: u32,
    }
}

/// Places as the loads that they are.
mod places {
    use crate::{Load, Places};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::sync::Arc;

    pub(super) fn serialize<S: Serializer>(places: &Arc<Places>, serializer: S) -> Result<S::Ok, S::Error> {
        places.loads().serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<Places>, D::Error> {
        Ok(Arc::new(Places::new(Vec::<Load>::deserialize(deserializer)?)))
    }
}
