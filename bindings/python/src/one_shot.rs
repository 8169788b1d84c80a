//! `pairs` and `pairs_between`: each call stands for itself.

use crate::boxes::boxes;
use crate::decision::PyDecision;
use crate::error::{exception, unusable};
use crate::start;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;
use sapwise::tuning::Step;
use sapwise::{Adaptive, AlgorithmId, Between, BroadPhase, Error, PairOrder, Pairs, Registry, Tuning};
use sapwise_tune::StartOptions;
use std::sync::{Arc, Mutex, PoisonError};

/// The method that keeps work from frame to frame: of no use here.
const INCREMENTAL: &str = "pair-cache";

/// Built-in thresholds, in boxes, for an unknown machine: `grid-sap` replaces `brute` from the first on, and runs on
/// `k` threads from `k` squared times the second on. Rounded from `uniform` and `clustered` in `datasets/`.
const GRID_FROM: u32 = 300;
const THREADS_FROM: u32 = 2500;
const MOST_THREADS: u32 = 16;

/// Largest call whose buffers are kept for the next: a few hundred megabytes.
const MOST_BOXES_KEPT: usize = 2_000_000;
const MOST_PAIRS_KEPT: usize = 16_000_000;
/// Most engines that are kept: one for each of so many threads that call at once.
const MOST_KEPT: usize = 8;

/// What searches, with its lists of pairs, used by one call at a time.
struct Engine {
    adaptive: Adaptive,
    between: Between,
    /// The list in any order, and the one in canonical order.
    pairs: [Option<Pairs>; 2],
}

/// Engines that no call uses. Locked only by a thread with the interpreter's lock, and for an instant: no fork finds it
/// locked.
struct Idle {
    /// The process that made the engines. Their threads are not in a forked one.
    pid: u32,
    engines: Vec<Engine>,
}

static IDLE: Mutex<Idle> = Mutex::new(Idle { pid: 0, engines: Vec::new() });

fn idle<T>(_: Python<'_>, with: impl FnOnce(&mut Vec<Engine>) -> T) -> T {
    let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
    let pid = std::process::id();
    if idle.pid != pid {
        // After a fork. Dropping them would wait for threads that are not in this process.
        std::mem::forget(std::mem::take(&mut idle.engines));
        idle.pid = pid;
    }
    with(&mut idle.engines)
}

/// Drops the idle engines, so that later calls use the tuning that was saved since.
pub(crate) fn start_again(py: Python<'_>) {
    let engines = idle(py, std::mem::take);
    py.detach(|| drop(engines));
}

impl Engine {
    /// With the tuning that was kept of this machine, or with built-in thresholds. Nothing is measured.
    fn new() -> Result<Self, Error> {
        let registry = Arc::new(Registry::new());
        let options = StartOptions::new().background(false).measure(None).registry(Arc::clone(&registry));
        let mut tuning = sapwise_tune::for_this_machine(&options)?.tuning().clone();
        tuning.costs.retain(|cost| cost.algorithm.method() != INCREMENTAL);
        let mut adaptive = Adaptive::new(if tuning.costs.is_empty() { usual(&registry)? } else { tuning }, &registry)?;
        adaptive.set_exploring(false);
        Ok(Self { adaptive, between: Between::new(&registry)?, pairs: [None, None] })
    }

    /// Lets `find` search, and returns the pairs flat, as in NumPy. `from_second` is subtracted from the second member
    /// of each pair.
    fn find(
        &mut self,
        order: PairOrder,
        limit: Option<usize>,
        from_second: u32,
        find: impl FnOnce(&mut Adaptive, &mut Between, &mut Pairs) -> Result<(), Error>,
    ) -> Result<Vec<u32>, Error> {
        let Self { adaptive, between, pairs } = self;
        let pairs = pairs[usize::from(order == PairOrder::Canonical)].get_or_insert_with(|| start::pairs(order, None));
        let usual_limit = pairs.limit();
        if limit.is_some() {
            pairs.set_limit(limit);
        }
        let found = find(adaptive, between, pairs);
        pairs.set_limit(usual_limit);
        found?;
        flat(pairs, from_second)
    }

    fn is_small(&self) -> bool {
        self.pairs.iter().flatten().map(Pairs::len).sum::<usize>() <= MOST_PAIRS_KEPT
    }
}

