//! The GPUs of this machine.
//!
//! A driver that crashes must cost its GPU and not the run. So a process of its own looks for GPUs first, another one makes the algorithms on
//! them, and one each measures them; drivers are loaded in the process of a verb only after that went well.

mod choice;
mod entries;
mod look;
mod measured;
mod parameters;

pub(crate) use choice::{GpuChoice, difference, uses};
pub(crate) use entries::{entries, print_entries};
pub(crate) use look::{Seen, look};
pub(crate) use measured::{Measured, measure};
pub(crate) use parameters::{print_group, print_identities, print_parameters};
