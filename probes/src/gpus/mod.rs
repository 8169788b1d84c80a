//! The GPUs of this machine.
//!
//! A driver that crashes costs its GPU and not the run: one process looks for GPUs, another one tries the algorithms
//! on them, and a separate process measures each of them. A verb loads drivers into its own process only after that
//! went well.

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
