//! The pairs of boxes that are spread over ranks, without MPI: all that a distributed broad phase decides and counts.
//!
//! Each rank hands in boxes of its own with 64-bit ids and gets the pairs of them ([`Distributed::find_pairs`]): the same set that one process
//! finds over all boxes. What carries words from rank to rank is an [`Exchange`]: the package `sapwise-mpi` has the one over MPI, [`Threads`] is
//! one in a process, for tests and for a first try:
//!
//! ```
//! use sapwise::{Aabb, Registry, Tuning};
//! use sapwise_ranks::{Distributed, RankPairs, Threads};
//!
//! let found = Threads::run(2, |threads| {
//!     let registry = Registry::with_cores(1);
//!     let mut ranks: Distributed<Threads> = Distributed::new(threads, &registry, Tuning::usual(&registry))?;
//!     // A row of boxes, dealt to both ranks like cards: each touches the next.
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
//! - Space is cut into a region for each rank ([`Cuts`], recursive coordinate bisection after Berger and Bokhari, 1987). A box is searched in every
//!   region that it overlaps, and a pair is found in the one region that holds the lower corner of the intersection of its two boxes.
//! - The cuts follow density and predicted cost: a rank's share of the work is what its [`Tuning`](sapwise::Tuning), corrected by the time of its
//!   frames, says that it does in the time that all ranks take ([`shares`]).
//! - They are kept from frame to frame, and made again once the time that imbalance has cost since pays for that ([`Balance`]).
//! - A frame exchanges counts first, then only the boxes that cross, then the counts and the pairs that go back to the owners of boxes.
//! - Errors agree: what is wrong on one rank is the same [`Error`] on all of them, with its rank.

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

pub use balance::Balance;
pub use bisect::bisect;
pub use cuts::{Cuts, Region, centre};
pub use distributed::{BOX_BYTES, Distributed, FrameReport, PAIR_BYTES, TOLD_BYTES};
pub use error::{Error, Failure};
pub use exchange::Exchange;
pub use pairs::RankPairs;
pub use record::RankRecord;
pub use sample::Sample;
pub use share::{FACTORS, costs, pair_cost, predicted_ns, shares};
pub use threads::Threads;
