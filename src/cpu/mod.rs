//! Algorithms on the CPU, one file per method.

mod brute;
mod columns;
mod grid_sap;
#[cfg(feature = "parallel")]
mod helpers;
mod kernel;
mod level;
mod pair_cache;
mod sap;
mod sort;
mod strip_grid;
mod threads;
mod workers;

pub(crate) use kernel::each_bit;
pub use level::SimdLevel;
pub(crate) use strip_grid::StripGrid;
pub(crate) use threads::Threads;
#[cfg(feature = "measure")]
pub(crate) use threads::build_pool;
#[cfg(any(feature = "gpu", feature = "measure"))]
pub(crate) use workers::Workers;

use crate::{BroadPhase, Error};

/// A method of ours: one row here puts it into every test, probe, sweep and plot.
pub(crate) struct Method {
    /// The part of the id before the `@`.
    pub(crate) name: &'static str,
    /// Counts up when its speed changes.
    pub(crate) revision: u32,
    /// Makes an instance that runs on that many threads at that SIMD level.
    pub(crate) create: Create,
    /// Makes one that runs on any of some numbers of threads, where what it keeps from frame to frame is worth taking along.
    pub(crate) create_for: Option<CreateFor>,
}

type Create = fn(u32, &Threads, SimdLevel) -> Result<Box<dyn BroadPhase>, Error>;
type CreateFor = fn(&[u32], &Threads, SimdLevel) -> Result<Box<dyn BroadPhase>, Error>;

/// Every method, the simplest first.
pub(crate) const METHODS: &[Method] = &[
    Method { name: "brute", revision: 2, create: brute::create, create_for: None },
    Method { name: "sap", revision: 2, create: sap::create, create_for: None },
    Method { name: "grid-sap", revision: 2, create: grid_sap::create, create_for: None },
    Method { name: "pair-cache", revision: 1, create: pair_cache::create, create_for: Some(pair_cache::create_for) },
];
