//! The command `sapwise`.

mod args;
mod boxes;
mod card;
mod child;
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
mod progress;
mod provenance;
mod random;
mod revisions;
mod simulate;
mod simulation;
mod summary;
mod sweep;
mod table;
mod train;
mod turns;
mod verbs;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = args::Arguments::parse();
    exit::report(verbs::run(arguments.verb))
}
