//! The command `sapwise`.

mod args;
mod date;
mod document;
mod exit;
mod interrupt;
mod output;
mod progress;
mod table;
mod verbs;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = args::Arguments::parse();
    exit::report(verbs::run(arguments.verb))
}
