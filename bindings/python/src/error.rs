//! Converts Rust errors to Python exceptions of `sapwise._errors`.

use pyo3::prelude::*;
use pyo3::types::PyTuple;
use sapwise::Error;
use sapwise::error::BoxDefect;

/// Makes an instance of a class of `sapwise._errors`.
fn instance<'py>(py: Python<'py>, class: &str, arguments: impl pyo3::call::PyCallArgs<'py>) -> PyErr {
    let made = py.import("sapwise._errors").and_then(|m| m.getattr(class)).and_then(|class| class.call1(arguments));
    made.map_or_else(|why| why, PyErr::from_value)
}

/// Makes the exception for an unusable argument, a `ValueError`.
pub(crate) fn unusable(py: Python<'_>, text: impl Into<String>) -> PyErr {
    instance(py, "InputError", (text.into(),))
}

/// Makes the exception for a failure that is no fault of the arguments.
pub(crate) fn failed(py: Python<'_>, text: impl Into<String>) -> PyErr {
    instance(py, "SapwiseError", (text.into(),))
}

/// Makes the exception for an invalid box.
pub(crate) fn invalid_box(py: Python<'_>, which: &str, index: usize, defect: BoxDefect) -> PyErr {
    instance(py, "InvalidBoxError", (format!("box {index}{which} {defect}; correct it or leave it out"), index))
}

/// Makes the exception for an error of a frame of the boxes `which`.
pub(crate) fn exception(py: Python<'_>, error: &Error, which: &str) -> PyErr {
    match *error {
        Error::InvalidBox { index, defect } => invalid_box(py, which, index, defect),
        Error::TooManyObjects { .. } | Error::MissingId { .. } | Error::UnknownAlgorithm { .. } => {
            unusable(py, error.to_string())
        }
        Error::TooManyPairs { limit } => {
            let text = format!(
                "more pairs overlap than the limit of {limit}; raise it with `limit=`, at about 30 bytes of memory a \
                 pair, \
                 or thin out the scene"
            );
            instance(py, "TooManyPairsError", (text, limit))
        }
        Error::OutOfMemory { .. } => pyo3::exceptions::PyMemoryError::new_err(error.to_string()),
        _ => failed(py, error.to_string()),
    }
}

/// Returns an error and its cause in one line.
pub(crate) fn with_cause(error: &dyn std::error::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |source| format!("{error}: {source}"))
}

/// Calls a function of a module of the package.
pub(crate) fn call<'py>(
    py: Python<'py>,
    module: &str,
    function: &str,
    arguments: impl pyo3::call::PyCallArgs<'py>,
) -> PyResult<Bound<'py, PyAny>> {
    py.import(module)?.getattr(function)?.call1(arguments)
}

/// Returns both elements of a tuple.
pub(crate) fn two<'py>(of: &Bound<'py, PyTuple>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    Ok((of.get_item(0)?, of.get_item(1)?))
}
