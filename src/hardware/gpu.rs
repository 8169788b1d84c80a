//! The GPUs of a machine, and the names of their parameters.

use super::Parameter;

/// One GPU: what it says of itself and what is known about it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct GpuHardware {
    /// Which GPU it is.
    pub gpu: GpuIdentity,
    /// Its parameters, in the order of [`parameter::all_names`]; a name stands at most once.
    pub parameters: Vec<Parameter>,
}

/// What a GPU and its driver say of themselves. Holds no serial number and no bus address.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct GpuIdentity {
    /// The number in `gpu0`, `gpu1` and so on: discrete GPUs come first, programs on the CPU last, else in the driver's order.
    pub index: u32,
    /// Name as the driver gives it.
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

/// Kinds of GPU, as the driver tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum GpuKind {
    /// A card with memory of its own.
    Discrete,
    /// A GPU that shares the memory of the CPU.
    Integrated,
    /// A share of a GPU, through a hypervisor.
    Virtual,
    /// The driver does not tell.
    Other,
    /// A program on the CPU that acts as a GPU: lavapipe, SwiftShader, WARP.
    Software,
}

/// Several GPUs at work at the same time.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct GpuGroup {
    /// Numbers of the GPUs, ascending, two or more.
    pub gpus: Vec<u32>,
    /// Parameters of the group, in the order of [`parameter::GROUP`]; a name stands at most once.
    pub parameters: Vec<Parameter>,
}

/// Names of the parameters of a GPU. The last words are the unit. "Upload" is from the CPU to the GPU, "download" back.
pub mod parameter {
    /// Upload of 33 554 432 bytes, all of it: copy into mapped memory, copy by the GPU, wait. The paper's first transfer.
    pub const UPLOAD_GB_PER_S: &str = "upload_gb_per_s";
    /// The part of that upload that the CPU does.
    pub const UPLOAD_HOST_COPY_GB_PER_S: &str = "upload_host_copy_gb_per_s";
    /// The part of that upload that the GPU does.
    pub const UPLOAD_DEVICE_COPY_GB_PER_S: &str = "upload_device_copy_gb_per_s";
    /// Time of an upload of no bytes, from a line through sizes from 4 KiB to 64 MiB.
    pub const UPLOAD_LATENCY_NS: &str = "upload_latency_ns";
    /// Slope of that line.
    pub const UPLOAD_RATE_GB_PER_S: &str = "upload_rate_gb_per_s";
    /// Download of 33 554 432 bytes, all of it. The paper's second transfer.
    pub const DOWNLOAD_GB_PER_S: &str = "download_gb_per_s";
    /// The part of that download that the CPU does.
    pub const DOWNLOAD_HOST_COPY_GB_PER_S: &str = "download_host_copy_gb_per_s";
    /// The part of that download that the GPU does.
    pub const DOWNLOAD_DEVICE_COPY_GB_PER_S: &str = "download_device_copy_gb_per_s";
    /// Time of a download of no bytes, from a line through sizes from 4 KiB to 64 MiB.
    pub const DOWNLOAD_LATENCY_NS: &str = "download_latency_ns";
    /// Slope of that line.
    pub const DOWNLOAD_RATE_GB_PER_S: &str = "download_rate_gb_per_s";
    /// Reading within the GPU's memory, over a working set beyond its caches.
    pub const READ_GB_PER_S: &str = "read_gb_per_s";
    /// Writing within the GPU's memory, over a working set beyond its caches.
    pub const WRITE_GB_PER_S: &str = "write_gb_per_s";
    /// Copying within the GPU's memory by its copy command, bytes read and bytes written both counted. The paper's internal
    /// bandwidth.
    pub const COPY_GB_PER_S: &str = "copy_gb_per_s";
    /// Working sets, in KiB, over which reading is measured.
    pub const READ_WORKING_SETS_KIB: [u32; 5] = [64, 1024, 8192, 32_768, 131_072];
    /// Memory of the GPU.
    pub const MEMORY_BYTES: &str = "memory_bytes";
    /// Clock of the processors.
    pub const CLOCK_GHZ: &str = "clock_ghz";
    /// Multiprocessors, compute units, shader cores.
    pub const PROCESSORS: &str = "processors";
    /// Lanes of all processors: 32-bit multiply-adds that can start in one cycle. "Cores" in the paper.
    pub const LANES: &str = "lanes";
    /// Time of the CPU in one submission of one dispatch, without waiting for it.
    pub const SUBMIT_NS: &str = "submit_ns";
    /// One submission of an empty dispatch, and waiting for it.
    pub const ROUND_TRIP_NS: &str = "round_trip_ns";
    /// One more dispatch in a pass, where each depends on the one before.
    pub const DISPATCH_NS: &str = "dispatch_ns";
    /// Copying 4 bytes to memory that the CPU can read, mapping it and reading them.
    pub const READ_BACK_NS: &str = "read_back_ns";
    /// 32-bit floating-point operations, a multiply-add counted as two.
    pub const ARITHMETIC_GFLOP_PER_S: &str = "arithmetic_gflop_per_s";
    /// Atomic additions to distinct addresses, in thousands of millions a second.
    pub const ATOMIC_G_PER_S: &str = "atomic_g_per_s";
    /// Workgroups of the largest size that run at the same time, from the staircase of the time over their number.
    pub const PARALLEL_UNITS: &str = "parallel_units";
    /// Lanes that run in lockstep.
    pub const SUBGROUP_LANES: &str = "subgroup_lanes";
    /// Most invocations in a workgroup.
    pub const WORKGROUP_INVOCATIONS: &str = "workgroup_invocations";
    /// Most memory that a workgroup shares.
    pub const WORKGROUP_MEMORY_BYTES: &str = "workgroup_memory_bytes";
    /// Most bytes that a kernel can see of one buffer.
    pub const BINDING_BYTES: &str = "binding_bytes";
    /// Largest buffer.
    pub const BUFFER_BYTES: &str = "buffer_bytes";
    /// 1 where CPU and GPU share one memory, else 0.
    pub const UNIFIED_MEMORY: &str = "unified_memory";

