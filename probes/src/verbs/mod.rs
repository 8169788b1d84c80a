//! The verbs, one file each.

mod check;
mod compare;
mod convert;
mod devices;
mod fleet;
mod pairs;
mod part;
mod predict;
mod predict_kinds;
mod probe;
mod run;
mod schema;
mod simulate;
mod study;
mod train;

use crate::algorithms::Algorithms;
use crate::args::Verb;
use crate::exit::{Outcome, WrongUsage};
use sapwise::SimdLevel;

/// Runs a verb to its end.
///
/// # Errors
/// Whatever keeps the verb from doing what it was asked for.
pub(crate) fn run(verb: Verb, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    // The library falls back to the detected level where the variable is wrong. Here that would label a measurement with a
    // level that it was not taken at.
    SimdLevel::requested().map_err(|e| WrongUsage(e.to_string()))?;
    match verb {
        Verb::Predict(arguments) => predict::run(&arguments, algorithms),
        Verb::Devices(arguments) => devices::run(&arguments, algorithms),
        Verb::Probe(arguments) => probe::run(&arguments, algorithms),
        Verb::Run(arguments) => run::run(&arguments, algorithms),
        Verb::Train(arguments) => train::run(&arguments),
        Verb::Study(arguments) => study::run(&arguments),
        Verb::Pairs(arguments) => pairs::run(&arguments, algorithms),
        Verb::Convert(arguments) => convert::run(&arguments),
        Verb::Compare(arguments) => compare::run(&arguments),
        Verb::Fleet(arguments) => fleet::run(&arguments, algorithms),
        Verb::Check(arguments) => check::run(&arguments, algorithms),
        Verb::Simulate(arguments) => simulate::run(&arguments),
        Verb::Schema(arguments) => schema::run(&arguments),
        Verb::Part(arguments) => part::run(arguments, algorithms),
    }
}
