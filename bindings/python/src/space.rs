//! The class `Space`.

use crate::engine::two_columns;
use crate::handles::{bits, check, first_stale, handles};
use crate::view::PyView;
use crate::{
    Held, Keywords, PyTuning, Searcher, Start, array, exception, invalid_box, kept, learning_methods, start, unusable,
};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sapwise::{Aabb, Adaptive, Body, Error, Handle, Membership, Space};
use std::sync::{Arc, PoisonError, RwLock, TryLockError};

impl Searcher for Space {
    const CLASS: &'static str = "Space";
    const UNUSED: &'static str = "no update yet";

    fn forked(parent: &RwLock<Self>, adaptive: Adaptive, _: &Start) -> Result<Self, String> {
        let parent = match parent.try_read() {
            Ok(parent) => parent,
            Err(TryLockError::Poisoned(parent)) => PoisonError::into_inner(parent),
            Err(TryLockError::WouldBlock) => {
                return Err("another thread changed this Space during the fork; fork between its calls".to_owned());
            }
        };
        let mut space = Self::with(adaptive);
        space.clone_from(&parent);
        Ok(space)
    }

    fn adaptive(&self) -> &Adaptive {
        self.search()
    }
}

/// Bodies with handles, the pairs of those that overlap, and queries.
///
/// Set the bodies that moved, then ``update``. Bodies that are not set cost nothing once they are by far the most.
/// Pairs and queries follow a call from the next ``update`` on. A call that fails changes no body. As a context manager
/// it saves what it has learned when the block ends.
///
/// Parameters
/// ----------
/// cache, measure, background, tuning, algorithm, threads, learning, exploring, limit
///     As in ``BroadPhase``. Pairs with bodies that rest do not count for the limit.
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
/// The same calls give the same arrays, whatever the machine, the threads and the algorithm. A pickle holds the bodies
/// with their handles, and the tuning: the copy goes on as the original would, but saves nothing to the cache. Several
/// threads may use a space: calls that change it wait for each other, without the interpreter's lock. After a fork the
/// child has a copy of its own.
///
/// Examples
/// --------
/// >>> import numpy as np, sapwise
/// >>> with sapwise.Space(cache=False, measure=False) as space:
/// ...     wall, player = space.insert([[-1, -1, -1, 1, 1, 1], [4, -1, -1, 6, 1, 1]], fixed=[True, False])
/// ...     space.update()
/// ...     space.set(player, [0.5, -1, -1, 2.5, 1, 1])
/// ...     space.update()
/// ...     print((space.begun() == [wall, player]).all(), len(space.query_point([5, 0, 0])))
/// True 0
#[pyclass(frozen, extends = PyView, name = "Space", module = "sapwise")]
pub(crate) struct PySpace {
    held: Arc<Held<Space>>,
}

impl PySpace {
    /// Makes a space with these arguments.
    pub(crate) fn initial(
        py: Python<'_>,
        start: Start,
        make: impl FnOnce(Adaptive) -> Space,
    ) -> PyResult<PyClassInitializer<Self>> {
        let held = Held::new(py, start, |adaptive, start| {
            let mut space = make(adaptive);
            space.set_limit(start.most_pairs());
            space
        })?;
        let held = Arc::new(held);
        let view = PyView { held: Arc::clone(&held), by: None };
        Ok(PyClassInitializer::from(view).add_subclass(Self { held }))
    }

    /// Changes the bodies of these handles, or none of them. `boxes` are theirs.
    fn change<T: Send>(
        &self,
        py: Python<'_>,
        handles: &[Handle],
        boxes: &[Aabb],
        change: impl FnOnce(&mut Space) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        self.held.write(py, change)?.map_err(|error| match error {
            Error::StaleHandle { handle } => first_stale(py, handles, handle),
            Error::InvalidBody { defect, .. } => {
                let index = boxes.iter().position(|aabb| aabb.defect().is_some()).unwrap_or(0);
                invalid_box(py, "", index, defect)
            }
            error => exception(py, &error, ""),
        })
    }

    fn listed<'py>(
        &self,
        py: Python<'py>,
        list: fn(&Space) -> &[(Handle, Handle)],
    ) -> PyResult<Bound<'py, PyArray2<u64>>> {
        two_columns(py, self.held.read(py, |space| bits(list(space)))?)
    }
}

