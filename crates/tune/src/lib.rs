//! From a machine to a tuning for it.
//!
//! [`measure`] finds the [`Hardware`] parameters, a [`Model`] trained on other machines predicts from them what each
//! algorithm costs, and the answer is a [`Tuning`](sapwise::Tuning) for [`Adaptive`](sapwise::Adaptive).
//! [`for_this_machine`] does all of it and keeps the tuning for the next start. [`json`] reads and writes the files.
//!
//! ```no_run
//! use sapwise::{Aabb, BroadPhase, Pairs};
//! use sapwise_tune::StartOptions;
//!
//! let mut broad_phase = sapwise_tune::for_this_machine(&StartOptions::new())?;
//! let mut pairs = Pairs::new();
//! broad_phase.find_pairs(&[Aabb::cube([0.0; 3], 0.5), Aabb::cube([0.8, 0.0, 0.0], 0.5)], &mut pairs)?;
//! # Ok::<(), sapwise::Error>(())
//! ```
//!
//! # Features
//!
//! - `measure` (default): [`measure`] and [`for_this_machine`]. Without it a tuning can be read, written and predicted.
//! - `gpu`: GPUs too, through `sapwise-gpu`.
//! - `schema`, `long-tests`: for the tools and tests of this repository.

#[cfg(feature = "measure")]
mod calibrate;
pub mod hardware;
pub mod json;
#[cfg(feature = "measure")]
pub mod measure;
pub mod model;
#[doc(hidden)]
pub mod stats;

#[cfg(feature = "measure")]
pub use calibrate::{StartOptions, for_this_machine};
pub use hardware::{
    GpuGroup, GpuHardware, GpuIdentity, GpuKind, GpuParameterId, Hardware, HardwareError, How, Machine, Parameter,
    ParameterId,
};
pub use model::Model;
pub use sapwise::internals::{Origin, SaveError, Setup};
