//! Stands for `sapwise::measure::gpu` and `sapwise::measure::gpu_group` until the library has them: then this file goes, and
//! `mod.rs` calls those two.

use sapwise::gpu::Gpus;
use sapwise::measure::Options;
use sapwise::{GpuGroup, GpuHardware};

const WHY: &str = "this build can't measure GPUs";

pub(super) fn gpu(_: &Gpus, _: u32, _: &Options) -> Result<GpuHardware, String> {
    Err(WHY.to_owned())
}

pub(super) fn gpu_group(_: &Gpus, _: &[u32], _: &Options) -> Result<GpuGroup, String> {
    Err(WHY.to_owned())
}
