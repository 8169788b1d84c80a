//! The verbs, one file each.

mod check;
mod devices;
mod pairs;
mod part;
mod probe;
mod schema;

use crate::args::Verb;
use crate::exit::{Outcome, WrongUsage};
use sapwise::SimdLevel;

/// Runs a verb to its end.
///
/// # Errors
/// Whatever keeps the verb from doing what it was asked for.
pub(crate) fn run(verb: Verb) -> anyhow::Result<Outcome> {
    // The library falls back to the detected level where the variable is wrong. Here that would label a measurement with a
    // level that it was not taken at.
    SimdLevel::requested().map_err(WrongUsage)?;
    match verb {
        Verb::Devices(arguments) => devices::run(&arguments),
        Verb::Probe(arguments) => probe::run(&arguments),
        Verb::Train(_) => Ok(Outcome::Failed),
        Verb::Pairs(arguments) => pairs::run(&arguments),
        Verb::Check(arguments) => check::run(&arguments),
        Verb::Schema(arguments) => schema::run(&arguments),
        Verb::Part(arguments) => part::run(arguments),
    }
}
