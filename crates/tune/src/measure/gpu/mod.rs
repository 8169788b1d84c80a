//! Measures the parameters of GPUs, each in about one second, and in twice that if a program on the CPU acts as the
//! GPU.
//!
//! One file measures one family. If one family fails, its parameters are missing with the reason, and the others stay.

mod arithmetic;
mod bench;
mod group;
mod latency;
mod memory;
mod nvml;
mod reported;
mod transfer;

use std::time::{Duration, Instant};

use super::{Options, in_order};
use crate::hardware::{GpuGroup, GpuHardware, GpuParameterId, Parameter};
use arithmetic::Arithmetic;
use bench::{Bench, or_missing};
use sapwise_gpu::{Gpu, GpuError, GpuErrorKind, Gpus};

/// How long a real GPU works before anything is timed: an idle GPU clocks down.
const WARM_UP: Duration = Duration::from_millis(50);

/// Measures one GPU. Returns each of [`GpuParameterId::OF_ONE`] once: measured, reported or missing with a reason.
///
/// The GPU is opened again, so that memory and submissions of the caller have no influence. A GPU that the program
/// opened itself ([`Gpus::of`]) is measured as it is, and other work on it makes it look slower. [`Options::threads`]
/// has no effect. With [`Options::limit`] only what a cost model reads is measured. A GPU that executes nothing
/// ([`GpuParameterId::Executes`]) is not timed.
///
/// # Errors
/// [`GpuErrorKind::NotFound`] if there is no such GPU or its driver refuses to open it.
pub fn gpu(gpus: &Gpus, index: u32, options: &Options) -> Result<GpuHardware, GpuError> {
    let began = Instant::now();
    let adapter = gpus.adapter(index);
    let opened = if adapter.is_some() { gpus.open_another(index)? } else { gpus.open(index)? };
    let heaps = reported::heaps(adapter);
    let bench = Bench { gpu: &opened, options };
    let inert = latency::proof(&bench).err();
    let executes = if inert.is_none() { 1.0 } else { 0.0 };
    let source = "three dependent additions by a kernel, read back before anything is timed";
    let mut measured = vec![Parameter::reported(GpuParameterId::Executes, executes, source)];
    let absent = match inert {
        Some(error) => error.to_string(),
        None => {
            warm_up(&bench);
            measured.extend(timed(&opened, options, &heaps, began));
            "not measured under a time limit".to_owned()
        }
    };
    if options.limit.is_none() {
        measured.extend(reported::measure(&bench, &heaps, executes > 0.0));
    }
    Ok(GpuHardware::new(opened.identity().clone(), in_order(&GpuParameterId::OF_ONE, &measured, &absent)))
}

/// The parameters that take the GPU's time.
fn timed(opened: &Gpu, options: &Options, heaps: &[u64], began: Instant) -> Vec<Parameter> {
    let part = |parts: usize, names: &[GpuParameterId], measure: &dyn Fn(&Bench<'_>) -> bench::Result<_>| {
        or_missing(names, measure(&Bench { gpu: opened, options: &options.share(began, parts) }))
    };
    // Arithmetic is the shortest part and takes the time that the others leave.
    [
        part(4, &transfer::NAMES, &transfer::measure),
        part(3, &memory::NAMES, &|bench| memory::measure(bench, heaps)),
        part(2, &latency::NAMES, &latency::measure),
        part(1, &arithmetic::NAMES, &arithmetic::measure),
    ]
    .concat()
}

/// Measures GPUs that work at the same time. Returns each of [`GpuParameterId::GROUP`] once: measured or missing with
/// a reason.
///
/// Order and repetition of the numbers have no influence. Each GPU is opened again.
///
/// # Errors
/// [`GpuErrorKind::NotFound`] if there are fewer than two, or one of them can't be opened.
pub fn gpu_group(gpus: &Gpus, indices: &[u32], options: &Options) -> Result<GpuGroup, GpuError> {
    let mut indices = indices.to_vec();
    indices.sort_unstable();
    indices.dedup();
    if indices.len() < 2 {
        return Err(GpuError::new(GpuErrorKind::NotFound, "a group needs two GPUs or more"));
    }
    let opened = indices.iter().map(|&index| gpus.open_another(index)).collect::<Result<Vec<Gpu>, _>>()?;
    opened.iter().for_each(|gpu| warm_up(&Bench { gpu, options }));
    Ok(GpuGroup::new(indices, group::measure(&opened, options)))
}

/// Keeps a real GPU at work for [`WARM_UP`]. Ignores failures, which show in what is measured next.
fn warm_up(bench: &Bench<'_>) {
    if bench.is_software() {
        return;
    }
    let Ok(work) = Arithmetic::new(bench, Duration::from_millis(2)) else { return };
    let start = Instant::now();
    while start.elapsed() < WARM_UP && work.rate(bench).is_ok() {}
}
