//! `pairs` and `pairs_between`: each call stands for itself.

use crate::boxes::Boxes;
use crate::engine::{Exactly, Search, What, search};
use crate::{Corners, Keywords, PyDecision, boxes, call, exception, invalid_box, start, unusable};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sapwise::{Aabb, Error, Filter, Membership};
use std::borrow::Cow;

/// What `pairs` and `pairs_between` can be asked for beside the boxes.
struct Wishes<'a> {
    filter: Option<Vec<Membership>>,
    margin: f64,
    algorithm: Option<&'a str>,
    worlds: Option<Vec<i64>>,
    ordered: bool,
    limit: Option<usize>,
}

impl Wishes<'_> {
    /// Refuses what excludes each other.
    fn check(&self, py: Python<'_>) -> PyResult<()> {
        if !(self.margin >= 0.0 && self.margin.is_finite()) {
            return Err(unusable(py, format!("margin is {}; give 0 or more and finite", self.margin)));
        }
        if self.algorithm.is_some() && self.worlds.is_some() {
            return Err(unusable(py, "algorithm and worlds exclude each other; give one of them"));
        }
        Ok(())
    }

    /// Returns these boxes grown at their upper ends: those of a pair are then no further apart than the margin on
    /// each axis.
    fn grown<'b>(&self, py: Python<'_>, given: &'b Boxes<'_>, which: &str) -> PyResult<Cow<'b, [Aabb]>> {
        let boxes = given.as_slice()?;
        if self.margin == 0.0 {
            return Ok(Cow::Borrowed(boxes));
        }
        // Growing hides what is inverted.
        Aabb::check(boxes, 0).map_err(|error| exception(py, &error, which))?;
        // The sums are rounded down, and so to the highest 32-bit minimum that is not beyond them.
        let grown = |aabb: &Aabb| {
            let sums = aabb.max.map(|high| f64::from(high) + self.margin);
            Aabb { max: Aabb::from_f64(sums, sums).min, ..*aabb }
        };
        Ok(Cow::Owned(py.detach(|| boxes.iter().map(grown).collect())))
    }

    /// Returns the corners of both members of a pair if rounding to 32 bits may have made pairs.
    fn exactly<'b>(&self, corners: [Corners<'b>; 2]) -> Option<Exactly<'b>> {
        let wide = corners.iter().any(|of| matches!(of, Corners::Wide(_)));
        wide.then_some(Exactly { corners, margin: self.margin })
    }

    /// Returns the search of one list by these wishes. Positions in the answer are those of `boxes`.
    fn search<'b>(self, boxes: &'b mut Cow<'_, [Aabb]>, exactly: Option<Exactly<'b>>, from_second: u32) -> Search<'b>
    where
        Self: 'b,
    {
        let Self { mut filter, algorithm, worlds, ordered, limit, .. } = self;
        let mut places = None;
        let what = match (algorithm, worlds) {
            (Some(name), _) => What::By(name, boxes),
            (None, None) => What::All(boxes),
            (None, Some(keys)) => {
                if !keys.is_sorted() {
                    let mut by_world: Vec<u32> = (0..keys.len() as u32).collect();
                    by_world.sort_by_key(|&k| keys[k as usize]);
                    *boxes = by_world.iter().map(|&k| boxes[k as usize]).collect();
                    filter = filter.map(|of| by_world.iter().map(|&k| of[k as usize]).collect());
                    places = Some(by_world);
                }
                let key = |k: usize| keys[places.as_ref().map_or(k, |places| places[k] as usize)];
                let starts = (0..=keys.len()).filter(|&k| k == 0 || k == keys.len() || key(k) != key(k - 1)).collect();
                What::Worlds(boxes, starts)
            }
        };
        let filter = filter.map(Filter::new);
        Search { what, order: start::order(ordered), limit, filter, exactly, places, from_second }
    }
}

/// Converts the argument `ids`, or `worlds`, for `count` boxes, or for a pair of lists.
pub(crate) fn integers<'py>(
    py: Python<'py>,
    name: &str,
    given: Option<&Bound<'py, PyAny>>,
    count: impl IntoPyObject<'py>,
) -> PyResult<Option<Vec<i64>>> {
    let Some(given) = given else { return Ok(None) };
    let array = call(py, "sapwise._arrays", name, (given, count))?;
    Ok(Some(array.cast::<PyArray1<i64>>()?.to_vec()?))
}

