//! What the processes that look for GPUs and measure them print.

use anyhow::anyhow;
use sapwise::gpu::Gpus;
use sapwise::measure::Options;
use sapwise::{GpuGroup, GpuHardware, GpuIdentity, GpuParameterId, Parameter};

/// What the process that looks for GPUs prints: each of them in a line.
///
/// # Errors
/// When standard output can't be written.
pub(crate) fn print_identities() -> anyhow::Result<()> {
    Gpus::find().identities().try_for_each(crate::output::print_json)
}

/// What the process that measures a GPU prints. Parameters that can't be measured are missing, with the reason.
///
/// # Errors
/// When there is no such GPU, or standard output can't be written.
pub(crate) fn print_parameters(index: u32, options: &Options) -> anyhow::Result<()> {
    let gpus = Gpus::find();
    let identity =
        gpus.identities().find(|g| g.index == index).ok_or_else(|| anyhow!("there is no gpu{index} any more"))?;
    let hardware = sapwise::measure::gpu(&gpus, index, options)
        .unwrap_or_else(|why| without_parameters(identity.clone(), &why.to_string()));
    crate::output::print_json(&hardware)
}

/// What the process that measures several GPUs together prints.
///
/// # Errors
/// When standard output can't be written.
pub(crate) fn print_group(indices: &[u32], options: &Options) -> anyhow::Result<()> {
    let gpus = Gpus::find();
    let group = sapwise::measure::gpu_group(&gpus, indices, options)
        .unwrap_or_else(|why| group_without_parameters(indices, &why.to_string()));
    crate::output::print_json(&group)
}

/// A GPU of which nothing could be measured.
pub(super) fn without_parameters(gpu: GpuIdentity, why: &str) -> GpuHardware {
    let names = GpuParameterId::OF_ONE;
    GpuHardware::new(gpu, names.iter().map(|name| Parameter::missing(name, why)).collect())
}

/// That a GPU executes nothing, in words for whoever may have never heard of that.
pub(super) fn inert(gpu: &GpuIdentity) -> String {
    format!(
        "gpu{} ({}) executes nothing: its driver takes work and says that it is done, and no kernel has run",
        gpu.index, gpu.name
    )
}

/// Several GPUs that could not be measured together.
pub(super) fn group_without_parameters(indices: &[u32], why: &str) -> GpuGroup {
    let names = GpuParameterId::GROUP;
    GpuGroup::new(indices.to_vec(), names.map(|name| Parameter::missing(name, why)).into())
}
