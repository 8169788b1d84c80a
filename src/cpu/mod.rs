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
    /// Makes an instance at a SIMD level for these numbers of threads, ascending: one number unless it is a family.
    pub(crate) create: fn(&[u32], &Threads, Simd) -> Made,
    /// Whether it is incremental, and one instance runs on any of its numbers of threads and keeps its state when they
    /// change. It begins with the least.
    pub(crate) is_family: bool,
}

/// An instance of a method.
pub(crate) type Made = Result<Box<dyn BroadPhase>, Error>;

/// Every method, the simplest first.
pub(crate) const METHODS: &[Method] = &[
    Method { name: "brute", revision: 4, create: brute::create, is_family: false },
    Method { name: "sap", revision: 4, create: sap::create, is_family: false },
    Method { name: "grid-sap", revision: 4, create: grid_sap::create, is_family: false },
    Method { name: "bvh", revision: 2, create: bvh::create, is_family: false },
    Method { name: "pair-cache", revision: 4, create: pair_cache::create, is_family: true },
];
