//! The pairs of boxes that are spread over the ranks of an MPI program.
//!
//! [`Distributed`] is the broad phase of [`sapwise_ranks`] over a communicator of the crate [`mpi`]: each rank hands in its own boxes with 64-bit ids and
//! gets the pairs of them, the same set that one process finds over all boxes.
//!
//! ```no_run
//! use mpi::Threading;
//! use mpi::traits::Communicator;
//! use sapwise::{Aabb, Registry, Tuning};
//! use sapwise_mpi::{Distributed, RankPairs};
//!
//! fn main() -> Result<(), sapwise_mpi::Error> {
//!     // Algorithms on several cores have threads, of which only this one calls MPI.
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
//! # Ends
//!
//! - What is wrong with the boxes of one rank is the same [`Error`] on all ranks, and the next frame runs.
//! - A rank that dies ends the job, as MPI does by itself. For one that no longer answers, stopped or in an endless loop, there is a limit on waiting
//!   ([`MpiExchange::with_wait_limit`]): beyond it a rank writes what it waited for to standard error and ends the job (`MPI_Abort`).
//! - Drop a [`Distributed`] before the `Universe`, whose end is that of MPI: it has a communicator of its own.

mod exchange;
mod wait;

pub use exchange::MpiExchange;
pub use sapwise_ranks::{Balance, Cuts, Error, Failure, FrameReport, RankPairs, Region};

/// A broad phase over the ranks of a communicator: `Distributed::new(&communicator, &registry, tuning)`, on all of its ranks.
///
/// The registry and the tuning are those of the rank's own machine: machines may differ, and the cuts follow their speed.
pub type Distributed = sapwise_ranks::Distributed<MpiExchange>;
