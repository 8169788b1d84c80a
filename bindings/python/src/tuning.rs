//! `predict` and the class `Tuning`.

use crate::error::parsed;
use crate::{boxes, exception, failed, start, unusable, with_cause};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use sapwise::algorithm::{Load, Motion};
use sapwise::{Aabb, Error, Tuning};
use sapwise_tune::{Setup, json};
use std::thread;
use std::time::Duration;

/// Interval of the checks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(5);

/// The expected cost of each algorithm on a machine.
///
/// Attributes
/// ----------
/// source : str
///     ``"default"`` (built-in thresholds), ``"predicted"``, ``"measured"`` or ``"learned"``.
/// model : str or None
///     The model that predicted it.
/// extrapolated : bool
///     Whether the machine lies outside the training data of the model; ``warnings`` say how.
/// scenario : str
///     The scenario of ``fields`` and ``crossovers``.
/// algorithms : list of str
///     The algorithms to choose from.
/// fields : list of (int, str)
///     From each number of boxes on, the cheapest algorithm in that scenario.
/// crossovers : list of dict
///     ``below``, ``above``: two algorithms; ``objects``: the number of boxes at which both cost the same; ``low``,
///     ``high``: the ends of the 90 % interval, or None.
/// setup : dict or None
///     How a prediction came about.
#[pyclass(frozen, name = "Tuning", module = "sapwise")]
pub(crate) struct PyTuning {
    pub(crate) tuning: Tuning,
    setup: Option<Setup>,
}

impl From<Tuning> for PyTuning {
    fn from(tuning: Tuning) -> Self {
        Self { tuning, setup: None }
    }
}

/// The share of boxes that move by more than a tenth of an edge: as given, or as if all moved by `moved`.
fn share(moved: f64, given: Option<f64>) -> f64 {
    given.unwrap_or(if moved > 0.1 { 1.0 } else { 0.0 })
}

#[pymethods]
impl PyTuning {
    #[getter]
    fn source(&self) -> String {
        self.tuning.source.to_string()
    }

    #[getter]
    fn model(&self) -> Option<&str> {
        self.tuning.model.as_deref()
    }

    #[getter]
    fn extrapolated(&self) -> bool {
        self.tuning.extrapolated
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.tuning.warnings.clone()
    }

    #[getter]
    fn scenario(&self) -> &str {
        &self.tuning.scenario
    }

    #[getter]
    fn algorithms(&self) -> Vec<String> {
        self.tuning.algorithms().into_iter().map(ToString::to_string).collect()
    }

    #[getter]
    fn fields(&self) -> Vec<(u32, String)> {
        self.tuning.steps.iter().map(|step| (step.from_objects, step.algorithm.to_string())).collect()
    }

    #[getter]
    fn crossovers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        parsed(py, json::write(&self.tuning.crossovers))
    }

    #[getter]
    fn setup<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.setup.as_ref().map(|of| setup(py, of)).transpose()
    }

    /// Tell what a frame costs with each algorithm.
    ///
    /// Parameters
    /// ----------
    /// objects : int
    ///     Boxes of the frame.
    /// pairs : float, default 0.0
    ///     Overlapping pairs.
    /// axis_candidates, strip_candidates : float, optional
    ///     Pairs that overlap on the axis on which the fewest do, and those of them that share a strip of the grid.
    /// moved : float, default 1.0
    ///     Motion of the boxes in a frame, in mean edges; 1 if no frame helps with the next.
    /// moved_share : float, optional
    ///     Share of the boxes that move by more than a tenth of an edge. By default as if all moved by ``moved``.
    ///
    /// Returns
    /// -------
    /// dict of str to float
    ///     Nanoseconds of each algorithm, the cheapest first. Empty for built-in thresholds, which know no costs.
    #[pyo3(signature = (
        objects, *, pairs=0.0, axis_candidates=None, strip_candidates=None, moved=1.0, moved_share=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn costs<'py>(
        &self,
        py: Python<'py>,
        objects: u32,
        pairs: f64,
        axis_candidates: Option<f64>,
        strip_candidates: Option<f64>,
        moved: f64,
        moved_share: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let axis = axis_candidates.unwrap_or(pairs);
        let load =
            Load::of_objects(objects).with_pairs(pairs).with_moved(moved).with_moved_share(share(moved, moved_share));
        self.of(py, load.with_candidates(axis, strip_candidates.unwrap_or(axis)))
    }

    /// Tell what a frame of these boxes costs with each algorithm, by the load estimated from a few hundred of them.
    ///
    /// Parameters
    /// ----------
    /// boxes : array_like, shape (n, 6) or (n, 2, 3)
    ///     One box a row: minx, miny, minz, maxx, maxy, maxz, in any unit of length. With ``upper``: the lower corners,
    ///     shape (n, 3).
    /// upper : array_like, shape (n, 3), optional
    ///     The upper corners.
    /// moved : float, default 1.0
    ///     Motion of the boxes in a frame, in mean edges.
    /// moved_share : float, optional
    ///     Share of the boxes that move by more than a tenth of an edge. By default as if all moved by ``moved``.
    ///
    /// Returns
    /// -------
    /// dict of str to float
    ///     Nanoseconds of each algorithm, the cheapest first.
    #[pyo3(signature = (boxes, upper=None, *, moved=1.0, moved_share=None))]
    fn costs_of<'py>(
        &self,
        boxes: &Bound<'py, PyAny>,
        upper: Option<&Bound<'py, PyAny>>,
        moved: f64,
        moved_share: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let py = boxes.py();
        let given = self::boxes(boxes, upper, "")?;
        let boxes = given.as_slice()?;
        Aabb::check(boxes, 0).map_err(|error| exception(py, &error, ""))?;
        let moved_share = share(moved, moved_share);
        self.of(py, py.detach(|| Load::estimate(boxes, None, Some(Motion { moved, moved_share }))))
    }

    /// Write it as JSON (``tuning/3``), which the library and the command read.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        json::write_tuning(&self.tuning).map_err(|why| failed(py, with_cause(&why)))
    }

    /// Read what ``to_json`` or ``sapwise predict --out tuning.json`` has written.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
        json::tuning(text).map(Self::from).map_err(|why| unusable(py, with_cause(&why)))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((py.get_type::<Self>().getattr("from_json")?, (self.to_json(py)?,)))
    }

    fn __repr__(&self) -> String {
        let fields: Vec<String> =
            self.tuning.steps.iter().map(|step| format!("{} from {}", step.algorithm, step.from_objects)).collect();
        format!("<sapwise.Tuning, {}: {}>", self.tuning.source, fields.join(", "))
    }
}

