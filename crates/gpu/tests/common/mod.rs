//! Shared by the test programs on GPUs.
#![allow(dead_code, unused_imports, reason = "each test program uses a part of this")]

pub(crate) mod gpu;
#[path = "../../../../tests/common/mod.rs"]
mod shared;

use sapwise::Registry;
use sapwise_gpu::{Gpu, Gpus, wgpu30 as wgpu};
pub(crate) use shared::*;

pub(crate) const METHODS: [&str; 4] = ["brute", "sap", "grid-sap", "bvh"];

/// Returns the GPUs of this machine. Prints a remark and returns `None` if there is none and none is required.
pub(crate) fn gpus() -> Option<Gpus> {
    let gpus = Gpus::find();
    if !gpus.is_empty() {
        return Some(gpus);
    }
    let required = std::env::var_os("SAPWISE_REQUIRE_GPU").is_some_and(|v| v == "1");
    assert!(!required, "SAPWISE_REQUIRE_GPU=1, and no GPU was found");
    println!("skipped: no GPU was found");
    None
}

/// Returns a registry of one core with the algorithms on these GPUs.
pub(crate) fn with_gpus(gpus: &Gpus) -> Registry {
    let mut registry = Registry::with_cores(1);
    sapwise_gpu::add_to(&mut registry, gpus);
    registry
}

/// Opens a GPU as a program does that uses wgpu itself.
pub(crate) fn programs_own(gpus: &Gpus, index: u32, descriptor: &wgpu::DeviceDescriptor<'_>) -> Gpu {
    let opened = gpus.adapter(index).unwrap().request_device(descriptor);
    let (device, queue) = pollster::block_on(opened).unwrap();
    let identity = sapwise_gpu::identity(index, &device.adapter_info());
    Gpu::from_parts(device, queue, identity)
}
