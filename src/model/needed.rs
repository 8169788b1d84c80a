//! Hardware parameters that a prediction can't do without.

use super::PredictError;
use crate::hardware::{GpuHardware, GpuParameterId, Hardware, Parameter, ParameterId};

/// A parameter of the machine, above zero.
///
/// # Errors
/// Names the parameter that is missing, zero, below or not finite.
pub(super) fn needed(hardware: &Hardware, id: ParameterId) -> Result<f64, PredictError> {
    above_zero(&hardware.parameters, id.as_str(), "")
}

/// A parameter of one GPU, above zero.
///
/// # Errors
/// As [`needed`], with the GPU's index.
pub(super) fn needed_of_gpu(gpu: &GpuHardware, id: GpuParameterId) -> Result<f64, PredictError> {
    above_zero(&gpu.parameters, id.as_str(), &format!(" of gpu{}", gpu.gpu.index))
}

/// A figure of a list; `of` says whose it is.
fn above_zero(list: &[Parameter], name: &str, of: &str) -> Result<f64, PredictError> {
    let parameter = || format!("{name}{of}");
    match Parameter::find(list, name) {
        Some(&Parameter { value: Some(value), .. }) if value > 0.0 && value.is_finite() => Ok(value),
        Some(&Parameter { value: Some(value), .. }) => Err(PredictError::Value { parameter: parameter(), value }),
        Some(missing) => Err(PredictError::Missing { parameter: parameter(), why: Some(missing.source.clone()) }),
        None => Err(PredictError::Missing { parameter: parameter(), why: None }),
    }
}
