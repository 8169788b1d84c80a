//! Converts Rust errors to Python exceptions of `sapwise._errors`.

use pyo3::prelude::*;
use sapwise::Error;
use sapwise::error::{BoxDefect, RayDefect, Unavailable};
use sapwise_tune::json;

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

/// Makes the exception for an invalid ray, motion or point. `what` says which.
pub(crate) fn invalid_ray(py: Python<'_>, what: &str, index: usize, defect: RayDefect) -> PyErr {
    instance(py, "InvalidRayError", (format!("{what} {index} {defect}; correct it or leave it out"), index))
}

/// Makes the exception for a handle that names no body.
pub(crate) fn stale(py: Python<'_>, index: usize, bits: u64) -> PyErr {
    let text = format!(
        "handle {bits} at position {index} names no body of this space: it was removed, or is of another space; \
         `handle in space` tells"
    );
    instance(py, "StaleHandleError", (text, index))
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
                 pair, or thin out the scene"
            );
            instance(py, "TooManyPairsError", (text, limit))
        }
        Error::Unavailable { ref algorithm, reason: Unavailable::TooFewCores { threads, most } } => {
            let fix = "raise `threads=` up to the cores of this machine, or name an algorithm with fewer";
            failed(py, format!("{algorithm} needs {threads} threads, and {most} may be used; {fix}"))
        }
        Error::OutOfMemory { what, elements } => pyo3::exceptions::PyMemoryError::new_err(format!(
            "no memory for {elements} {what}; bound the pairs with `limit=`, or give fewer boxes"
        )),
        Error::NoAlgorithm => failed(py, "the tuning names no algorithm; make one with `sapwise.predict()`"),
        _ => failed(py, error.to_string()),
    }
}

/// Returns an error and its cause in one line.
pub(crate) fn with_cause(error: &dyn std::error::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |source| format!("{error}: {source}"))
}

/// Converts JSON to what Python has for it.
pub(crate) fn parsed<'py>(py: Python<'py>, text: Result<String, json::Error>) -> PyResult<Bound<'py, PyAny>> {
    call(py, "json", "loads", (text.map_err(|why| failed(py, with_cause(&why)))?,))
}

/// Calls a function of a module.
pub(crate) fn call<'py>(
    py: Python<'py>,
    module: &str,
    function: &str,
    arguments: impl pyo3::call::PyCallArgs<'py>,
) -> PyResult<Bound<'py, PyAny>> {
    py.import(module)?.getattr(function)?.call1(arguments)
}
