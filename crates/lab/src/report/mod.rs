//! One machine, one day: what was measured, and nothing that was concluded.

mod record;
mod text;

pub use record::{Label, Point, Proof, Provenance, Report, Restricted, Restriction, Timed, TimedTerm, Timing};
pub use text::{FORMAT, read, write};
