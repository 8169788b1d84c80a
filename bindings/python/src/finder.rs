//! The class `BroadPhase`.

use crate::boxes::boxes;
use crate::decision::PyDecision;
use crate::error::{call, exception, failed, unusable, with_cause};
use crate::frame::{Flat, Frames, Ids, Shared, State, locked};
use crate::one_shot::two_columns;
use crate::start::{self, Start};
use crate::tuning::PyTuning;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sapwise::Membership;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Finds the overlapping pairs of frames that follow each other.
///
/// In each frame it runs the algorithm that it expects to be fastest on this machine for these boxes, and learns from
/// the times of frames. Some algorithms keep work from frame to frame. As a context manager it saves what it has
/// learned when the block ends.
///
/// Parameters
/// ----------
/// cache : path, False or None
///     The folder of the saved tuning of this machine, False for none, None for the user's cache folder.
/// measure : bool, default True
///     Whether the hardware may be measured, for about two seconds, where no tuning is kept. Otherwise built-in
///     thresholds decide.
/// background : bool, default True
///     Whether that happens on a thread of its own, while built-in thresholds decide. False waits here.
/// tuning : Tuning, optional
///     A tuning to use in place of all that.
/// algorithm : str, optional
///     Always run this algorithm, for instance ``"bvh@cpu1"``.
/// threads : int, optional
///     The most threads. By default all cores that this process may use.
/// learning, exploring : bool, default True
///     Whether the times of frames correct the expected costs, and whether it tries other algorithms now and then.
/// ordered : bool, default True
///     Whether the pairs of a frame are sorted.
/// limit : int, optional
///     The most pairs of a frame, as in ``pairs``.
///
/// Raises
/// ------
/// InputError
///     An argument can't be used.
/// SapwiseError
///     No algorithm can run.
///
/// Notes
/// -----
/// Several threads may use it: a call waits until the previous one has ended, without the interpreter's
/// lock. After a fork the child starts anew with the same arguments, the same filter and its own threads.
///
/// Examples
/// --------
/// >>> import numpy as np, sapwise
/// >>> boxes = np.array([[0, 0, 0, 1, 1, 1], [1.5, 0, 0, 2.5, 1, 1]], dtype=np.float32)
/// >>> with sapwise.BroadPhase(cache=False, measure=False) as broad_phase:
/// ...     for frame in range(3):
/// ...         pairs = broad_phase.find(boxes)
/// ...         print(len(pairs), len(broad_phase.begun), len(broad_phase.ended))
/// ...         boxes[1, [0, 3]] -= np.float32(0.5)
/// 0 0 0
/// 1 1 0
/// 1 0 0
#[pyclass(frozen, name = "BroadPhase", module = "sapwise")]
pub(crate) struct PyBroadPhase {
    start: Start,
    state: Mutex<State>,
}

impl PyBroadPhase {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the frames, made anew after a fork, and the filter.
    fn shared(&self, py: Python<'_>) -> PyResult<(Shared, Option<Arc<Vec<Membership>>>)> {
        let pid = std::process::id();
        let state = self.state();
        let Some(frames) = &state.frames else {
            return Err(failed(py, "this BroadPhase is closed; make another one"));
        };
        if state.pid == pid {
            return Ok((Arc::clone(frames), state.filter.clone()));
        }
        // After a fork this process has one thread.
        drop(state);
        let made = Arc::new(Mutex::new(Frames::new(start::adaptive(py, &self.start)?, &self.start)));
        let mut state = self.state();
        std::mem::forget(state.frames.replace(Arc::clone(&made)));
        state.pid = pid;
        Ok((made, state.filter.clone()))
    }

    /// Runs `what` on the frames, without the interpreter's lock.
    fn with<T: Send>(&self, py: Python<'_>, what: impl FnOnce(&mut Frames) -> T + Send) -> PyResult<T> {
        let (frames, _) = self.shared(py)?;
        Ok(py.detach(|| what(&mut locked(&frames))))
    }

    fn changed<'py>(&self, py: Python<'py>, begun: bool) -> PyResult<Bound<'py, PyAny>> {
        let found = self.with(py, |frames| frames.changed(begun))?;
        Ok(match found.map_err(|error| exception(py, &error, ""))? {
            Flat::Positions(numbers) => two_columns(py, numbers)?.into_any(),
            Flat::Given(ids) => two_columns(py, ids)?.into_any(),
        })
    }
}

