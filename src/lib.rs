//! Broad-phase collision detection that knows which algorithm is fastest on this machine, for this frame.
//!
//! An engine hands its [`Aabb`]s to [`Adaptive`] every frame and gets [`Pairs`] back. Which algorithm of the [`Registry`]
//! ran was decided by [`Tuning`]: the cheapest for the [`Load`] of the frame.
//!
//! ```
//! use sapwise::{Aabb, Adaptive, BroadPhase, Tuning, Pairs, Registry};
//!
//! let registry = Registry::new();
//! let mut broad_phase = Adaptive::new(Tuning::usual(&registry), &registry)?;
//! let mut pairs = Pairs::new();
//! broad_phase.find_pairs(&[Aabb::cube([0.0; 3], 0.5), Aabb::cube([1.0, 0.0, 0.0], 0.5)], &mut pairs)?;
//! assert_eq!(pairs.as_slice(), [(0, 1)]);
//! # Ok::<(), sapwise::Error>(())
//! ```
//!
//! With the feature `this-machine`, `Adaptive::for_this_machine` does all of that: it measures the hardware once, predicts the tuning and
//! keeps them for the next start.
//!
//! Where tuning comes from, in ascending order of trust: written by hand ([`Tuning::usual`], [`Tuning::from_steps`]),
//! predicted by a [`Model`] from the parameters of the [`Hardware`], or measured, from the timings in a report. Models
//! and tuning are files of the feature `model`; the command `sapwise` makes them.
//!
//! # Features
//!
//! - `parallel` (default): the algorithms on several cores, through rayon. Without it only `@cpu1`.
//! - `gpu`: the algorithms on GPUs, through wgpu; see the module `gpu`.
//! - `model`: models and tuning as JSON; prediction.
//! - `measure`: measures the hardware parameters of this machine.
//! - `measure-gpu`: those of its GPUs too.
//! - `this-machine`: `Adaptive::for_this_machine`, which measures, predicts and keeps the tuning for the next start.
//! - `tracing`: events that tell each switch of `Adaptive` with its reason.
//! - `schema`: the JSON Schemas of the files, for tools.

#![cfg_attr(docsrs, feature(doc_cfg))]

mod aabb;
mod adaptive;
mod algorithm;
mod broad_phase;
#[cfg(feature = "this-machine")]
mod calibrate;
#[cfg(feature = "parallel")]
mod cgroup;
mod changes;
mod clock;
mod cost;
mod cpu;
mod entry;
mod error;
mod filter;
#[cfg(feature = "gpu")]
pub mod gpu;
// Without the feature only which algorithms there are and what they ask of a GPU: reports name them, and nothing of them can run.
#[cfg(not(feature = "gpu"))]
#[path = "gpu/without_gpus.rs"]
pub mod gpu;
pub mod hardware;
#[cfg(feature = "model")]
pub mod json;
mod load;
#[cfg(feature = "measure")]
pub mod measure;
pub mod model;
mod named;
mod pair;
mod pairs;
mod registry;
#[cfg(test)]
mod scene;
mod splitmix;
pub mod stats;
pub mod tuning;
#[cfg(feature = "model")]
mod wire;

pub use aabb::Aabb;
pub use adaptive::{Adaptive, Decision, Reason};
#[cfg(feature = "this-machine")]
pub use adaptive::{Origin, SaveError, Setup};
pub use algorithm::{AlgorithmId, Backend, BackendClass, ParseIdError};
pub use broad_phase::{BroadPhase, FrameKind, FrameWork, Incremental};
#[cfg(feature = "schema")]
pub use calibrate::cache_schema;
#[cfg(all(fuzzing, feature = "this-machine"))]
#[doc(hidden)]
pub use calibrate::is_readable_cache;
#[cfg(feature = "this-machine")]
pub use calibrate::{Cache, StartOptions};
pub use changes::Changes;
pub use cost::{
    CostCurve, CostTerm, Counts, CurveError, Fallback, Helpers, MOST_UNIT_NS, Places, Product, Residual, Term, Work,
};
pub use cpu::{SimdLevel, SimdLevelError};
pub use entry::Entry;
pub use error::{BoxDefect, Error, Unavailable};
pub use filter::{Filter, Membership};
#[cfg(feature = "this-machine")]
pub use hardware::Measurement;
pub use hardware::{
    GpuGroup, GpuHardware, GpuIdentity, GpuKind, GpuParameterId, Hardware, HardwareError, How, Machine, Parameter,
    ParameterId,
};
pub use load::{Displacement, FramePlan, Load};
pub use model::Model;
pub use named::UnknownName;
pub use pair::Pair;
pub use pairs::{PairOrder, Pairs};
/// The version of rayon whose pools this library takes: [`Registry::use_pool`]. Its number is part of the name, because another one
/// would be other types: a release of this library that takes a newer rayon exports it under a new name, and is a breaking one.
#[cfg(feature = "parallel")]
pub use rayon as rayon1;
pub use registry::{Registry, usable_cores};
pub use tuning::{AlgorithmCost, Crossover, Ranking, Source, Step, Tuning, TuningError};

/// The example of the README as a test, with the feature that it needs.
#[cfg(all(doctest, feature = "this-machine"))]
#[doc = include_str!("../README.md")]
struct Readme;
