//! The class `BroadPhase`.

use crate::boxes::Boxes;
use crate::engine::two_columns;
use crate::frame::{Flat, Frames};
use crate::one_shot::integers;
use crate::{Held, Keywords, PyTuning, Start, boxes, exception, learning_methods, start, unusable};
use numpy::PyArray2;
use pyo3::prelude::*;
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
/// ...         print(len(pairs), len(broad_phase.begun()), len(broad_phase.ended()))
/// ...         boxes[1, [0, 3]] -= np.float32(0.5)
/// 0 0 0
/// 1 1 0
/// 1 0 0
#[pyclass(frozen, name = "BroadPhase", module = "sapwise")]
pub(crate) struct PyBroadPhase {
    frames: Held<Frames>,
    /// Locked only by a thread with the interpreter's lock, and for an instant.
    filter: Mutex<Option<Arc<Vec<Membership>>>>,
}

/// A frame that can be searched: its boxes, their ids and the filter.
type Ready<'py> = (Boxes<'py>, Option<Vec<i64>>, Option<Arc<Vec<Membership>>>);

impl PyBroadPhase {
    /// Checks what `find` got.
    fn ready<'py>(
        &self,
        boxes: &Bound<'py, PyAny>,
        upper: Option<&Bound<'py, PyAny>>,
        ids: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Ready<'py>> {
        let py = boxes.py();
        let given = self::boxes(boxes, upper, "")?;
        given.warn_if_rounded(py)?;
        let count = given.as_slice()?.len();
        let ids = integers(py, "ids", ids, count)?;
        py.check_signals()?;
        let filter = self.filter().clone();
        if let Some(filter) = filter.as_ref().filter(|f| f.len() != count) {
            let text = format!(
                "the filter is for {} boxes and there are {count}; call set_filter with one entry a box, or without \
                 arguments to lift it",
                filter.len(),
            );
            return Err(unusable(py, text));
        }
        Ok((given, ids, filter))
    }

    fn filter(&self) -> MutexGuard<'_, Option<Arc<Vec<Membership>>>> {
        self.filter.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn changed<'py>(&self, py: Python<'py>, begun: bool) -> PyResult<Bound<'py, PyAny>> {
        let found = self.frames.write(py, |frames| frames.changed(begun))?;
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
        #[pyo3(from_py_with = start::threads)] threads: Option<u32>,
        learning: bool,
        exploring: bool,
        ordered: bool,
        #[pyo3(from_py_with = start::limit)] limit: Option<usize>,
    ) -> PyResult<Self> {
        let start = Start { ordered, limit, ..Start::new(cache, measure, background, tuning, algorithm)? };
        let start = Start { learning, exploring, threads, ..start };
        let frames = Held::new(py, start, Frames::new)?;
        Ok(Self { frames, filter: Mutex::new(None) })
    }

    /// Find the pairs of the next frame.
    ///
    /// Parameters
    /// ----------
    /// boxes, upper : array_like
    ///     As in ``pairs``. 64-bit floats and integers are rounded outward: nearly touching boxes may be a pair.
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
    /// succeeded. ``pairs`` says which input is copied. Ctrl-C works before and after a frame, not within. A frame
    /// that was searched counts even if ``KeyboardInterrupt`` follows: ``begun`` and ``ended`` hold its changes, and
    /// the next frame is compared with it.
    #[pyo3(signature = (boxes, upper=None, *, ids=None))]
    fn find<'py>(
        &self,
        boxes: &Bound<'py, PyAny>,
        upper: Option<&Bound<'py, PyAny>>,
        ids: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let py = boxes.py();
        let ready = self.ready(boxes, upper, ids);
        if ready.is_err() {
            self.frames.write(py, Frames::fail)?;
        }
        let (given, ids, filter) = ready?;
        let boxes = given.as_slice()?;
        let found = self.frames.write(py, |frames| {
            if frames.has_other_ids(ids.is_some()) {
                frames.fail();
                return None;
            }
            Some(frames.find(boxes, ids, filter.as_ref()))
        })?;
        py.check_signals()?;
        let Some(found) = found else {
            let text = "only one of two consecutive frames has ids; give them for each frame or for none, or make a \
                        new BroadPhase";
            return Err(unusable(py, text));
        };
        two_columns(py, found.map_err(|error| exception(py, &error, ""))?)
    }

    /// Set which boxes may be a pair, from the next frame on. Without arguments every two may.
    ///
    /// Parameters
    /// ----------
    /// groups, masks, owner : array_like of int, optional
    /// fixed : array_like of bool, optional
    ///     As in ``pairs``.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     The lengths differ, or a number does not fit into 32 bits. ``find`` raises it if it gets more or fewer
    ///     boxes.
    #[pyo3(signature = (*, groups=None, masks=None, owner=None, fixed=None))]
    fn set_filter(
        &self,
        py: Python<'_>,
        groups: Option<&Bound<'_, PyAny>>,
        masks: Option<&Bound<'_, PyAny>>,
        owner: Option<&Bound<'_, PyAny>>,
        fixed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let filter = Keywords { groups, masks, owner, fixed }.memberships(py, None::<usize>)?;
        // Raises if it is closed.
        self.frames.shared(py)?;
        *self.filter() = filter.map(Arc::new);
        Ok(())
    }

    /// Return the pairs of the last frame that the previous one did not have, sorted: ndarray, shape (k, 2), of ids
    /// (int64) if the frames have ids, else of positions (uint32).
    fn begun<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.changed(py, true)
    }

    /// Return the pairs of the previous frame that the last one does not have, as ``begun``.
    fn ended<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.changed(py, false)
    }
}

learning_methods!(PyBroadPhase, frames);
