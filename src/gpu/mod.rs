//! Algorithms on GPUs, through wgpu: Vulkan, Metal and DX12 from one shader source each.
//!
//! [`Gpus::find`] looks for adapters, and [`Registry::add_gpus`](crate::Registry::add_gpus) adds the algorithms on them; without that
//! call no driver is loaded. The drivers are looked for at run time: a program built with this feature runs without any.

mod adapters;
mod brute;
mod device;
mod engine;
mod kernel;
mod methods;
mod on_gpus;
mod output;
mod params;
mod resident;
mod sampler;
mod slabs;
mod sort;
mod sorted;
mod storage;
mod transfer;

pub use adapters::Gpus;
pub use device::Gpu;
pub use methods::algorithms;
pub(crate) use on_gpus::OnGpus;
pub use on_gpus::broad_phase;
pub use resident::{Resident, ResidentPairs};
/// The version of wgpu whose buffers and devices this library takes.
pub use wgpu;
