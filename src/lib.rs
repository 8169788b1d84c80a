//! Broad-phase collision detection with whichever algorithm is fastest on this machine, for this frame.
//!
//! An engine passes its [`Aabb`]s to [`Adaptive`] every frame and gets [`Pairs`] back. By its [`Tuning`], [`Adaptive`]
//! runs the algorithm of the [`Registry`] that is cheapest for the [`Load`] of the frame.
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
//! With the feature `this-machine`, `Adaptive::for_this_machine` does all of that: it measures the hardware once,
//! predicts the tuning and saves it for the next start.
//!
//! A tuning is written by hand ([`Tuning::usual`], [`Tuning::from_steps`]), predicted by a [`Model`] from the
//! parameters of the [`Hardware`], or measured, from the timings in a report. The feature `model` reads and writes
//! models and tunings as files. The command `sapwise` makes them.
//!
//! # Features
//!
//! - `parallel` (default): algorithms on several cores, with rayon. Without it only `@cpu1`.
//! - `gpu`: algorithms on GPUs, with wgpu; see the module `gpu`.
//! - `model`: models and tunings as JSON; prediction.
//! - `measure`: measures the hardware parameters of this machine.
//! - `measure-gpu`: measures those of its GPUs too.
//! - `this-machine`: `Adaptive::for_this_machine`, which measures, predicts and saves the tuning for the next start.
//! - `tracing`: an event for each switch of `Adaptive`, with its reason.
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
// Without the feature only the names of the algorithms and their requirements: reports name them, and none can run.
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

pub use aabb::Aabb;
pub use adaptive::{Adaptive, Decision, Reason};
#[cfg(feature = "this-machine")]
pub use adaptive::{Origin, SaveError, Setup};
pub use algorithm::{AlgorithmId, Backend, BackendClass, ParseIdError};
pub use broad_phase::{BroadPhase, FrameKind, FrameWork};
#[cfg(feature = "this-machine")]
pub use calibrate::StartOptions;
pub use changes::Changes;
pub use cost::{
    CostCurve, CostTerm, CurveError, Fallback, Helpers, MOST_UNIT_NS, Places, Product, Residual, Term, Work,
};
pub use cpu::{SimdLevel, SimdLevelError};
pub use entry::Entry;
pub use error::{BoxDefect, Error, Unavailable};
pub use filter::{Filter, Membership};
pub use hardware::{
    GpuGroup, GpuHardware, GpuIdentity, GpuKind, GpuParameterId, Hardware, HardwareError, How, Machine, Parameter,
    ParameterId,
};
pub use load::{Displacement, FramePlan, Load};
pub use model::Model;
pub use named::UnknownName;
pub use pair::Pair;
pub use pairs::{PairOrder, Pairs};
/// The version of rayon whose pools [`Registry::use_pool`] takes. The number is part of the name, because another
/// version has other types: a release of this library that takes a newer rayon is a breaking one, and exports it under
/// a new name.
#[cfg(feature = "parallel")]
pub use rayon as rayon1;
pub use registry::{AlgorithmSource, Registry, usable_cores};
pub use tuning::{AlgorithmCost, Crossover, Ranking, Source, Step, Tuning, TuningError};

/// The example of the README as a test.
#[cfg(all(doctest, feature = "this-machine"))]
#[doc = include_str!("../README.md")]
struct Readme;
