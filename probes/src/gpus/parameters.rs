//! The output of the processes that look for GPUs and measure them.

use anyhow::anyhow;
use sapwise_gpu::Gpus;
use sapwise_tune::measure::Options;
use sapwise_tune::{GpuGroup, GpuHardware, GpuIdentity, GpuParameterId, Parameter};

/// Prints each GPU in a line.
///
/// # Errors
/// When standard output can't be written.
pub(crate) fn print_identities() -> anyhow::Result<()> {
    Gpus::find().identities().try_for_each(crate::output::print_json)
}

/// Prints a GPU with its parameters. Those that can't be measured are missing, with the reason.
///
/// # Errors
/// When there is no such GPU, or standard output can't be written.
pub(crate) fn print_parameters(index: u32, options: &Options) -> anyhow::Result<()> {
    let gpus = Gpus::find();
    let identity =
        gpus.identities().find(|g| g.index == index).ok_or_else(|| anyhow!("there is no gpu{index} any more"))?;
    let hardware = sapwise_tune::measure::gpu(&gpus, index, options)
        .unwrap_or_else(|why| without_parameters(identity.clone(), &why.to_string()));
    crate::output::print_json(&hardware)
}

/// Prints the parameters of several GPUs together.
///
/// # Errors
/// When standard output can't be written.
pub(crate) fn print_group(indices: &[u32], options: &Options) -> anyhow::Result<()> {
    let gpus = Gpus::find();
    let group = sapwise_tune::measure::gpu_group(&gpus, indices, options)
        .unwrap_or_else(|why| group_without_parameters(indices, &why.to_string()));
    crate::output::print_json(&group)
}

/// Returns a GPU with every parameter missing.
pub(super) fn without_parameters(gpu: GpuIdentity, why: &str) -> GpuHardware {
    let names = GpuParameterId::OF_ONE;
    GpuHardware::new(gpu, names.iter().map(|name| Parameter::missing(name, why)).collect())
}

/// Returns a sentence that explains that a GPU executes nothing.
pub(super) fn inert(gpu: &GpuIdentity) -> String {
    format!(
        "gpu{} ({}) executes nothing: its driver takes work and says that it is done, and no kernel has run",
        gpu.index, gpu.name
    )
}

/// Returns several GPUs with every parameter missing.
pub(super) fn group_without_parameters(indices: &[u32], why: &str) -> GpuGroup {
    let names = GpuParameterId::GROUP;
    GpuGroup::new(indices.to_vec(), names.map(|name| Parameter::missing(name, why)).into())
}
