//! Broad-phase collision detection that knows which algorithm is fastest on this machine, for this frame.

mod aabb;
mod algorithm;
mod broad_phase;
pub mod cpu;
mod error;
pub mod hardware;
#[cfg(feature = "measure")]
pub mod measure;
mod pairs;

pub use aabb::Aabb;
pub use algorithm::{AlgorithmId, Backend, ParseIdError};
pub use broad_phase::BroadPhase;
pub use cpu::SimdLevel;
pub use error::{BoxDefect, Error};
pub use hardware::{Hardware, How, Machine, Parameter};
pub use pairs::{Pair, PairOrder, Pairs};
