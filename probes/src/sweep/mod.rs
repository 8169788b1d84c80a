//! The sweep: every algorithm on the same frames of seeded scenes, over scenarios and sizes.

mod contest;
mod race;
mod request;
mod runner;
mod scenario;
mod verify;
mod visits;

pub(crate) use request::SweepRequest;
pub(crate) use runner::{Found, sweep_all};
pub(crate) use scenario::sweep;
