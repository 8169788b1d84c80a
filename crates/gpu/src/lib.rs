//! Algorithms on GPUs through wgpu: Vulkan, Metal and DX12 from one shader source each.
//!
//! [`Gpus::find`] looks for adapters, and [`add_to`] adds the algorithms on them to a
//! [`Registry`](sapwise::Registry). Without that call no driver is loaded. Drivers are found at run time: a program
//! that uses this crate also runs without any.
//!
//! ```
//! use sapwise::{Aabb, Adaptive, BroadPhase, Pairs, Registry, Tuning};
//! use sapwise_gpu::Gpus;
//!
//! let mut registry = Registry::new();
//! // Software adapters such as llvmpipe are found too. They run on the CPU and can't beat it.
//! sapwise_gpu::add_to(&mut registry, &Gpus::find().choose(|gpu| gpu.kind != sapwise_gpu::GpuKind::Software));
//! // A tuning may name GPUs, and those that this machine lacks are left out. This tuning names none.
//! let mut broad_phase = Adaptive::new(Tuning::usual(&registry), &registry)?;
//! let mut pairs = Pairs::new();
//! broad_phase.find_pairs(&[Aabb::cube([0.0; 3], 0.5), Aabb::cube([0.8, 0.0, 0.0], 0.5)], &mut pairs)?;
//! # assert_eq!(pairs.as_slice(), [(0, 1)]);
//! # Ok::<(), sapwise::Error>(())
//! ```
//!
//! A frame is *host-resident* or *device-resident*, and times of the two can't be compared:
//!
//! - Host-resident: boxes and pairs are in the memory of the CPU, and both transfers count. This is every
//!   [`BroadPhase`](sapwise::BroadPhase), on GPUs as on CPUs, and every time without a label. Up to four threads copy
//!   boxes and pairs, and the calling thread polls for a millisecond before it sleeps.
//! - Device-resident: boxes are in one [`wgpu30::Buffer`] and pairs in another. This is [`Resident`].
//!
//! The order of the pairs is the same in every run, with two exceptions. Several GPUs share a frame by their measured
//! speeds. And boxes of one cell of `grid-sap` keep a random order if the cell holds more than 32 768 of them (1024
//! in a frame of a million). [`PairOrder::Canonical`](sapwise::PairOrder) has no exception.
//!
//! Pairs that don't fit into a buffer arrive in several steps. Boxes that don't fit into a GPU are searched slab by
//! slab.
//!
//! | method | how |
//! |---|---|
//! | `brute` | every box against every other |
//! | `sap` | radix sort along one axis |
//! | `grid-sap` | counting sort into the slots of a grid of strips; oversized boxes go into a tree |
//! | `bvh` | a tree over all boxes, in the order of a Hilbert curve; eight consecutive boxes form a node |
//!
//! In a browser nothing may wait. With the feature `webgpu`, `Gpu::in_browser` opens WebGPU there and `AsyncBroadPhase`
//! runs a method, by the same code; everything else of this package that waits is for other systems.
//!
//! A GPU that is lost, refuses memory, executes nothing or does not answer within a minute is
//! [`Error::Unavailable`](sapwise::Error). [`Adaptive`](sapwise::Adaptive) then runs the same frame on another
//! algorithm.

mod adapters;
#[cfg(target_family = "wasm")]
mod browser;
mod brute;
mod cells;
mod device;
mod division;
mod engine;
mod failure;
#[doc(hidden)]
pub mod kernel;
mod late;
mod look;
mod memberships;
mod methods;
mod on_gpus;
mod output;
mod pairing;
mod params;
mod resident;
mod sampler;
mod scope;
mod search;
mod share;
mod slabs;
mod sort;
mod sorted;
mod source;
mod storage;
mod transfer;
mod tree;
#[doc(hidden)]
pub mod watch;

use engine::Engine;
use failure::{Failure, unavailable};
use kernel::{Bound, Kernel};
use late::Late;
use look::Look;
use output::{Output, PAIR};
use pairing::Pairing;
use params::{Header, Params};
use search::{Inputs, Search};
use slabs::Slabs;
use storage::{Storage, constant, largest};
use watch::Place;

#[cfg(test)]
pub(crate) use adapters::first_for_tests;
pub use adapters::{Gpus, identity};
#[cfg(target_family = "wasm")]
pub use browser::AsyncBroadPhase;
pub use device::Gpu;
pub use methods::algorithms;
pub use on_gpus::broad_phase;
pub use resident::{Resident, ResidentPairs, SubmittedCounts, SubmittedPairs};
pub use sapwise::error::{GpuError, GpuErrorKind};
pub use sapwise::internals::{GpuIdentity, GpuKind};
#[doc(hidden)]
pub use scope::Recording;
pub use source::add_to;
/// The version of wgpu whose buffers and devices this library takes. Its number is part of the name because another
/// version has other types. A release that takes a newer wgpu exports it under a new name, and is a breaking one.
pub use wgpu as wgpu30;