#[pymethods]
impl PyBroadPhase {
    #[new]
    #[pyo3(signature = (
        *, cache=None, measure=true, background=true, tuning=None, algorithm=None, threads=None,
        learning=true, exploring=true, ordered=true, limit=None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn new(
        py: Python<'_>,
        cache: Option<&Bound<'_, PyAny>>,
        measure: bool,
        background: bool,
        tuning: Option<&PyTuning>,
        algorithm: Option<String>,
        threads: Option<u32>,
        learning: bool,
        exploring: bool,
        ordered: bool,
        limit: Option<usize>,
    ) -> PyResult<Self> {
        if threads == Some(0) {
            return Err(unusable(py, "threads is 0; give 1 or more, or None for all usable cores"));
        }
        if algorithm.is_some() && tuning.is_some() {
            return Err(unusable(py, "algorithm and tuning exclude each other; give one of them"));
        }
        let mut options = start::options(cache)?.background(background);
        if !measure {
            options = options.measure(None);
        }
        let no_cache = matches!(cache.map(|c| c.extract::<bool>()), Some(Ok(false)));
        let keeps = algorithm.is_none() && tuning.is_none() && !no_cache;
        let tuning = tuning.map(|t| t.tuning.clone());
        let order = start::order(ordered);
        let start = Start { options, keeps, learning, exploring, threads, algorithm, tuning, order, limit };
        let frames = Frames::new(start::adaptive(py, &start)?, &start);
        let frames = Some(Arc::new(Mutex::new(frames)));
        Ok(Self { start, state: Mutex::new(State { pid: std::process::id(), frames, filter: None }) })
    }

