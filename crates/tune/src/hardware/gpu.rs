//! The GPUs of a machine.

use super::{GpuParameterId, Parameter};
use sapwise::internals::GpuIdentity;

/// One GPU: its identity and parameters.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct GpuHardware {
    /// Which GPU it is.
    pub gpu: GpuIdentity,
    /// Its parameters; a name appears at most once.
    pub parameters: Vec<Parameter>,
}

/// Several GPUs that work at the same time.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct GpuGroup {
    /// Numbers of the GPUs, ascending, two or more.
    pub gpus: Vec<u32>,
    /// Parameters of the group; a name appears at most once.
    pub parameters: Vec<Parameter>,
}

impl GpuHardware {
    /// Creates a GPU with these parameters.
    pub fn new(gpu: GpuIdentity, parameters: Vec<Parameter>) -> Self {
        Self { gpu, parameters }
    }

    /// Returns the value of a parameter unless it is missing.
    pub fn value(&self, id: GpuParameterId) -> Option<f64> {
        self.value_named(id.as_str())
    }

    /// Returns the value of a parameter by its name, which this version need not know.
    pub fn value_named(&self, name: &str) -> Option<f64> {
        Parameter::find(&self.parameters, name)?.value
    }
}

impl GpuGroup {
    /// Creates a group of the GPUs of these numbers, ascending.
    pub fn new(gpus: Vec<u32>, parameters: Vec<Parameter>) -> Self {
        Self { gpus, parameters }
    }

    /// Returns the value of a parameter unless it is missing.
    pub fn value(&self, id: GpuParameterId) -> Option<f64> {
        Parameter::find(&self.parameters, id)?.value
    }
}