/// Find all pairs of overlapping boxes.
///
/// Boxes are closed: those that touch overlap. For consecutive frames use ``BroadPhase``, which is faster there. The
/// memory and the work of a call stay for the next one, so the same boxes are found faster again. Chooses the
/// algorithm by the tuning of this machine that ``predict`` or ``BroadPhase`` has saved, else by built-in thresholds.
/// It measures nothing. ``last_decision`` returns the choice and its reason.
///
/// Parameters
/// ----------
/// boxes : array_like, shape (n, 6) or (n, 2, 3)
///     One box a row: minx, miny, minz, maxx, maxy, maxz, in any unit of length; in two dimensions (n, 4) or (n, 2, 2).
///     With ``upper``: the lower corners, shape (n, 3) or (n, 2).
/// upper : array_like, shape (n, 3) or (n, 2), optional
///     The upper corners.
/// groups, masks : array_like of int, optional
///     One bit a group, 32 bits, for each box or for all: two boxes are a pair only if each has a group that is in the
///     mask of the other. By default a box is in every group, and its mask allows every group.
/// owner : array_like of int, optional
///     What each box is a part of, such as a body: two boxes with the same owner are no pair. 0 is no owner.
/// fixed : array_like of bool, optional
///     Which boxes never move: two of them are no pair.
/// margin : float, default 0.0
///     Boxes are a pair too if they are no further apart than this on each axis.
/// algorithm : str, optional
///     Run this algorithm, for instance ``"bvh@cpu1"``.
/// worlds : array_like of int, optional
///     The world of each box: boxes of different worlds are no pair. Worlds may be many and small.
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
///     The shape is wrong, there are more boxes than 32 bits can name, or another argument can't be used.
/// TypeError
///     The dtype can't be converted: bool, complex, object, text, long double.
/// TooManyPairsError
///     More pairs than ``limit``. ``limit`` of the exception has it.
///
/// Notes
/// -----
/// 32-bit floats of shape (n, 6) in C order are read in place; nothing may write to them meanwhile.
/// Everything else is copied. 64-bit floats and integers give the pairs of 64-bit arithmetic: they are searched rounded
/// outward to 32 bits, and pairs that only rounding has made are dropped. ``margin`` is added in 64 bits for every
/// dtype. The interpreter's lock is released. Ctrl-C works before and after, not within.
///
/// Examples
/// --------
/// >>> import numpy as np, sapwise
/// >>> boxes = np.array([[0, 0, 0, 1, 1, 1], [1, 0, 0, 2, 1, 1], [5, 5, 5, 6, 6, 6]], dtype=np.float32)
/// >>> sapwise.pairs(boxes)
/// array([[0, 1]], dtype=uint32)
#[pyfunction]
#[pyo3(signature = (
    boxes, upper=None, *, groups=None, masks=None, owner=None, fixed=None, margin=0.0, algorithm=None, worlds=None,
    ordered=true, limit=None,
))]
#[expect(clippy::too_many_arguments, reason = "they have names in Python")]
pub(crate) fn pairs<'py>(
    boxes: &Bound<'py, PyAny>,
    upper: Option<&Bound<'py, PyAny>>,
    groups: Option<&Bound<'py, PyAny>>,
    masks: Option<&Bound<'py, PyAny>>,
    owner: Option<&Bound<'py, PyAny>>,
    fixed: Option<&Bound<'py, PyAny>>,
    margin: f64,
    algorithm: Option<&str>,
    worlds: Option<&Bound<'py, PyAny>>,
    ordered: bool,
    #[pyo3(from_py_with = start::limit)] limit: Option<usize>,
) -> PyResult<Bound<'py, PyArray2<u32>>> {
    let py = boxes.py();
    let given = crate::boxes(boxes, upper, "")?;
    let count = given.as_slice()?.len();
    let filter = Keywords { groups, masks, owner, fixed }.memberships(py, count)?;
    let worlds = integers(py, "worlds", worlds, count)?;
    let wishes = Wishes { filter, margin, algorithm, worlds, ordered, limit };
    wishes.check(py)?;
    let mut grown = wishes.grown(py, &given, "")?;
    if wishes.worlds.is_some() {
        // Before they are put in another order.
        Aabb::check(&grown, 0).map_err(|error| exception(py, &error, ""))?;
    }
    let corners = given.corners()?;
    let exactly = wishes.exactly([corners, corners]);
    search(py, count, wishes.search(&mut grown, exactly, 0), |error| exception(py, &error, ""))
}

