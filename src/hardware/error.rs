//! What makes the description of a machine unusable.

use super::Bounds;
use std::fmt;

/// What makes the description of a machine unusable. A parameter is named with the GPU that it is of.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum HardwareError {
    /// A value that is negative or not finite.
    Figure {
        /// The parameter.
        parameter: String,
        /// Its value.
        value: f64,
    },
    /// A value that contradicts its samples.
    Samples {
        /// The parameter.
        parameter: String,
        /// The contradiction.
        why: String,
    },
    /// Something that is listed twice.
    Repeated {
        /// What is listed twice.
        what: String,
    },
    /// Numbers of GPUs that are not a group.
    NoGroup {
        /// The numbers.
        gpus: Vec<u32>,
    },
    /// A value that no machine has, most often because it is in another unit.
    Implausible {
        /// The parameter.
        parameter: String,
        /// Its value.
        value: f64,
        /// Lowest and highest plausible value.
        bounds: Bounds,
    },
}

impl fmt::Display for HardwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Figure { parameter, value } => {
                write!(f, "the parameter {parameter} is {value:e}; it must be a number and not negative")
            }
            Self::Samples { parameter, why } => write!(f, "the parameter {parameter}: {why}"),
            Self::Repeated { what } => write!(f, "{what} is listed twice"),
            Self::NoGroup { gpus } => {
                write!(f, "{gpus:?} is not a group of GPUs: name two or more of the listed GPUs, ascending")
            }
            Self::Implausible { parameter, value, bounds: Bounds { least, most } } => write!(
                f,
                "the parameter {parameter} is {value}, and no machine lies outside {least} to {most}; check its unit, or measure it \
                 with `sapwise probe --hardware-only`"
            ),
        }
    }
}

impl std::error::Error for HardwareError {}
