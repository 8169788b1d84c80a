//! A broad phase over the ranks of an MPI program.
//!
//! [`Distributed`] is the broad phase of [`sapwise_ranks`] over a communicator of the crate [`mpi`]. Each rank passes
//! its own boxes with 64-bit ids and gets their pairs: the same set that one process finds over all boxes.
//!
//! ```no_run
//! use mpi::Threading;
//! use mpi::traits::Communicator;
//! use sapwise::{Aabb, Registry, Tuning};
//! use sapwise_mpi::{Distributed, RankPairs};
//!
//! fn main() -> Result<(), sapwise_mpi::Error> {
//!     // Of the threads of the algorithms only this one calls MPI.
//!     let (universe, _) = mpi::initialize_with_threading(Threading::Funneled).expect("MPI was initialised before");
//!     let world = universe.world();
//!     let registry = Registry::new();
//!     let mut broad_phase = Distributed::new(&world, &registry, Tuning::usual(&registry))?;
//!     let mut pairs = RankPairs::new();
//!     for frame in 0..100 {
//!         let place = [world.rank() as f32 * 0.9, frame as f32, 0.0];
//!         let (boxes, ids) = ([Aabb::cube(place, 0.5)], [world.rank() as u64]);
//!         broad_phase.find_pairs(&boxes, &ids, &mut pairs)?; // every rank, every frame
//!     }
//!     Ok(())
//! }
//! ```
//!
//! # Failures
//!
//! - An error in the boxes of one rank is the same [`Error`] on all ranks, and the next frame runs.
//! - MPI ends the job when a rank dies. When a rank no longer answers, another one reports on standard error what it
//!   waited for and ends the job with `MPI_Abort`, after [a limit](MpiExchange::with_wait_limit).
//! - Drop a [`Distributed`] before the `Universe`, because it owns a communicator.

mod exchange;
mod wait;

pub use exchange::MpiExchange;
pub use sapwise_ranks::{Cuts, Error, Failure, FrameReport, RankPairs, Region};

/// A broad phase over the ranks of a communicator: `Distributed::new(&communicator, &registry, tuning)` on all of its
/// ranks.
///
/// Each rank passes the registry and the tuning of its own machine. Machines may differ, and the cuts follow their
/// speed.
pub type Distributed = sapwise_ranks::Distributed<MpiExchange>;
