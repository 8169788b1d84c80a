//! Algorithms on GPUs, through wgpu: Vulkan, Metal and DX12 from one shader source each.
//!
//! [`Gpus::find`] looks for adapters, and [`Registry::add_gpus`](crate::Registry::add_gpus) adds the algorithms on them; without that
//! call no driver is loaded. The drivers are looked for at run time: a program built with this feature runs without any.
//!
//! ```
//! use sapwise::gpu::Gpus;
//! use sapwise::{Aabb, Adaptive, BroadPhase, Pairs, Registry, Tuning};
//!
//! let mut registry = Registry::new();
//! // Software adapters, such as llvmpipe, are found too. They run on the CPU and can't beat it.
//! registry.add_gpus(&Gpus::find().choose(|gpu| gpu.kind != sapwise::GpuKind::Software));
//! // A tuning that names a GPU uses it, and what this machine lacks is left out. This one names none: predict or measure one that does.
//! let mut broad_phase = Adaptive::new(Tuning::usual(&registry), &registry)?;
//! let mut pairs = Pairs::new();
//! broad_phase.find_pairs(&[Aabb::cube([0.0; 3], 0.5), Aabb::cube([0.8, 0.0, 0.0], 0.5)], &mut pairs)?;
//! # assert_eq!(pairs.as_slice(), [(0, 1)]);
//! # Ok::<(), sapwise::Error>(())
//! ```
//!
//! Two ways through a frame, and they are not to be compared with each other:
//!
//! - *host-resident*: boxes in the memory of the CPU, pairs in the memory of the CPU, both transfers included. Every
//!   [`BroadPhase`](crate::BroadPhase), `grid-sap@gpu0` as well as `grid-sap@cpu1`, and every figure that is not labelled.
//! - *device-resident*: boxes in a [`wgpu30::Buffer`], pairs in another: [`Resident`].
//!
//! Pairs come out in an order that does not depend on timing, by counting, adding up and writing; where several GPUs share a frame
//! it follows their shares, which follow their measured speeds. [`PairOrder::Canonical`](crate::PairOrder) is the same everywhere.
//! What does not fit a buffer comes in several steps, and what does not fit a GPU in slabs.
//!
//! A GPU that is lost, refuses memory or does not answer within a minute is [`Error::Unavailable`](crate::Error);
//! [`Adaptive`](crate::Adaptive) then runs the same frame on what is left.

mod adapters;
mod brute;
mod device;
mod engine;
mod inputs;
pub(crate) mod kernel;
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

pub use crate::error::{GpuError, GpuErrorKind};
pub use adapters::Gpus;
#[cfg(test)]
pub(crate) use adapters::first_for_tests;
pub use device::Gpu;
pub use methods::algorithms;
pub(crate) use methods::has_method;
pub(crate) use on_gpus::OnGpus;
pub use on_gpus::broad_phase;
pub use resident::{Resident, ResidentPairs};
/// The version of wgpu whose buffers and devices this library takes. Its number is part of the name, because another one would be
/// other types: a release of this library that takes a newer wgpu exports it under a new name, and is a breaking one.
pub use wgpu as wgpu30;
