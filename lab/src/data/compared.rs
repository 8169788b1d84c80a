//! The parameters by which machines are compared: with each other, and with those of a training.

use sapwise::hardware::{gpu, parameter};
use sapwise::model::GPU_PREFIX;
use sapwise::{GpuKind, Hardware};

/// Parameters by which the CPU of a machine is compared with those of the training.
pub const COMPARED: [&str; 8] = [
    parameter::CLOCK_MEASURED_GHZ,
    parameter::SIMD_LANES,
    parameter::CACHE_LLC_BYTES,
    parameter::BANDWIDTH_ONE_THREAD_GB_PER_S,
    parameter::BANDWIDTH_ALL_THREADS_GB_PER_S,
    parameter::FORK_JOIN_COLD_NS,
    parameter::SCALING_ALL_THREADS_RATIO,
    parameter::USABLE_CORES,
];

/// The same of a GPU.
pub const COMPARED_OF_GPUS: [&str; 10] = [
    gpu::parameter::ROUND_TRIP_NS,
    gpu::parameter::READ_BACK_NS,
    gpu::parameter::DISPATCH_NS,
    gpu::parameter::UPLOAD_GB_PER_S,
    gpu::parameter::UPLOAD_RATE_GB_PER_S,
    gpu::parameter::DOWNLOAD_GB_PER_S,
    gpu::parameter::DOWNLOAD_RATE_GB_PER_S,
    gpu::parameter::READ_GB_PER_S,
    gpu::parameter::COPY_GB_PER_S,
    gpu::parameter::ARITHMETIC_GFLOP_PER_S,
];

/// A parameter of a machine by the name that it has in a model's ranges. That of a GPU is the one of the first GPU, which is a
/// discrete one where there is any; software adapters don't count.
#[must_use]
pub fn figure(hardware: &Hardware, name: &str) -> Option<f64> {
    match name.strip_prefix(GPU_PREFIX) {
        Some(name) => hardware.gpus.iter().find(|g| g.gpu.kind != GpuKind::Software)?.value(name),
        None => hardware.value(name),
    }
}
