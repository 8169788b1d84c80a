//! The parameters by which machines are compared: with each other, and with those of a training.

use sapwise::hardware::{GpuParameterId, ParameterId};
use sapwise::model::GPU_PREFIX;
use sapwise::{GpuHardware, GpuKind, Hardware};

/// Parameters by which the CPU of a machine is compared with those of the training.
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

/// The same of a GPU.
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

/// Whether a GPU is no software adapter.
pub(crate) fn is_real(gpu: &GpuHardware) -> bool {
    gpu.gpu.kind != GpuKind::Software
}

/// The first GPU that is no software adapter.
fn first_real_gpu(hardware: &Hardware) -> Option<&GpuHardware> {
    hardware.gpus.iter().find(|g| is_real(g))
}

/// A parameter of a machine by the name that it has in a model's ranges. That of a GPU is the one of the first GPU, which is a
/// discrete one where there is any; software adapters don't count.
#[must_use]
pub fn figure(hardware: &Hardware, name: &str) -> Option<f64> {
    match name.strip_prefix(GPU_PREFIX) {
        Some(name) => first_real_gpu(hardware)?.value_named(name),
        None => hardware.value_named(name),
    }
}
