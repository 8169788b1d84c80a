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
#[cfg(not(target_vendor = "apple"))]
mod vulkan;

use std::time::{Duration, Instant};

use super::{Options, UNDER_LIMIT};
use crate::gpu::{Gpu, GpuError, GpuErrorKind, Gpus};
use crate::hardware::{GpuGroup, GpuHardware, GpuParameterId, Parameter};
use bench::Bench;

/// How long a real GPU works before anything is timed: they clock down when idle.
const WARM_UP: Duration = Duration::from_millis(50);

/// Measures one GPU: each of [`GpuParameterId::OF_ONE`] once, measured, reported or missing with a reason.
///
/// The GPU is opened again, so that memory and submissions of the caller don't stand in the way; but one that the program
/// opened itself ([`Gpus::of`]) is measured as it is, and what else it does meanwhile makes it look slower. [`Options::threads`] has
/// no effect. With [`Options::limit`] only what a cost model reads is measured. Of a GPU that executes nothing
/// ([`GpuParameterId::Executes`]) nothing is timed, and what its driver reports stays.
///
/// # Errors
/// [`GpuErrorKind::NotFound`] when there is no such GPU or its driver refuses to open it.
pub fn gpu(gpus: &Gpus, index: u32, options: &Options) -> Result<GpuHardware, GpuError> {
    let began = Instant::now();
    let (opened, raw) = match gpus.adapter(index) {
        Some(adapter) => (gpus.open_another(index)?, query(adapter)),
        None => (gpus.open(index)?, raw::Raw::default()),
    };
    let whole = options.limit.is_none();
    let bench = Bench::new(&opened, options);
    let inert = latency::proof(&bench).err();
    let mut measured = vec![executes(inert.is_none())];
    let absent = if let Some(why) = &inert {
        why
    } else {
        measured.extend(timed(&opened, options, &raw, began));
        if whole { "not measured" } else { UNDER_LIMIT }
    };
    if whole {
        measured.extend(properties::measure(&bench, &raw, inert.is_none()));
    }
    let find = |id: GpuParameterId| {
        let found = Parameter::find(&measured, id).cloned();
        found.unwrap_or_else(|| Parameter::missing(id, absent))
    };
    let parameters = GpuParameterId::OF_ONE.into_iter().map(find).collect();
    Ok(GpuHardware::new(opened.identity().clone(), parameters))
}

#[cfg(target_vendor = "apple")]
fn query(_: &wgpu::Adapter) -> raw::Raw {
    raw::Raw::default()
}

#[cfg(not(target_vendor = "apple"))]
fn query(adapter: &wgpu::Adapter) -> raw::Raw {
    vulkan::query(adapter)
}

fn executes(yes: bool) -> Parameter {
    let source = "three dependent additions by a kernel, read back before anything is timed";
    Parameter::reported(GpuParameterId::Executes, f64::from(u8::from(yes)), source)
}

/// What takes the GPU's time.
fn timed(opened: &Gpu, options: &Options, raw: &raw::Raw, began: Instant) -> Vec<Parameter> {
    let bench = Bench::new(opened, options);
    if !bench.is_software() {
        // A failure shows in what is measured next.
        let _ = warm_up(&bench);
    }
    // Arithmetic is the shortest part and takes what the others leave.
    let mut measured = transfer::measure(&Bench::new(opened, &options.share(began, 4)));
    measured.extend(memory::measure(&Bench::new(opened, &options.share(began, 3)), raw.free_bytes()));
    measured.extend(latency::measure(&Bench::new(opened, &options.share(began, 2))));
    measured.extend(compute::measure(&Bench::new(opened, &options.share(began, 1))));
    measured
}

/// Measures GPUs that work at the same time: each of [`GpuParameterId::GROUP`] once, measured or missing with a reason.
///
/// The order of the numbers does not matter, and a number that stands twice counts once. Each GPU is opened again.
///
/// # Errors
/// [`GpuErrorKind::NotFound`] when there are fewer than two, or one of them can't be opened.
pub fn gpu_group(gpus: &Gpus, indices: &[u32], options: &Options) -> Result<GpuGroup, GpuError> {
    let mut indices = indices.to_vec();
    indices.sort_unstable();
    indices.dedup();
    if indices.len() < 2 {
        return Err(GpuError::new(GpuErrorKind::NotFound, "a group needs two GPUs or more"));
    }
    let opened = indices.iter().map(|&index| gpus.open_another(index)).collect::<Result<Vec<Gpu>, _>>()?;
    for gpu in &opened {
        let bench = Bench::new(gpu, options);
        if !bench.is_software() {
            // A failure shows in what is measured next.
            let _ = warm_up(&bench);
        }
    }
    Ok(GpuGroup::new(indices, group::measure(&opened, options)))
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
