//! Which GPU it is: the vocabulary that registries, reports and drivers share.

use crate::named;

/// The identity of a GPU and its driver. Holds no serial number and no bus address.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub struct GpuIdentity {
    /// The number in `gpu0`, `gpu1` and so on: discrete GPUs first, software adapters last, otherwise in the driver's
    /// order.
    pub index: u32,
    /// Name that the driver reports.
    pub name: String,
    /// PCI vendor and device number as `10de:2335`, or the driver's own numbers.
    pub device: String,
    /// Name and version of the driver.
    pub driver: String,
    /// Interface in use: `vulkan`, `metal` or `dx12`.
    pub api: String,
    /// Kind of GPU.
    pub kind: GpuKind,
}

named! {
    /// Kinds of GPU, as the driver reports them.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    #[non_exhaustive]
    pub enum GpuKind("kind of GPU") {
        /// A card with its own memory.
        Discrete = "discrete",
        /// A GPU that shares the memory of the CPU.
        Integrated = "integrated",
        /// A share of a GPU, through a hypervisor.
        Virtual = "virtual",
        /// The driver does not report a kind.
        Other = "other",
        /// A software adapter, which runs on the CPU: lavapipe, SwiftShader, WARP.
        Software = "software",
    }
}

impl GpuIdentity {
    /// Creates a GPU of which only number, name and kind are known.
    pub fn new(index: u32, name: impl Into<String>, kind: GpuKind) -> Self {
        Self { index, name: name.into(), device: String::new(), driver: String::new(), api: String::new(), kind }
    }
}
