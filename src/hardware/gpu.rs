//! The GPUs of a machine.

use super::{GpuParameterId, Parameter};
use crate::named::named;

/// One GPU: what it says of itself and what is known about it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct GpuHardware {
    /// Which GPU it is.
    pub gpu: GpuIdentity,
    /// Its parameters, in the order of [`GpuParameterId::OF_ONE`]; a name stands at most once.
    pub parameters: Vec<Parameter>,
}

/// What a GPU and its driver say of themselves. Holds no serial number and no bus address.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct GpuIdentity {
    /// The number in `gpu0`, `gpu1` and so on: discrete GPUs come first, software adapters last, else in the driver's order.
    pub index: u32,
    /// Name as the driver tells it.
    pub name: String,
    /// PCI vendor and device number as `10de:2335`, or the numbers that the driver uses in their place.
    pub device: String,
    /// Name and version of the driver.
    pub driver: String,
    /// The interface it is driven through: `vulkan`, `metal` or `dx12`.
    pub api: String,
    /// What kind of GPU it is.
    pub kind: GpuKind,
}

named! {
    /// Kinds of GPU, as the driver tells.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    #[non_exhaustive]
    pub enum GpuKind("kind of GPU") {
        /// A card with memory of its own.
        Discrete = "discrete",
        /// A GPU that shares the memory of the CPU.
        Integrated = "integrated",
        /// A share of a GPU, through a hypervisor.
        Virtual = "virtual",
        /// The driver does not tell.
        Other = "other",
        /// A software adapter, which runs on the CPU: lavapipe, SwiftShader, WARP.
        Software = "software",
    }
}

/// Several GPUs at work at the same time.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct GpuGroup {
    /// Numbers of the GPUs, ascending, two or more.
    pub gpus: Vec<u32>,
    /// Parameters of the group, in the order of [`GpuParameterId::GROUP`]; a name stands at most once.
    pub parameters: Vec<Parameter>,
}

impl GpuIdentity {
    /// A GPU of which only number, name and kind are known.
    #[must_use]
    pub fn new(index: u32, name: impl Into<String>, kind: GpuKind) -> Self {
        Self { index, name: name.into(), device: String::new(), driver: String::new(), api: String::new(), kind }
    }

    /// The same with its device number, its driver and the interface.
    #[must_use]
    pub fn with_driver(self, device: impl Into<String>, driver: impl Into<String>, api: impl Into<String>) -> Self {
        Self { device: device.into(), driver: driver.into(), api: api.into(), ..self }
    }
}

impl GpuHardware {
    /// A GPU with these parameters.
    #[must_use]
    pub fn new(gpu: GpuIdentity, parameters: Vec<Parameter>) -> Self {
        Self { gpu, parameters }
    }

    /// The value of a parameter, when it is there and not missing.
    #[must_use]
    pub fn value(&self, id: GpuParameterId) -> Option<f64> {
        self.value_named(id.as_str())
    }

    /// The value of a parameter by its name, which this version need not know.
    #[must_use]
    pub fn value_named(&self, name: &str) -> Option<f64> {
        Parameter::find(&self.parameters, name)?.value
    }
}

impl GpuGroup {
    /// GPUs by their numbers, ascending, with the parameters of the group.
    #[must_use]
    pub fn new(gpus: Vec<u32>, parameters: Vec<Parameter>) -> Self {
        Self { gpus, parameters }
    }

    /// The value of a parameter, when it is there and not missing.
    #[must_use]
    pub fn value(&self, id: GpuParameterId) -> Option<f64> {
        Parameter::find(&self.parameters, id)?.value
    }
}
