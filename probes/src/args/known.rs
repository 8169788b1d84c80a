//! Values that the command knows: a shell completes them, and the help lists them.

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::error::Error;
use clap::{Arg, Command};
use sapwise::{AlgorithmId, Registry, usable_cores};
use sapwise_scenes::Scenario;
use std::ffi::OsStr;

/// Reads values as `parser` does, with its errors, which say more than that a value is none of a list.
#[derive(Clone)]
struct Known<P> {
    parser: P,
    values: fn() -> Vec<String>,
}

impl<P: TypedValueParser> TypedValueParser for Known<P> {
    type Value = P::Value;

    fn parse_ref(&self, command: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<P::Value, Error> {
        self.parser.parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.values)().into_iter().map(PossibleValue::new)))
    }
}

fn scenarios() -> Vec<String> {
    Scenario::ALL.map(|s| s.name().to_owned()).to_vec()
}

/// A scenario.
pub(super) fn scenario() -> impl TypedValueParser<Value = Scenario> {
    Known { parser: |text: &str| text.parse::<Scenario>(), values: scenarios }
}

/// The name of a scenario, which is read later.
pub(super) fn scenario_name() -> impl TypedValueParser<Value = String> {
    Known { parser: StringValueParser::new(), values: scenarios }
}

/// A value that may be a scenario, read by `parser`.
pub(super) fn scenario_or<P: TypedValueParser>(parser: P) -> impl TypedValueParser<Value = P::Value> {
    Known { parser, values: scenarios }
}

/// An algorithm. Those of GPUs and of a user's program are taken as well; a shell that completes them would have to load drivers.
pub(super) fn algorithm() -> impl TypedValueParser<Value = AlgorithmId> {
    let ours = || Registry::with_cores(usable_cores()).available().into_iter().map(|e| e.id.to_string()).collect();
    Known { parser: |text: &str| text.parse::<AlgorithmId>(), values: ours }
}
