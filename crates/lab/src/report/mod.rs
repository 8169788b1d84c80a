//! Reports: the measurements of one machine on one day, without conclusions.

mod record;
mod text;

pub use record::{Label, Point, Proof, Provenance, Report, Restricted, Restriction, Timed, TimedTerm, Timing};
pub use text::{FORMAT, read, write};
