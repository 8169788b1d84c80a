//! Broad-phase collision detection that knows which algorithm is fastest on this machine, for this frame.

mod aabb;
mod adaptive;
mod algorithm;
mod broad_phase;
mod cost;
pub mod cpu;
pub mod crossover;
mod error;
pub mod fields;
pub mod hardware;
#[cfg(feature = "model")]
pub mod json;
mod load;
#[cfg(feature = "measure")]
pub mod measure;
pub mod model;
mod pairs;
mod registry;
pub mod report;
mod sample;
mod scenario;
mod schema_tag;

pub use aabb::Aabb;
pub use adaptive::{Adaptive, Decision, Reason};
pub use algorithm::{AlgorithmId, Backend, ParseIdError};
pub use broad_phase::BroadPhase;
pub use cost::{CostCurve, CostTerm, Knot, Term};
pub use cpu::SimdLevel;
pub use crossover::{Crossover, Paired, Position};
pub use error::{BoxDefect, Error};
pub use fields::{AlgorithmCost, Border, Fields, Ranking, Source, Step};
pub use hardware::{Hardware, How, Machine, Parameter};
pub use load::Load;
pub use model::Model;
pub use pairs::{Pair, PairOrder, Pairs};
pub use registry::{Entry, Registry, usable_cores};
pub use report::Report;
pub use scenario::{Scenario, Scene};