    /// Uploads of all GPUs of a group at once over the fastest one alone, in bytes per second.
    pub const GROUP_UPLOAD_RATIO: &str = "group_upload_ratio";
    /// Round trips of all GPUs of a group at once, over those of the slowest one alone, in time.
    pub const GROUP_ROUND_TRIP_RATIO: &str = "group_round_trip_ratio";
    /// Arithmetic of all GPUs of a group at once over the fastest one alone, in operations per second.
    pub const GROUP_ARITHMETIC_RATIO: &str = "group_arithmetic_ratio";

    /// Every name of a group's parameters, in the order of a report.
    pub const GROUP: [&str; 3] = [GROUP_UPLOAD_RATIO, GROUP_ROUND_TRIP_RATIO, GROUP_ARITHMETIC_RATIO];

    /// Name of the reading bandwidth over a working set, one of [`READ_WORKING_SETS_KIB`].
    #[must_use]
    pub fn read_name(kib: u32) -> String {
        format!("read_{kib}_kib_gb_per_s")
    }

    /// Every name, in the order of a report.
    #[must_use]
    pub fn all_names() -> Vec<String> {
        let before = [
            UPLOAD_GB_PER_S,
            UPLOAD_HOST_COPY_GB_PER_S,
            UPLOAD_DEVICE_COPY_GB_PER_S,
            UPLOAD_LATENCY_NS,
            UPLOAD_RATE_GB_PER_S,
            DOWNLOAD_GB_PER_S,
            DOWNLOAD_HOST_COPY_GB_PER_S,
            DOWNLOAD_DEVICE_COPY_GB_PER_S,
            DOWNLOAD_LATENCY_NS,
            DOWNLOAD_RATE_GB_PER_S,
            READ_GB_PER_S,
            WRITE_GB_PER_S,
            COPY_GB_PER_S,
        ];
        let after = [
            MEMORY_BYTES,
            CLOCK_GHZ,
            PROCESSORS,
            LANES,
            SUBMIT_NS,
            ROUND_TRIP_NS,
            DISPATCH_NS,
            READ_BACK_NS,
            ARITHMETIC_GFLOP_PER_S,
            ATOMIC_G_PER_S,
            PARALLEL_UNITS,
            SUBGROUP_LANES,
            WORKGROUP_INVOCATIONS,
            WORKGROUP_MEMORY_BYTES,
            BINDING_BYTES,
            BUFFER_BYTES,
            UNIFIED_MEMORY,
        ];
        let reads = READ_WORKING_SETS_KIB.map(read_name);
        before.iter().map(|s| (*s).to_owned()).chain(reads).chain(after.iter().map(|s| (*s).to_owned())).collect()
    }
}

impl GpuHardware {
    /// The value of a parameter, when it is there and not missing.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|p| p.name == name).and_then(|p| p.value)
    }
}

impl GpuGroup {
    /// The value of a parameter, when it is there and not missing.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|p| p.name == name).and_then(|p| p.value)
    }
}

impl std::fmt::Display for GpuKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Other => "other",
            Self::Software => "software",
        })
    }
}
