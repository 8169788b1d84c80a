//! The algorithms on the CPU, one file for each method.

mod brute;
mod bvh;
mod columns;
mod grid_sap;
#[cfg(feature = "parallel")]
mod helpers;
mod kernel;
mod level;
mod mean_time;
mod outputs;
mod pair_cache;
#[cfg(feature = "parallel")]
mod phases;
#[cfg(feature = "parallel")]
mod placement;
mod sap;
mod sort;
mod threads;
mod tree;
mod workers;
mod world;

#[cfg(feature = "parallel")]
pub use helpers::pinned_pool;
pub use kernel::triad::triad;
pub use level::{SimdLevel, SimdLevelError};
pub use threads::Threads;
pub use tree::Tree;
pub use workers::Workers;

pub(crate) use columns::{Columns, ColumnsMut, ensure, order_key, part, reserve, split};
pub(crate) use kernel::marks::Marks;
pub(crate) use kernel::node::{Group, LANES, Node};
pub(crate) use kernel::prefetch;
pub(crate) use kernel::rows::{brute_rows, sweep_rows};
pub(crate) use kernel::walk::Walk;
pub(crate) use level::Simd;
pub(crate) use outputs::Outputs;
pub(crate) use pair_cache::GrownTree;
pub(crate) use sort::sort;
pub(crate) use tree::{Input, Members, NOBODY, Near, Upkeep, Wear};
pub(crate) use world::WorldSearch;

use crate::{BroadPhase, Error};

/// A built-in method: a row here puts it into every registry, contract, probe and sweep.
pub(crate) struct Method {
    /// The part of the id before the `@`.
    pub(crate) name: &'static str,
    /// Rises when its speed changes.
    pub(crate) revision: u32,
    /// Makes an instance for this many threads at a SIMD level.
    pub(crate) create: fn(u32, &Threads, Simd) -> Made,
    /// Whether it fits the number of its threads to each frame.
    pub(crate) fits_threads: bool,
}

/// An instance of a method.
pub(crate) type Made = Result<Box<dyn BroadPhase>, Error>;

/// Every method, the simplest first.
pub(crate) const METHODS: &[Method] = &[
    Method { name: "brute", revision: 4, create: brute::create, fits_threads: false },
    Method { name: "sap", revision: 4, create: sap::create, fits_threads: false },
    Method { name: "grid-sap", revision: 4, create: grid_sap::create, fits_threads: false },
    Method { name: "bvh", revision: 2, create: bvh::create, fits_threads: false },
    Method { name: "pair-cache", revision: 4, create: pair_cache::create, fits_threads: true },
];
