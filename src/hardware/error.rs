//! What makes the description of a machine unusable.

use super::Bounds;
use std::fmt;

/// What makes the description of a machine unusable.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum HardwareError {
    /// A figure that is negative or no number.
    Figure {
        /// The parameter, with whose it is.
        parameter: String,
        /// The figure.
        value: f64,
    },
    /// A figure that its own samples contradict.
    Samples {
        /// The parameter, with whose it is.
        parameter: String,
        /// In what they contradict it.
        why: String,
    },
    /// Something that stands there twice.
    Repeated {
        /// What.
        what: String,
    },
    /// Numbers of GPUs that are no group.
    NoGroup {
        /// The numbers.
        gpus: Vec<u32>,
    },
    /// A figure that no machine has; most often it is in another unit.
    Implausible {
        /// The parameter, with whose it is.
        parameter: String,
        /// The figure.
        value: f64,
        /// Where figures lie.
        bounds: Bounds,
    },
}

impl fmt::Display for HardwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Figure { parameter, value } => write!(f, "the parameter {parameter} is {value:e}"),
            Self::Samples { parameter, why } => write!(f, "the parameter {parameter}: {why}"),
            Self::Repeated { what } => write!(f, "{what} stands there twice"),
            Self::NoGroup { gpus } => {
                write!(f, "the GPUs {gpus:?} are no group of two or more of the GPUs that stand there")
            }
            Self::Implausible { parameter, value, bounds: Bounds { least, most, why } } => write!(
                f,
                "the parameter {parameter} is {value}, and no machine lies outside {least} to {most} ({why}); check its unit, or measure \
                 it with `sapwise probe --hardware-only`"
            ),
        }
    }
}

impl std::error::Error for HardwareError {}