impl PyTuning {
    /// Returns the cost of each algorithm under a load, in nanoseconds, the cheapest first.
    fn of<'py>(&self, py: Python<'py>, load: Load) -> PyResult<Bound<'py, PyDict>> {
        if !load.is_sound() {
            return Err(unusable(py, format!("{load:?} is negative or not finite; give finite numbers, 0 or more")));
        }
        let cost = |c: &sapwise::tuning::AlgorithmCost| (c.algorithm.to_string(), c.curve.cost_ns(&load));
        let mut costs: Vec<(String, f64)> = self.tuning.costs.iter().map(cost).collect();
        costs.sort_by(|a, b| a.1.total_cmp(&b.1));
        costs.into_py_dict(py)
    }
}

/// Converts a setup to a dict.
pub(crate) fn setup<'py>(py: Python<'py>, setup: &Setup) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("origin", format!("{:?}", setup.origin).to_lowercase())?;
    dict.set_item("remarks", &setup.remarks)?;
    dict.set_item("seconds", setup.seconds)?;
    dict.set_item("file", setup.file.as_ref().map(|file| file.to_string_lossy().into_owned()))?;
    Ok(dict)
}

/// Predict the tuning of this machine from its hardware.
///
/// Returns the saved tuning of this machine. If there is none, measures the hardware, predicts with the built-in model,
/// and saves the tuning for ``pairs`` and ``BroadPhase``. Measure on a quiet machine.
///
/// Parameters
/// ----------
/// cache : path, False or None
///     The folder of the saved tuning, False for none, None for the user's cache folder.
/// seconds : float, default 2.0
///     Time limit of the measurement.
///
/// Returns
/// -------
/// Tuning
///
/// Raises
/// ------
/// KeyboardInterrupt
///     At once on Ctrl-C; the measurement itself ends within the seconds.
/// SapwiseError
///     No algorithm can run.
#[pyfunction]
#[pyo3(signature = (*, cache=None, seconds=2.0))]
pub(crate) fn predict(py: Python<'_>, cache: Option<&Bound<'_, PyAny>>, seconds: f64) -> PyResult<PyTuning> {
    let limit = Duration::try_from_secs_f64(seconds)
        .map_err(|_| unusable(py, format!("seconds is {seconds}; give seconds, 0 or more and finite")))?;
    let options = start::options(cache)?.background(false).measure(Some(limit));
    // On a thread, so that Ctrl-C is seen meanwhile. The thread ends by itself, within the seconds.
    let thread = thread::Builder::new().name("sapwise-predict".to_owned());
    let work = move || {
        let made = sapwise_tune::for_this_machine(&options)?;
        Ok::<_, Error>((made.tuning().clone(), made.setup().clone()))
    };
    let thread = thread.spawn(work).map_err(|why| failed(py, format!("no thread can be started: {why}")))?;
    while !thread.is_finished() {
        py.check_signals()?;
        py.detach(|| thread::sleep(LOOK));
    }
    let made = thread.join().map_err(|_| failed(py, "the measurement ended without a result; please report it"))?;
    let (tuning, setup) = made.map_err(|error| failed(py, error.to_string()))?;
    crate::engine::start_again(py);
    Ok(PyTuning { tuning, setup: Some(setup) })
}