/// Returns the built-in thresholds, without incremental algorithms.
fn usual(registry: &Registry) -> Result<Tuning, Error> {
    let known: Vec<AlgorithmId> = registry.available().into_iter().map(|entry| entry.id).collect();
    let step = |from: u32, method: &str, threads: u32| {
        let id = known.iter().find(|id| id.method() == method && id.threads() == threads)?;
        Some(Step::new(from, id.clone()))
    };
    let mut steps: Vec<Step> = step(0, "brute", 1).into_iter().chain(step(GRID_FROM, "grid-sap", 1)).collect();
    let mut widths: Vec<u32> =
        known.iter().map(AlgorithmId::threads).filter(|k| (2..=MOST_THREADS).contains(k)).collect();
    widths.sort_unstable();
    widths.dedup();
    steps.extend(widths.into_iter().filter_map(|k| step(THREADS_FROM * k * k, "grid-sap", k)));
    Tuning::from_steps(steps).map_err(|_| Error::NoAlgorithm)
}

/// Converts pairs to numbers, two each.
pub(crate) fn flat(pairs: &Pairs, from_second: u32) -> Result<Vec<u32>, Error> {
    let mut numbers = Vec::new();
    let refused = |_| Error::OutOfMemory { what: "pairs", elements: pairs.len() };
    numbers.try_reserve_exact(2 * pairs.len()).map_err(refused)?;
    numbers.extend(pairs.iter().flat_map(|&(a, b)| [a, b - from_second]));
    Ok(numbers)
}

/// Makes an array with two numbers a row.
pub(crate) fn two_columns<'py, T: numpy::Element>(
    py: Python<'py>,
    numbers: Vec<T>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let rows = Array2::from_shape_vec([numbers.len() / 2, 2], numbers);
    rows.map(|rows| rows.into_pyarray(py)).map_err(|why| unusable(py, why.to_string()))
}

/// Runs a call on an engine, without the interpreter's lock. Checks for Ctrl-C before and after.
fn with_engine<'py>(
    py: Python<'py>,
    objects: usize,
    find: impl FnOnce(&mut Engine) -> Result<Vec<u32>, Error> + Send,
    error: impl FnOnce(Error) -> PyErr,
) -> PyResult<Bound<'py, PyArray2<u32>>> {
    py.check_signals()?;
    let engine = idle(py, Vec::pop);
    let (found, engine) = py.detach(|| {
        let mut engine = match engine.map_or_else(Engine::new, Ok) {
            Ok(engine) => engine,
            Err(why) => return (Err(why), None),
        };
        let found = find(&mut engine);
        let kept = objects <= MOST_BOXES_KEPT && engine.is_small();
        (found, kept.then_some(engine))
    });
    if let Some(engine) = engine {
        let over = idle(py, |engines| {
            engines.push(engine);
            (engines.len() > MOST_KEPT).then(|| engines.remove(0))
        });
        py.detach(|| drop(over));
    }
    py.check_signals()?;
    two_columns(py, found.map_err(error)?)
}

/// Find all pairs of overlapping boxes.
///
/// Boxes are closed: those that touch overlap. Each call stands for itself. For consecutive frames use ``BroadPhase``,
/// which is faster there. Chooses the algorithm by the tuning of this machine that ``predict`` or ``BroadPhase`` has
/// saved, else by built-in thresholds. It measures nothing. ``last_decision`` returns the choice and its reason.
///
/// Parameters
/// ----------
/// boxes : array_like, shape (n, 6) or (n, 2, 3)
///     One box a row: minx, miny, minz, maxx, maxy, maxz, in any unit of length. With ``upper``: the lower corners,
///     shape (n, 3).
/// upper : array_like, shape (n, 3), optional
///     The upper corners.
/// ordered : bool, default True
///     Whether the pairs are sorted, by the first member and then the second: the same array from every machine. False
///     saves the sort.
/// limit : int, optional
///     The most pairs: with more, the search ends with an error. By default one pair for each 256 bytes of free memory
///     (Linux).
///
/// Returns
/// -------
/// ndarray, shape (m, 2), uint32
///     Positions of the two boxes of each pair, the lower one first. Each pair once.
///
/// Raises
/// ------
/// InvalidBoxError
///     A bound is NaN or a minimum lies above its maximum. ``index`` names the first such box. Infinite bounds are
///     legal.
/// InputError
///     The shape is wrong, or there are more boxes than 32 bits can name.
/// TypeError
///     The dtype can't be converted: bool, complex, object, text, long double.
/// TooManyPairsError
///     More pairs than ``limit``. ``limit`` of the exception has it.
///
/// Notes
/// -----
/// 32-bit floats of shape (n, 6) in C order are read in place; nothing may write to them meanwhile.
/// Everything else is copied. 64-bit floats are rounded to 32 bits: no pair is lost, and nearly touching boxes may gain
/// one. The interpreter's lock is released. Ctrl-C works before and after, not within.
///
/// Examples
/// --------
/// >>> import numpy as np, sapwise
/// >>> boxes = np.array([[0, 0, 0, 1, 1, 1], [1, 0, 0, 2, 1, 1], [5, 5, 5, 6, 6, 6]], dtype=np.float32)
/// >>> sapwise.pairs(boxes)
/// array([[0, 1]], dtype=uint32)
#[pyfunction]
#[pyo3(signature = (boxes, upper=None, *, ordered=true, limit=None))]
pub(crate) fn pairs<'py>(
    boxes: &Bound<'py, PyAny>,
    upper: Option<&Bound<'py, PyAny>>,
    ordered: bool,
    limit: Option<usize>,
) -> PyResult<Bound<'py, PyArray2<u32>>> {
    let py = boxes.py();
    let given = crate::boxes::boxes(boxes, upper, "")?;
    let boxes = given.as_slice()?;
    let find = |engine: &mut Engine| {
        engine.find(start::order(ordered), limit, 0, |adaptive, _, pairs| adaptive.find_pairs(boxes, pairs))
    };
    with_engine(py, boxes.len(), find, |error| exception(py, &error, ""))
}

