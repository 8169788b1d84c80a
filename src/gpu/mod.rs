//! Algorithms on GPUs, through wgpu: Vulkan, Metal and DX12 from one shader source each.
//!
//! [`Gpus::find`] looks for adapters, and [`Registry::add_gpus`](crate::Registry::add_gpus) adds the algorithms on them; without that
//! call no driver is loaded. The drivers are looked for at run time: a program built with this feature runs without any.

mod adapters;
mod device;
mod methods;

pub use adapters::Gpus;
pub use device::Gpu;
pub use methods::algorithms;
/// The version of wgpu whose buffers and devices this library takes.
pub use wgpu;
