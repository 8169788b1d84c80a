//! The verbs, one file each.

mod check;
mod devices;
mod pairs;
mod part;
mod predict;
mod predict_kinds;
mod probe;
mod run;
mod schema;
mod study;
mod train;

use crate::algorithms::Algorithms;
use crate::args::Verb;
use crate::exit::{Outcome, WrongUsage};
use sapwise::algorithm::SimdLevel;

/// Runs a verb to its end.
///
/// # Errors
/// When the verb can't finish.
pub(crate) fn run(verb: Verb, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    // The library ignores a wrong variable, which would label a measurement with a wrong level.
    SimdLevel::requested().map_err(|e| WrongUsage(e.to_string()))?;
    match verb {
        Verb::Predict(arguments) => predict::run(&arguments, algorithms),
        Verb::Devices(arguments) => devices::run(&arguments, algorithms),
        Verb::Probe(arguments) => probe::run(&arguments, algorithms),
        Verb::Run(arguments) => run::run(&arguments, algorithms),
        Verb::Train(arguments) => train::run(&arguments),
        Verb::Study(arguments) => study::run(&arguments),
        Verb::Pairs(arguments) => pairs::run(&arguments, algorithms),
        Verb::Check(arguments) => check::run(&arguments, algorithms),
        Verb::Schema(arguments) => schema::run(&arguments),
        Verb::Part(part) => part::run(part, algorithms),
    }
}