    /// Find the pairs of the next frame.
    ///
    /// Parameters
    /// ----------
    /// boxes : array_like, shape (n, 6) or (n, 2, 3)
    ///     One box a row: minx, miny, minz, maxx, maxy, maxz, in any unit of length. With ``upper``: the lower corners,
    ///     shape (n, 3).
    /// upper : array_like, shape (n, 3), optional
    ///     The upper corners.
    /// ids : array_like of int, shape (n,), optional
    ///     An id for each box, if boxes change their positions: ``begun`` and ``ended`` then hold ids. Boxes with the
    ///     same id count as one there. Give ids in each frame or in none.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (m, 2), uint32
    ///     Positions of the two boxes of each pair in this frame, the lower one first.
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
    /// After an error nothing has begun or ended, and the next frame is compared with the last one that
    /// succeeded. ``pairs`` says which input is copied. Ctrl-C works before and after a frame, not within.
    #[pyo3(signature = (boxes, upper=None, *, ids=None))]
    fn find<'py>(
        &self,
        boxes: &Bound<'py, PyAny>,
        upper: Option<&Bound<'py, PyAny>>,
        ids: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let py = boxes.py();
        let given = self::boxes(boxes, upper, "")?;
        let boxes = given.as_slice()?;
        let ids = match ids {
            None => Ids::Positions,
            Some(ids) => {
                let ids = call(py, "sapwise._arrays", "ids", (ids, boxes.len()))?;
                Ids::Given(ids.cast::<PyArray1<i64>>()?.to_vec()?)
            }
        };
        py.check_signals()?;
        let (frames, filter) = self.shared(py)?;
        if let Some(filter) = filter.as_ref().filter(|f| f.len() != boxes.len()) {
            let text = format!(
                "the filter is for {} boxes and there are {}; call set_filter with one entry a box, \
                 or without arguments to lift it",
                filter.len(),
                boxes.len()
            );
            return Err(unusable(py, text));
        }
        let found = py.detach(|| {
            let mut frames = locked(&frames);
            if frames.has_other_ids(&ids) {
                return None;
            }
            Some(frames.find(boxes, ids, filter.as_ref()))
        });
        py.check_signals()?;
        match found {
            None => Err(unusable(
                py,
                "only one of two consecutive frames has ids; give them for each frame or for none, \
                 or make a new BroadPhase",
            )),
            Some(found) => two_columns(py, found.map_err(|error| exception(py, &error, ""))?),
        }
    }

    /// Set which boxes may be a pair, from the next frame on. Without arguments every two may.
    ///
    /// Two boxes are a pair only if each has a group that is in the mask of the other, and if not both are fixed.
    ///
    /// Parameters
    /// ----------
    /// groups, masks : array_like of int, shape (n,), optional
    ///     One bit a group, 32 bits. By default a box is in every group, and its mask allows every group.
    /// fixed : array_like of bool, shape (n,), optional
    ///     Which boxes never move. Two fixed boxes are no pair.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     The lengths differ, or a number does not fit into 32 bits. ``find`` raises it if it gets more or fewer
    ///     boxes.
    #[pyo3(signature = (*, groups=None, masks=None, fixed=None))]
    fn set_filter(
        &self,
        py: Python<'_>,
        groups: Option<&Bound<'_, PyAny>>,
        masks: Option<&Bound<'_, PyAny>>,
        fixed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let filter = if groups.is_none() && masks.is_none() && fixed.is_none() {
            None
        } else {
            type Columns<'py> = (Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<bool>>);
            let columns = call(py, "sapwise._arrays", "memberships", (groups, masks, fixed))?;
            let (groups, masks, fixed): Columns<'_> = columns.extract()?;
            let (groups, masks, fixed) = (groups.to_vec()?, masks.to_vec()?, fixed.to_vec()?);
            let each = groups.into_iter().zip(masks).zip(fixed);
            Some(Arc::new(each.map(|((groups, mask), fixed)| Membership { groups, mask, fixed, owner: 0 }).collect()))
        };
        // Raises if it is closed.
        self.shared(py)?;
        self.state().filter = filter;
        Ok(())
    }

    /// ndarray, shape (k, 2): the pairs of the last frame that the previous one did not have, sorted; ids (int64) if
    /// the frames have ids.
    #[getter]
    fn begun<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.changed(py, true)
    }

    /// ndarray, shape (k, 2): the pairs of the previous frame that the last one does not have, sorted.
    #[getter]
    fn ended<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.changed(py, false)
    }

    /// Decision or None: what was decided for the last frame, and why; None before the first.
    #[getter]
    fn last_decision(&self, py: Python<'_>) -> PyResult<Option<PyDecision>> {
        self.with(py, |frames| frames.adaptive.last_decision().map(PyDecision::from))
    }

    /// Tuning: the expected cost of each algorithm, corrected by what was learned.
    #[getter]
    fn tuning(&self, py: Python<'_>) -> PyResult<PyTuning> {
        self.with(py, |frames| PyTuning::from(frames.adaptive.learned()))
    }

    /// dict: where the tuning came from (``origin``), ``remarks`` on what went wrong, ``seconds``, the ``file`` of
    /// the cache.
    #[getter]
    fn setup<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let setup = self.with(py, |frames| frames.adaptive.setup().clone())?;
        crate::tuning::setup(py, &setup)
    }

    /// Keep what was learned for the next start on this machine.
    ///
    /// Returns
    /// -------
    /// bool
    ///     False if there is nothing to keep yet.
    ///
    /// Raises
    /// ------
    /// SapwiseError
    ///     There is no cache, or it can't be written.
    fn save(&self, py: Python<'_>) -> PyResult<bool> {
        let saved = self.with(py, |frames| frames.adaptive.save())?;
        let saved = saved.map_err(|error| failed(py, with_cause(&error)))?;
        if saved {
            crate::one_shot::start_again(py);
        }
        Ok(saved)
    }

    /// End its threads and free its memory. It can't be used afterwards. Closing it twice does nothing.
    fn close(&self, py: Python<'_>) {
        let (frames, foreign) = {
            let mut state = self.state();
            (state.frames.take(), state.pid != std::process::id())
        };
        if foreign {
            std::mem::forget(frames);
        } else {
            py.detach(|| drop(frames));
        }
    }

    /// bool: whether it was closed.
    #[getter]
    fn closed(&self) -> bool {
        self.state().frames.is_none()
    }

    fn __enter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    #[pyo3(signature = (kind, value, trace))]
    fn __exit__(
        &self,
        py: Python<'_>,
        kind: Option<&Bound<'_, PyAny>>,
        value: Option<&Bound<'_, PyAny>>,
        trace: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<bool> {
        let _ = (kind, value, trace);
        if !self.closed() {
            let saved = if self.start.keeps { self.save(py).err() } else { None };
            self.close(py);
            if let Some(why) = saved {
                // What the block raised matters more than a cache that can't be written.
                call(py, "sapwise._errors", "warn_unsaved", (why.value(py).to_string(),))?;
            }
        }
        Ok(false)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        if self.closed() {
            return Ok("<sapwise.BroadPhase, closed>".to_owned());
        }
        let last = self.last_decision(py)?;
        Ok(last.map_or_else(
            || "<sapwise.BroadPhase, no frame yet>".to_owned(),
            |decision| format!("<sapwise.BroadPhase: {}>", decision.sentence),
        ))
    }
}
