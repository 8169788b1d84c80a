//! The command `sapwise`.

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
mod samples;
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

fn main() -> ExitCode {
    let arguments = args::Arguments::parse();
    exit::report(verbs::run(arguments.verb))
}
