//! Why a model can't predict.

use crate::hardware::HardwareError;
use sapwise::error::CurveError;
use std::fmt;

/// Why a model can't predict a cost. A parameter is named with the GPU that it is of.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum PredictError {
    /// A parameter that is not listed, or is listed without a value.
    Missing {
        /// The parameter.
        parameter: String,
        /// Why, if the hardware says so.
        why: Option<String>,
    },
    /// A parameter whose value is zero, negative or not finite.
    Value {
        /// The parameter.
        parameter: String,
        /// Its value.
        value: f64,
    },
    /// A GPU that the hardware does not hold.
    NoGpu {
        /// Its number.
        index: u32,
    },
    /// A scale of the model that this processor does not have.
    NotOfProcessor {
        /// The processor.
        backend: String,
        /// The scale.
        what: String,
    },
    /// A fallback that the model does not hold.
    NoMethod {
        /// Its name.
        method: String,
    },
    /// A value that no machine has.
    Hardware(HardwareError),
    /// An impossible cost curve.
    Curve(CurveError),
    /// None of the algorithms can be predicted.
    Nothing {
        /// Name of the model.
        model: String,
        /// Why each was left out.
        warnings: Vec<String>,
    },
}

impl fmt::Display for PredictError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing { parameter, why: Some(why) } => write!(f, "the parameter {parameter} is missing: {why}"),
            Self::Missing { parameter, why: None } => {
                write!(f, "the parameter {parameter} is missing; measure it with `sapwise probe --hardware-only`")
            }
            Self::Value { parameter, value } => {
                write!(f, "the parameter {parameter} is {value}; it must be above zero")
            }
            Self::NoGpu { index } => {
                write!(f, "the hardware holds no gpu{index}; see `sapwise devices`, then measure again")
            }
            Self::NotOfProcessor { backend, what } => write!(f, "{backend} has no {what}"),
            Self::NoMethod { method } => write!(f, "the model holds no {method}, to which it falls back"),
            Self::Hardware(error) => error.fmt(f),
            Self::Curve(error) => error.fmt(f),
            Self::Nothing { model, warnings } => {
                write!(f, "the model {model} predicts none of these algorithms: {}", warnings.join("; "))
            }
        }
    }
}

impl std::error::Error for PredictError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Hardware(error) => Some(error),
            Self::Curve(error) => Some(error),
            _ => None,
        }
    }
}
