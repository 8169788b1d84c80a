//! The GPUs of this machine.
//!
//! A driver that crashes must cost its GPU and not the run. So a process of its own looks for GPUs first, and one each measures
//! or opens them; drivers are loaded in the process of a verb only after that went well.

mod choice;
mod entries;
mod limits;
mod look;
mod measured;

pub(crate) use choice::{GpuChoice, difference, uses};
pub(crate) use entries::{OnGpus, entries, print_entries};
pub(crate) use limits::{Limits, limits, limits_of};
pub(crate) use look::{Seen, look};
pub(crate) use measured::{Measured, measure};

use anyhow::anyhow;
use sapwise::gpu::Gpus;
use sapwise::measure::Options;
use sapwise::{GpuGroup, GpuHardware, GpuIdentity, Parameter};

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
    let identity = gpus.identities().find(|g| g.index == index).ok_or_else(|| anyhow!("there is no gpu{index} any more"))?;
    let hardware =
        sapwise::measure::gpu(&gpus, index, options).unwrap_or_else(|why| without_parameters(identity.clone(), &why));
    crate::output::print_json(&hardware)
}

/// What the process that measures several GPUs together prints.
///
/// # Errors
/// When standard output can't be written.
pub(crate) fn print_group(indices: &[u32], options: &Options) -> anyhow::Result<()> {
    let gpus = Gpus::find();
    let group =
        sapwise::measure::gpu_group(&gpus, indices, options).unwrap_or_else(|why| group_without_parameters(indices, &why));
    crate::output::print_json(&group)
}

/// A GPU of which nothing could be measured.
fn without_parameters(gpu: GpuIdentity, why: &str) -> GpuHardware {
    let names = GpuParameterId::OF_ONE;
    GpuHardware { gpu, parameters: names.iter().map(|name| Parameter::missing(name, why)).collect() }
}

/// Several GPUs that could not be measured together.
fn group_without_parameters(indices: &[u32], why: &str) -> GpuGroup {
    let names = GpuParameterId::GROUP;
    GpuGroup { gpus: indices.to_vec(), parameters: names.map(|name| Parameter::missing(name, why)).into() }
}