#[pymethods]
impl PySpace {
    #[new]
    #[pyo3(signature = (
        *, cache=None, measure=true, background=true, tuning=None, algorithm=None, threads=None, learning=true,
        exploring=true, limit=None,
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
        #[pyo3(from_py_with = start::limit)] limit: Option<usize>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let start = Start::new(cache, measure, background, tuning, algorithm)?;
        Self::initial(py, Start { threads, learning, exploring, limit, ..start }, Space::with)
    }

    /// Insert a body for each box.
    ///
    /// Parameters
    /// ----------
    /// boxes : array_like, shape (n, 6) or as in ``pairs``
    ///     64-bit floats and integers are rounded outward: nearly touching boxes may be a pair.
    /// groups, masks, owner, fixed : optional
    ///     As in ``pairs``. Fixed bodies cost nothing until they are set, which they may be.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,), uint64
    ///     Their handles. None is 0, and no other body of the space gets one of them. The upper 32 bits are a small
    ///     number that no other body has at the time: ``handles >> 32`` are positions for arrays of your own.
    ///
    /// Raises
    /// ------
    /// InvalidBoxError, InputError, TypeError
    ///     As in ``pairs``. Then none is inserted.
    #[pyo3(signature = (boxes, *, groups=None, masks=None, owner=None, fixed=None))]
    fn insert<'py>(
        &self,
        boxes: &Bound<'py, PyAny>,
        groups: Option<&Bound<'py, PyAny>>,
        masks: Option<&Bound<'py, PyAny>>,
        owner: Option<&Bound<'py, PyAny>>,
        fixed: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<u64>>> {
        let py = boxes.py();
        let given = kept(boxes)?;
        let boxes = given.as_slice()?;
        let columns = Keywords { groups, masks, owner, fixed }.columns(py, boxes.len())?;
        let inserted = self.change(py, &[], boxes, |space| {
            let Some(columns) = columns else { return space.insert_all(boxes, Body::default()) };
            Aabb::check(boxes, 0)?;
            space.reserve(boxes.len())?;
            let of = |k| Body::from(columns.over(k, Membership::ALL));
            boxes.iter().enumerate().map(|(k, &aabb)| space.insert(aabb, of(k))).collect()
        })?;
        Ok(array(py, inserted))
    }

    /// Set the boxes of bodies.
    ///
    /// Parameters
    /// ----------
    /// handles : array_like of int, shape (n,)
    ///     Or one handle.
    /// boxes : array_like, shape (n, 6) or as in ``pairs``
    ///
    /// Raises
    /// ------
    /// StaleHandleError
    ///     A body was removed. ``index`` is the position of the first such handle. Then no box is set.
    /// InvalidBoxError, InputError, TypeError
    ///     As in ``pairs``. Then no box is set.
    fn set(&self, handles: &Bound<'_, PyAny>, boxes: &Bound<'_, PyAny>) -> PyResult<()> {
        let py = boxes.py();
        let handles = self::handles(handles)?;
        let given = kept(boxes)?;
        let boxes = given.as_slice()?;
        if handles.len() != boxes.len() {
            let text = format!("there are {} handles and {} boxes; give one box a handle", handles.len(), boxes.len());
            return Err(unusable(py, text));
        }
        self.change(py, &handles, boxes, |space| space.set_all(&handles, boxes))
    }

    /// Set what bodies may meet. What is not given stays.
    ///
    /// Parameters
    /// ----------
    /// handles : array_like of int, shape (n,)
    ///     Or one handle.
    /// groups, masks, owner, fixed : optional
    ///     As in ``pairs``.
    ///
    /// Raises
    /// ------
    /// StaleHandleError, InputError
    ///     As in ``set``. Then nothing is set.
    #[pyo3(signature = (handles, *, groups=None, masks=None, owner=None, fixed=None))]
    fn set_body<'py>(
        &self,
        handles: &Bound<'py, PyAny>,
        groups: Option<&Bound<'py, PyAny>>,
        masks: Option<&Bound<'py, PyAny>>,
        owner: Option<&Bound<'py, PyAny>>,
        fixed: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<()> {
        let py = handles.py();
        let handles = self::handles(handles)?;
        let Some(columns) = Keywords { groups, masks, owner, fixed }.columns(py, handles.len())? else {
            return Err(unusable(py, "nothing is set; give groups, masks, owner or fixed"));
        };
        self.change(py, &handles, &[], |space| {
            check(space, &handles)?;
            for (k, &handle) in handles.iter().enumerate() {
                if let Some((_, known)) = space.get(handle) {
                    let set = Body::from(columns.over(k, *known.membership()));
                    space.set_body(handle, set)?;
                }
            }
            Ok(())
        })
    }

    /// Remove bodies. Their pairs end at the next update.
    ///
    /// Parameters
    /// ----------
    /// handles : array_like of int, shape (n,)
    ///     Or one handle. One may be given twice.
    ///
    /// Raises
    /// ------
    /// StaleHandleError
    ///     As in ``set``. Then none is removed.
    fn remove(&self, handles: &Bound<'_, PyAny>) -> PyResult<()> {
        let py = handles.py();
        let handles = self::handles(handles)?;
        self.change(py, &handles, &[], |space| space.remove_all(&handles))
    }

    /// Find all pairs, and which began and ended since the previous update.
    ///
    /// Raises
    /// ------
    /// TooManyPairsError, MemoryError, SapwiseError
    ///     More pairs than ``limit``, no memory, or no algorithm can run. The next update compares with the last one
    ///     that succeeded.
    ///
    /// Notes
    /// -----
    /// Ctrl-C works before and after an update, not within. An update that was done counts even if
    /// ``KeyboardInterrupt`` follows: ``pairs``, ``begun`` and ``ended`` hold its pairs.
    fn update(&self, py: Python<'_>) -> PyResult<()> {
        py.check_signals()?;
        self.change(py, &[], &[], Space::update)?;
        py.check_signals()
    }

    /// Return the pairs of the last update.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (m, 2), uint64
    ///     The handles of each pair, the lower one first. Each pair once, in an order that depends on the calls alone.
    fn pairs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u64>>> {
        self.listed(py, Space::pairs)
    }

    /// Return the pairs that the previous update did not have, sorted, as ``pairs`` does.
    fn begun<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u64>>> {
        self.listed(py, Space::begun)
    }

    /// Return the pairs that only the previous update had, sorted, as ``pairs`` does. Those of removed bodies are among
    /// them.
    fn ended<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u64>>> {
        self.listed(py, Space::ended)
    }

    /// Return the handles of all bodies, ascending.
    fn handles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u64>>> {
        Ok(array(py, self.held.read(py, |space| space.handles().collect::<Vec<_>>())?))
    }

    /// Return the boxes of bodies, as set last: shape (n, 6), float32.
    fn boxes<'py>(&self, handles: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let py = handles.py();
        let handles = self::handles(handles)?;
        let numbers = self.held.read(py, |space| {
            check(space, &handles)?;
            let boxes = handles.iter().filter_map(|&handle| space.get(handle));
            Ok(boxes.flat_map(|(aabb, _)| aabb.min.into_iter().chain(aabb.max)).collect::<Vec<f32>>())
        })?;
        let numbers = numbers.map_err(|error| match error {
            Error::StaleHandle { handle } => first_stale(py, &handles, handle),
            error => exception(py, &error, ""),
        })?;
        numbers.into_pyarray(py).reshape([handles.len(), 6])
    }

    /// Return a view of the bodies that a body of these groups, masks, owner and fixed may meet, for queries.
    ///
    /// Parameters
    /// ----------
    /// groups, masks, owner, fixed : optional
    ///     One value each, as in ``pairs``.
    #[pyo3(signature = (*, groups=None, masks=None, owner=None, fixed=None))]
    fn view(
        &self,
        py: Python<'_>,
        groups: Option<&Bound<'_, PyAny>>,
        masks: Option<&Bound<'_, PyAny>>,
        owner: Option<&Bound<'_, PyAny>>,
        fixed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyView> {
        let columns = Keywords { groups, masks, owner, fixed }.columns(py, 1)?;
        let by = columns.map_or(Membership::ALL, |columns| columns.over(0, Membership::ALL));
        Ok(PyView { held: Arc::clone(&self.held), by: Some(by.into()) })
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.held.read(py, Space::len)
    }

    fn __contains__(&self, py: Python<'_>, handle: u64) -> PyResult<bool> {
        self.held.read(py, |space| Handle::from_bits(handle).is_some_and(|handle| space.contains(handle)))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        crate::snapshot::reduced(py, &self.held)
    }
}

learning_methods!(PySpace, held);
