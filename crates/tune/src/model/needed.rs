//! Hardware parameters that a prediction needs.

use super::PredictError;
use crate::hardware::{GpuHardware, GpuParameterId, Hardware, Parameter, ParameterId};

/// Returns a parameter of the machine.
///
/// # Errors
/// Names the parameter if it is missing, zero, negative or not finite.
pub(super) fn needed(hardware: &Hardware, id: ParameterId) -> Result<f64, PredictError> {
    above_zero(&hardware.parameters, id.as_str(), "")
}

/// Returns a parameter of one GPU.
///
/// # Errors
/// As [`needed`], with the GPU's number.
pub(super) fn needed_of_gpu(gpu: &GpuHardware, id: GpuParameterId) -> Result<f64, PredictError> {
    above_zero(&gpu.parameters, id.as_str(), &format!(" of gpu{}", gpu.gpu.index))
}

fn above_zero(list: &[Parameter], name: &str, of: &str) -> Result<f64, PredictError> {
    let parameter = || format!("{name}{of}");
    let Some(found) = Parameter::find(list, name) else {
        return Err(PredictError::NotListed { parameter: parameter() });
    };
    match found.value {
        Some(value) if value > 0.0 && value.is_finite() => Ok(value),
        Some(value) => Err(PredictError::Value { parameter: parameter(), value }),
        None => Err(PredictError::Missing { parameter: parameter(), why: found.source.clone() }),
    }
}
