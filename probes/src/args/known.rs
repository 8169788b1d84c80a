//! Values that the help lists or gives a range for.

use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::Error;
use clap::{Arg, Command};
use sapwise_scenes::Scenario;
use std::ffi::OsStr;
use std::ops::RangeInclusive;

/// Lists the scenarios in the help, but keeps the errors of the parser, which say more than "not in the list".
#[derive(Clone)]
pub(super) struct Scenarios<P>(pub(super) P);

impl<P: TypedValueParser> TypedValueParser for Scenarios<P> {
    type Value = P::Value;

    fn parse_ref(&self, command: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<P::Value, Error> {
        self.0.parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(Scenario::ALL.into_iter().map(|s| PossibleValue::new(s.as_str()))))
    }
}

/// Parses a whole number within a range. The errors of clap's own parser name no range.
pub(super) fn whole(range: RangeInclusive<u32>) -> impl TypedValueParser<Value = u32> {
    move |text: &str| match text.parse() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => Err(format!("give a whole number from {} to {}", range.start(), range.end())),
    }
}

/// Parses a scenario.
pub(super) fn scenario() -> impl TypedValueParser<Value = Scenario> {
    Scenarios(|text: &str| text.parse::<Scenario>())
}
