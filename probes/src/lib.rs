//! The command `sapwise` as a library, so that a program of a few lines is the whole command.

mod args;
mod boxes;
mod card;
mod check;
mod child;
mod compare;
mod contention;
mod date;
mod destination;
mod document;
mod exit;
mod files;
mod gpus;
mod hardware;
mod interrupt;
mod output;
mod plot;
mod prediction;
mod profiles;
mod progress;
mod provenance;
mod random;
mod restriction;
mod revisions;
mod simulate;
mod simulation;
mod steadiness;
mod summary;
mod sweep;
mod table;
mod train;
mod turns;
mod verbs;

use clap::Parser;
use std::process::ExitCode;

/// Reads the arguments of this process, does what they ask, and returns the exit status for `main` to return.
///
/// Parts of a measurement are processes of the same program, so nothing else may come between the start of `main` and this.
#[must_use]
pub fn run() -> ExitCode {
    let arguments = args::Arguments::parse();
    exit::report(verbs::run(arguments.verb))
}
