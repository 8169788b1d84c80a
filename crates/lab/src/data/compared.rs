//! The parameters by which machines are compared with each other and with those of a training.

use sapwise_tune::hardware::{GpuParameterId, ParameterId};
use sapwise_tune::model::GPU_PREFIX;
use sapwise_tune::{GpuHardware, GpuKind, Hardware};

/// Parameters of a machine without its GPUs.
pub const COMPARED: [ParameterId; 8] = [
    ParameterId::ClockMeasuredGhz,
    ParameterId::SimdLanes,
    ParameterId::CacheLlcBytes,
    ParameterId::BandwidthOneThreadGbPerS,
    ParameterId::BandwidthAllThreadsGbPerS,
    ParameterId::ForkJoinColdNs,
    ParameterId::ScalingAllThreadsRatio,
    ParameterId::UsableCores,
];

/// Parameters of a GPU.
pub const COMPARED_OF_GPUS: [GpuParameterId; 10] = [
    GpuParameterId::RoundTripNs,
    GpuParameterId::ReadBackNs,
    GpuParameterId::DispatchNs,
    GpuParameterId::UploadGbPerS,
    GpuParameterId::UploadRateGbPerS,
    GpuParameterId::DownloadGbPerS,
    GpuParameterId::DownloadRateGbPerS,
    GpuParameterId::ReadGbPerS,
    GpuParameterId::CopyGbPerS,
    GpuParameterId::ArithmeticGflopPerS,
];

/// Returns whether a GPU is no software adapter.
pub(crate) fn is_real(gpu: &GpuHardware) -> bool {
    gpu.gpu.kind != GpuKind::Software
}

/// Returns a parameter by its name in the ranges of a model. A parameter of GPUs is that of the first real one, which
/// is a discrete GPU if the machine has any.
pub fn figure(hardware: &Hardware, name: &str) -> Option<f64> {
    match name.strip_prefix(GPU_PREFIX) {
        Some(name) => hardware.gpus.iter().find(|g| is_real(g))?.value_named(name),
        None => hardware.value_named(name),
    }
}
