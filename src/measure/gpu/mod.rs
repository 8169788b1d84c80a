//! Measures the parameters of GPUs, each in about two seconds, and in twice that where a program on the CPU acts as the
//! GPU.
//!
//! One file per family. What fails on one family leaves the others standing: its parameters are missing and say why.

mod bench;
mod compute;
mod fits;
mod group;
mod latency;
mod memory;
mod nvml;
mod properties;
mod raw;
#[cfg(test)]
mod shaders;
mod sysfs;
mod transfer;

use std::time::{Duration, Instant};

use super::Options;
use crate::gpu::{Gpu, Gpus};
use crate::hardware::gpu::parameter;
use crate::hardware::{GpuGroup, GpuHardware, Parameter};
use bench::Bench;

/// How long a real GPU works before anything is timed: they clock down when idle.
const WARM_UP: Duration = Duration::from_millis(50);

/// Measures one GPU: each name of [`parameter::all_names`] once, measured, reported or missing with a reason.
///
/// The GPU is opened anew, so that memory and submissions of the caller don't stand in the way. [`Options::threads`] has no
/// effect.
///
/// # Errors
/// A sentence, when there is no such GPU or its driver refuses to open it.
pub fn gpu(gpus: &Gpus, index: u32, options: &Options) -> Result<GpuHardware, String> {
    let opened = gpus.open_another(index)?;
    let adapter = gpus.adapter(index).ok_or_else(|| format!("there is no gpu{index}"))?;
    let bench = Bench::new(&opened, options);
    let raw = raw::query(adapter);
    if !bench.is_software() {
        // A failure shows in what is measured next.
        let _ = warm_up(&bench);
    }
    let mut measured = transfer::measure(&bench);
    measured.extend(memory::measure(&bench, raw.free_bytes()));
    measured.extend(latency::measure(&bench));
    measured.extend(compute::measure(&bench));
    measured.extend(properties::measure(&bench, adapter, &raw));
    let find = |name: String| {
        let found = measured.iter().find(|p| p.name == name).cloned();
        found.unwrap_or_else(|| Parameter::missing(&name, "not measured"))
    };
    let parameters = parameter::all_names().into_iter().map(find).collect();
    Ok(GpuHardware { gpu: opened.identity().clone(), parameters })
}

/// Measures GPUs that work at the same time: each name of [`parameter::GROUP`] once, measured or missing with a reason.
///
/// The order of the numbers does not matter, and a number that stands twice counts once. Each GPU is opened anew.
///
/// # Errors
/// A sentence, when there are fewer than two, or one of them can't be opened.
pub fn gpu_group(gpus: &Gpus, indices: &[u32], options: &Options) -> Result<GpuGroup, String> {
    let mut indices = indices.to_vec();
    indices.sort_unstable();
    indices.dedup();
    if indices.len() < 2 {
        return Err("a group needs two GPUs or more".to_owned());
    }
    let opened = indices.iter().map(|&index| gpus.open_another(index)).collect::<Result<Vec<Gpu>, _>>()?;
    for gpu in &opened {
        let bench = Bench::new(gpu, options);
        if !bench.is_software() {
            // A failure shows in what is measured next.
            let _ = warm_up(&bench);
        }
    }
    Ok(GpuGroup { gpus: indices, parameters: group::measure(&opened, options) })
}

/// Gives a GPU work for [`WARM_UP`].
fn warm_up(bench: &Bench<'_>) -> Result<(), String> {
    let work = compute::Arithmetic::new(bench)?;
    let rounds = work.calibrate(bench, Duration::from_millis(2))?;
    let bound = work.bind(bench, rounds)?;
    let start = Instant::now();
    while start.elapsed() < WARM_UP {
        work.rate(bench, &bound, rounds, 1)?;
    }
    Ok(())
}
