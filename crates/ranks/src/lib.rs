//! A broad phase over boxes that are spread over ranks, without MPI.
//!
//! Each rank passes its own boxes with 64-bit ids and gets their pairs ([`Distributed::find_pairs`]): the same set
//! that one process finds over all boxes. An [`Exchange`] carries words from rank to rank. The package `sapwise-mpi`
//! has one over MPI; [`Threads`] is one within a process, for tests and for a first try:
//!
//! ```
//! use sapwise::{Aabb, Registry, Tuning};
//! use sapwise_ranks::{Distributed, RankPairs, Threads};
//!
//! let found = Threads::run(2, |threads| {
//!     let registry = Registry::with_cores(1);
//!     let mut ranks: Distributed<Threads> = Distributed::new(threads, &registry, Tuning::usual(&registry))?;
//!     // A row of boxes, each of which touches the next. The ranks own every other box.
//!     let ids: Vec<u64> = (0..10).filter(|id| id % 2 == ranks.rank() as u64).collect();
//!     let boxes: Vec<Aabb> = ids.iter().map(|&id| Aabb::cube([id as f32, 0.0, 0.0], 0.5)).collect();
//!     let mut pairs = RankPairs::new();
//!     ranks.find_pairs(&boxes, &ids, &mut pairs)?;
//!     Ok::<_, sapwise_ranks::Error>(pairs.as_slice().to_vec())
//! });
//! let found: Vec<_> = found.into_iter().collect::<Result<_, _>>()?;
//! assert_eq!(found.concat().len(), 9);
//! # Ok::<(), sapwise_ranks::Error>(())
//! ```
//!
//! # How
//!
//! - Space is cut into one region for each rank ([`Cuts`], recursive coordinate bisection after Berger and Bokhari,
//!   1987). A box is searched in every region that it overlaps. The region that contains the lower corner of the
//!   intersection of two boxes reports their pair.
//! - The cuts follow density and predicted cost: a rank's share is the work that it does in the time that all ranks
//!   take ([`shares`]), by its [`Tuning`](sapwise::Tuning) and the times of its frames.
//! - The cuts are kept until the time lost to imbalance pays for new ones.
//! - A frame exchanges counts, then the boxes that cross, then the pairs that go back to the owners of boxes.
//! - An error on one rank is the same [`Error`] on all ranks, with its rank.

mod balance;
mod bisect;
mod cuts;
mod distributed;
mod error;
mod exchange;
mod outbox;
mod pairs;
mod record;
mod sample;
mod search;
mod share;
mod threads;

pub use bisect::bisect;
pub use cuts::{Cuts, Region, centre};
pub use distributed::{Distributed, FrameReport};
pub use error::{Error, Failure};
pub use exchange::Exchange;
pub use pairs::RankPairs;
pub use sample::Sample;
pub use share::{FACTORS, costs, pair_cost, predicted_ns, shares};
pub use threads::Threads;
