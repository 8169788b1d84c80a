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
//! The order of the pairs does not depend on timing, but in two cases: several GPUs share a frame, in shares that follow their measured speeds; or more than 32 768
//! boxes begin in one cell of `grid-sap`, in a frame of a million more than 1024. [`PairOrder::Canonical`](crate::PairOrder) is the same everywhere. Pairs that do not fit a
//! buffer come in several steps, and boxes that do not fit a GPU are searched in slabs of space, one after the other.
//!
//! Methods: `brute`; `sap`, a radix sort along one axis; `grid-sap`, a counting sort into the slots of a grid of strips, with the boxes that are too large
//! for it in a tree; `bvh`, that tree over all boxes. Each eight boxes that follow each other along Hilbert's curve are a node, so that no node
//! holds a pointer and no invocation a stack.
//!
//! A GPU that is lost, refuses memory, executes nothing of what it is given or does not answer within a minute is [`Error::Unavailable`](crate::Error);
//! [`Adaptive`](crate::Adaptive) then runs the same frame on what is left.

mod adapters;
mod brute;
mod cells;
mod device;
mod division;
mod engine;
mod inputs;
pub(crate) mod kernel;
mod look;
mod methods;
mod on_gpus;
mod output;
mod params;
mod resident;
mod sampler;
mod scope;
mod sizes;
mod slabs;
mod sort;
mod sorted;
mod storage;
mod traffic;
mod transfer;
mod tree;

pub use crate::error::{GpuError, GpuErrorKind};
pub use adapters::Gpus;
#[cfg(test)]
pub(crate) use adapters::first_for_tests;
pub use device::Gpu;
pub use methods::algorithms;
pub(crate) use methods::has_method;
pub(crate) use on_gpus::OnGpus;
pub use on_gpus::broad_phase;
pub use resident::{Resident, ResidentPairs, SubmittedCounts, SubmittedPairs};
pub use traffic::{Card, Traffic};
/// The version of wgpu whose buffers and devices this library takes. Its number is part of the name, because another one would be
/// other types: a release of this library that takes a newer wgpu exports it under a new name, and is a breaking one.
pub use wgpu as wgpu30;