/// Find all pairs of a box of ``a`` and an overlapping box of ``b``.
///
/// The shorter list is put into a tree, which is searched for each box of the longer one. Pairs within a list are not
/// searched.
///
/// Parameters
/// ----------
/// a : array_like, shape (n, 6) or (n, 2, 3)
///     One box a row: minx, miny, minz, maxx, maxy, maxz.
/// b : array_like, shape (k, 6) or (k, 2, 3)
///     The other boxes.
/// ordered : bool, default True
///     Whether the pairs are sorted, by the first member and then the second.
/// limit : int, optional
///     The most pairs, as in ``pairs``.
///
/// Returns
/// -------
/// ndarray, shape (m, 2), uint32
///     The position in ``a`` and the position in ``b`` of each pair.
///
/// Raises
/// ------
/// InvalidBoxError
///     A bound is NaN or a minimum lies above its maximum. ``index`` names the first such box. Infinite bounds are
///     legal.
/// InputError
///     The shape is wrong, or there are more boxes than 32 bits can name.
/// TypeError
///     The dtype can't be converted: bool, complex, object, text, long double.
/// TooManyPairsError
///     More pairs than ``limit``. ``limit`` of the exception has it.
///
/// Examples
/// --------
/// >>> sapwise.pairs_between([[0, 0, 0, 1, 1, 1]], [[9, 9, 9, 10, 10, 10], [1, 1, 1, 2, 2, 2]])
/// array([[0, 1]], dtype=uint32)
#[pyfunction]
#[pyo3(signature = (a, b, *, ordered=true, limit=None))]
pub(crate) fn pairs_between<'py>(
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
    ordered: bool,
    limit: Option<usize>,
) -> PyResult<Bound<'py, PyArray2<u32>>> {
    let py = a.py();
    let (a, b) = (boxes(a, None, " of a")?, boxes(b, None, " of b")?);
    let (a, b) = (a.as_slice()?, b.as_slice()?);
    let first = a.len();
    let objects = first + b.len();
    let Ok(from_second) = u32::try_from(objects).map(|_| first as u32) else {
        return Err(exception(py, &Error::TooManyObjects { objects }, ""));
    };
    let find = |engine: &mut Engine| {
        engine.find(start::order(ordered), limit, from_second, |_, between, pairs| between.find_pairs(a, b, pairs))
    };
    with_engine(py, objects, find, |error| match error {
        Error::InvalidBox { index, defect } if index < first => crate::error::invalid_box(py, " of a", index, defect),
        Error::InvalidBox { index, defect } => crate::error::invalid_box(py, " of b", index - first, defect),
        other => exception(py, &other, ""),
    })
}

/// Tell what the last call of ``pairs`` chose and why.
///
/// Returns
/// -------
/// Decision or None
///     None before the first call. With calls on several threads, that of the call which ended last.
#[pyfunction]
pub(crate) fn last_decision(py: Python<'_>) -> Option<PyDecision> {
    idle(py, |engines| engines.last().and_then(|engine| engine.adaptive.last_decision()).map(PyDecision::from))
}
