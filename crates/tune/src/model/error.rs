//! Why a model can't predict.

use crate::hardware::HardwareError;
use sapwise::error::CurveError;

sapwise::described! {
    /// Why a model can't predict a cost. A parameter is named with the GPU that it is of.
    #[derive(Debug, Clone, PartialEq)]
    #[non_exhaustive]
    pub enum PredictError {
        /// A parameter that is not listed.
        NotListed {
            /// The parameter.
            parameter: String,
        } = "the parameter {parameter} is missing; measure it with `sapwise probe --hardware-only`",
        /// A parameter that is listed without a value.
        Missing {
            /// The parameter.
            parameter: String,
            /// Why, as the hardware says.
            why: String,
        } = "the parameter {parameter} is missing: {why}",
        /// A parameter whose value is zero, negative or not finite.
        Value {
            /// The parameter.
            parameter: String,
            /// Its value.
            value: f64,
        } = "the parameter {parameter} is {value}; it must be above zero",
        /// A GPU that the hardware does not hold.
        NoGpu {
            /// Its number.
            index: u32,
        } = "the hardware holds no gpu{index}; see `sapwise devices`, then measure again",
        /// A scale of the model that this processor does not have.
        NotOfProcessor {
            /// The processor.
            backend: String,
            /// The scale.
            what: String,
        } = "{backend} has no {what}",
        /// A fallback that the model does not hold.
        NoMethod {
            /// Its name.
            method: String,
        } = "the model holds no {method}, to which it falls back",
        /// A value that no machine has.
        Hardware(error: HardwareError) = "{error}",
        /// An impossible cost curve.
        Curve(error: CurveError) = "{error}",
        /// None of the algorithms can be predicted.
        Nothing {
            /// Name of the model.
            model: String,
            /// Why each was left out.
            warnings: String,
        } = "the model {model} predicts none of these algorithms: {warnings}",
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
