//! The class `Decision`.

use crate::error::parsed;
use pyo3::prelude::*;
use sapwise::Decision;
use sapwise::algorithm::Load;
use sapwise_tune::json;

/// What was decided for a frame, and why. ``str()`` of it is a sentence.
///
/// Attributes
/// ----------
/// algorithm : str
///     The algorithm that ran, for instance ``"grid-sap@cpu2"``: the method and its most threads. ``"between"`` or
///     ``"worlds"`` for the searches that have one algorithm.
/// reason : str
///     The reason, in words.
/// source : str
///     The source of the expected times: ``"default"`` (built-in thresholds), ``"predicted"``, ``"measured"`` or
///     ``"learned"``.
/// expected_ns : float or None
///     The expected time of the frame in nanoseconds; None if only the number of boxes decides.
/// measured_ns : float or None
///     The time of the frame in nanoseconds; None if it was not timed, like most very short frames.
/// runner_up : tuple of (str, float) or None
///     The next best algorithm and its expected time in nanoseconds.
/// load : dict
///     The estimated load of the frame: ``objects``, ``axis_candidates``, ``strip_candidates``, ``pairs``, ``moved``,
///     ``moved_share``.
#[pyclass(frozen, name = "Decision", module = "sapwise")]
#[derive(Clone)]
pub(crate) struct PyDecision {
    #[pyo3(get)]
    algorithm: String,
    #[pyo3(get)]
    reason: String,
    #[pyo3(get)]
    source: String,
    #[pyo3(get)]
    expected_ns: Option<f64>,
    #[pyo3(get)]
    measured_ns: Option<f64>,
    #[pyo3(get)]
    runner_up: Option<(String, f64)>,
    load: Load,
    pub(crate) sentence: String,
}

impl From<Decision<'_>> for PyDecision {
    fn from(decision: Decision<'_>) -> Self {
        Self {
            algorithm: decision.algorithm.to_string(),
            reason: decision.reason.to_string(),
            source: decision.source.to_string(),
            expected_ns: decision.predicted_ns,
            measured_ns: decision.measured_ns,
            runner_up: decision.runner_up.map(|(id, ns)| (id.to_string(), ns)),
            load: decision.load,
            sentence: decision.to_string(),
        }
    }
}

impl PyDecision {
    /// Makes the decision of a search that has one algorithm.
    pub(crate) fn alone(algorithm: &str, reason: &str, load: Load) -> Self {
        let Load { objects, pairs, .. } = load;
        Self {
            algorithm: algorithm.to_owned(),
            reason: reason.to_owned(),
            source: "default".to_owned(),
            expected_ns: None,
            measured_ns: None,
            runner_up: None,
            load,
            sentence: format!("{algorithm}, {reason}; {objects} boxes, {pairs} pairs"),
        }
    }
}

#[pymethods]
impl PyDecision {
    #[getter]
    fn load<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        parsed(py, json::write(&self.load))
    }

    fn __str__(&self) -> &str {
        &self.sentence
    }

    fn __repr__(&self) -> String {
        format!("<sapwise.Decision: {}>", self.sentence)
    }
}
