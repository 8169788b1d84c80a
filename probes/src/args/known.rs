//! Values that the command knows, which the help lists.

use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::Error;
use clap::{Arg, Command};
use sapwise_scenes::Scenario;
use std::ffi::OsStr;

/// Reads values as the parser does, with its errors, which say more than that a value is none of a list.
#[derive(Clone)]
struct Scenarios<P>(P);

impl<P: TypedValueParser> TypedValueParser for Scenarios<P> {
    type Value = P::Value;

    fn parse_ref(&self, command: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<P::Value, Error> {
        self.0.parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(Scenario::ALL.into_iter().map(|s| PossibleValue::new(s.name()))))
    }
}

/// A scenario.
pub(super) fn scenario() -> impl TypedValueParser<Value = Scenario> {
    Scenarios(|text: &str| text.parse::<Scenario>())
}

/// A value that may be a scenario, read by `parser`.
pub(super) fn scenario_or<P: TypedValueParser>(parser: P) -> impl TypedValueParser<Value = P::Value> {
    Scenarios(parser)
}
