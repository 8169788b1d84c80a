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
    pub(crate) create: Create,
}

/// An instance of a method.
pub(crate) type Made = Result<Box<dyn BroadPhase>, Error>;

/// Makes an instance at a SIMD level.
pub(crate) enum Create {
    /// It runs on that many threads.
    OneWidth(fn(u32, &Threads, Simd) -> Made),
    /// It is incremental, runs on any of these numbers of threads, ascending, and keeps its state when they change. It
    /// begins with the least.
    AnyWidth(fn(&[u32], &Threads, Simd) -> Made),
}

impl Create {
    /// Makes an instance for these numbers of threads, ascending: one number unless it [`is_family`](Self::is_family).
    pub(crate) fn make(&self, threads: &[u32], pools: &Threads, simd: Simd) -> Made {
        match self {
            Self::OneWidth(create) => create(threads[0], pools, simd),
            Self::AnyWidth(create) => create(threads, pools, simd),
        }
    }

    /// Returns whether one instance runs on several numbers of threads.
    pub(crate) fn is_family(&self) -> bool {
        matches!(self, Self::AnyWidth(_))
    }
}

/// Every method, the simplest first.
pub(crate) const METHODS: &[Method] = &[
    Method { name: "brute", revision: 4, create: Create::OneWidth(brute::create) },
    Method { name: "sap", revision: 4, create: Create::OneWidth(sap::create) },
    Method { name: "grid-sap", revision: 4, create: Create::OneWidth(grid_sap::create) },
    Method { name: "bvh", revision: 2, create: Create::OneWidth(bvh::create) },
    Method { name: "pair-cache", revision: 4, create: Create::AnyWidth(pair_cache::create) },
];
