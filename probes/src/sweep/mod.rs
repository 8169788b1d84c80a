//! The sweep: every algorithm on the same frames of seeded scenes, over sizes and scenarios.

mod dropout;
mod order;
mod plan;
mod race;
mod scenario;
mod statistics;
mod verify;

pub(crate) use order::{Event, Order};
pub(crate) use plan::Plan;
pub(crate) use scenario::sweep;
pub(crate) use statistics::median;
