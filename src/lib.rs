//! Broad-phase collision detection with whichever algorithm is fastest on this machine, for this frame.
//!
//! A [`Space`] holds the bodies of an engine. The engine sets those that moved, and gets the pairs that overlap:
//!
//! ```
//! use sapwise::{Aabb, Body, Space};
//!
//! let mut space = Space::new();
//! let wall = space.insert(Aabb::cube([0.0; 3], 0.5), Body::fixed())?;
//! let player = space.insert(Aabb::cube([5.0, 0.0, 0.0], 0.5), Body::default())?;
//! space.set(player, Aabb::cube([1.0, 0.0, 0.0], 0.5))?;
//! space.update()?;
//! assert_eq!(space.pairs(), [(wall, player)]);
//! # Ok::<(), sapwise::Error>(())
//! ```
//!
//! The space searches with an [`Adaptive`]. By its [`Tuning`], this runs the algorithm of the [`Registry`] that is
//! cheapest for the [load](algorithm::Load) of the frame. A program that has an array of boxes in every frame calls it
//! directly:
//!
//! ```
//! use sapwise::{Aabb, Adaptive, BroadPhase, Pairs, Registry, Tuning};
//!
//! let registry = Registry::new();
//! let mut broad_phase = Adaptive::new(Tuning::usual(&registry), &registry)?;
//! let mut pairs = Pairs::new();
//! broad_phase.find_pairs(&[Aabb::cube([0.0; 3], 0.5), Aabb::cube([1.0, 0.0, 0.0], 0.5)], &mut pairs)?;
//! assert_eq!(pairs.as_slice(), [(0, 1)]);
//! # Ok::<(), sapwise::Error>(())
//! ```
//!
//! A tuning is written by hand ([`Tuning::usual`], [`Tuning::from_steps`]) or comes from the crate `sapwise-tune`,
//! which measures the hardware, predicts the tuning and saves it for the next start. The crate `sapwise-gpu` adds the
//! methods on GPUs to a [`Registry`].
//!
//! # Features
//!
//! - `parallel` (default): algorithms on several cores, with rayon. Without it only `@cpu1`, and no dependency.
//! - `serde`: tunings, and a [`Space`] with all that is in it, can be serialised.
//! - `mint`, `glam-034`: an [`Aabb`] and a [`Ray`] from two points or vectors of these crates, and back.
//! - `tracing`: an event for each switch of `Adaptive`, with its reason.
//! - `schema`, `bytemuck`, `long-tests`: for the other crates of this repository and its tests.

#![cfg_attr(docsrs, feature(doc_cfg))]

mod aabb;
mod adaptive;
pub mod algorithm;
mod between;
mod broad_phase;
mod changes;
mod clock;
mod cost;
mod cpu;
mod described;
mod entry;
pub mod error;
mod filter;
mod gpu_identity;
#[doc(hidden)]
pub mod internals;
mod load;
mod named;
mod pairs;
mod ray;
mod registry;
#[cfg(test)]
mod scene;
mod space;
#[doc(hidden)]
pub mod splitmix;
#[doc(hidden)]
pub mod stats;
pub mod tuning;
mod worlds;

use broad_phase::check_count;
use error::{BoxDefect, Unavailable};
use filter::Screen;
use load::{FramePlan, Load, SceneStats};
use pairs::Pair;
use splitmix::mix;

pub use aabb::Aabb;
pub use adaptive::{Adaptive, Decision, Reason};
pub use algorithm::AlgorithmId;
pub use between::Between;
pub use broad_phase::BroadPhase;
pub use changes::Changes;
#[cfg(all(not(test), target_family = "wasm", target_os = "unknown"))]
pub use clock::set_clock;
pub use error::Error;
pub use filter::{Filter, Membership};
pub use pairs::{PairOrder, Pairs};
pub use ray::Ray;
/// The version of rayon whose pools [`Registry::use_pool`] takes. The number is part of the name, because another
/// version has other types: a release of this library that takes a newer rayon is a breaking one, and exports it under
/// a new name.
#[cfg(feature = "parallel")]
pub use rayon as rayon1;
pub use registry::Registry;
pub use space::{Body, Handle, Space, View};
pub use tuning::Tuning;
pub use worlds::Worlds;