/// Find all pairs of a box of ``a`` and an overlapping box of ``b``.
///
/// The shorter list is put into a tree, which is searched for each box of the longer one. Pairs within a list are not
/// searched.
///
/// Parameters
/// ----------
/// a : array_like, shape (n, 6) or (n, 2, 3)
///     One box a row: minx, miny, minz, maxx, maxy, maxz; in two dimensions (n, 4) or (n, 2, 2).
/// b : array_like, shape (k, 6) or (k, 2, 3)
///     The other boxes.
/// groups, masks, owner, fixed, worlds : pair of array_like, optional
///     As in ``pairs``: for the boxes of ``a``, then for those of ``b``. None in place of one is the default.
/// margin, algorithm
///     As in ``pairs``.
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
///     The shape is wrong, there are more boxes than 32 bits can name, or another argument can't be used. ``owner``
///     excludes ``algorithm`` and ``worlds``, which exclude each other.
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
#[pyo3(signature = (
    a, b, *, groups=None, masks=None, owner=None, fixed=None, margin=0.0, algorithm=None, worlds=None, ordered=true,
    limit=None,
))]
#[expect(clippy::too_many_arguments, reason = "they have names in Python")]
pub(crate) fn pairs_between<'py>(
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
    groups: Option<&Bound<'py, PyAny>>,
    masks: Option<&Bound<'py, PyAny>>,
    owner: Option<&Bound<'py, PyAny>>,
    fixed: Option<&Bound<'py, PyAny>>,
    margin: f64,
    algorithm: Option<&str>,
    worlds: Option<&Bound<'py, PyAny>>,
    ordered: bool,
    #[pyo3(from_py_with = start::limit)] limit: Option<usize>,
) -> PyResult<Bound<'py, PyArray2<u32>>> {
    let py = a.py();
    let (of_a, of_b) = (boxes(a, None, " of a")?, boxes(b, None, " of b")?);
    let (first, second) = (of_a.as_slice()?.len(), of_b.as_slice()?.len());
    let objects = first + second;
    let Ok(from_second) = u32::try_from(objects).map(|_| first as u32) else {
        return Err(exception(py, &Error::TooManyObjects { objects }, ""));
    };
    let filter = Keywords { groups, masks, owner, fixed }.memberships(py, (first, second))?;
    let worlds = integers(py, "worlds", worlds, (first, second))?;
    let mut wishes = Wishes { filter, margin, algorithm, worlds, ordered, limit };
    wishes.check(py)?;
    let (grown_a, grown_b) = (wishes.grown(py, &of_a, " of a")?, wishes.grown(py, &of_b, " of b")?);
    let exactly = wishes.exactly([of_a.corners()?, of_b.corners()?]);
    let error = |error| match error {
        Error::InvalidBox { index, defect } if index < first => invalid_box(py, " of a", index, defect),
        Error::InvalidBox { index, defect } => invalid_box(py, " of b", index - first, defect),
        other => exception(py, &other, ""),
    };
    if wishes.algorithm.is_none() && wishes.worlds.is_none() {
        let Wishes { filter, ordered, limit, .. } = wishes;
        let (what, order) = (What::Between(&grown_a, &grown_b), start::order(ordered));
        let filter = filter.map(Filter::new);
        return search(py, objects, Search { what, order, limit, filter, exactly, places: None, from_second }, error);
    }
    // As one list, in which each of the two has one owner: two boxes of it are no pair.
    if owner.is_some() {
        let text = "owner excludes algorithm and worlds in pairs_between; leave it out, or filter after";
        return Err(unusable(py, text));
    }
    let mut joined: Cow<'_, [Aabb]> = Cow::Owned([&*grown_a, &*grown_b].concat());
    Aabb::check(&joined, 0).map_err(error)?;
    let mut filter = wishes.filter.unwrap_or_else(|| vec![Membership::ALL; objects]);
    filter.iter_mut().enumerate().for_each(|(k, of)| of.owner = 1 + u32::from(k >= first));
    wishes.filter = Some(filter);
    search(py, objects, wishes.search(&mut joined, exactly, from_second), error)
}

/// Tell what the last call of ``pairs`` or ``pairs_between`` chose and why.
///
/// Returns
/// -------
/// Decision or None
///     None before the first call. With calls on several threads, that of the call which ended last.
#[pyfunction]
pub(crate) fn last_decision(py: Python<'_>) -> Option<PyDecision> {
    crate::engine::last_decision(py)
}
