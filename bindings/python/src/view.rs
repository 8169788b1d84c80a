//! The class `View`: queries of a space.

use crate::error::invalid_ray;
use crate::{Held, array, call, exception, kept, start, unusable};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use sapwise::{Aabb, Body, Error, Handle, Ray, Space, View};
use std::sync::Arc;

/// The bodies of a ``Space`` that one body may meet, for queries. ``Space.view`` makes it.
///
/// A ``Space`` is itself a view, of all its bodies. Queries see the boxes of the last ``update``. They release the
/// interpreter's lock, and several threads may query at once. Points and rays of 64-bit floats are rounded to the
/// nearest 32-bit floats, boxes outward.
#[pyclass(frozen, subclass, name = "View", module = "sapwise")]
pub(crate) struct PyView {
    pub(crate) held: Arc<Held<Space>>,
    /// `None`: all bodies.
    pub(crate) by: Option<Body>,
}

type Handles<'py> = Bound<'py, PyArray1<u64>>;
type Floats<'py> = Bound<'py, PyArray1<f32>>;
type Hits<'py> = (Handles<'py>, Floats<'py>);

/// A distance, and the body.
type Hit = (f32, Handle);

fn sorted(mut hits: Vec<Hit>) -> Vec<Hit> {
    hits.sort_unstable_by(|(t, one), (u, other)| t.total_cmp(u).then(one.cmp(other)));
    hits
}

fn apart<'py>(py: Python<'py>, hits: impl Iterator<Item = Hit>) -> Hits<'py> {
    let (t, handles): (Vec<f32>, Vec<Handle>) = hits.unzip();
    (array(py, handles), t.into_pyarray(py))
}

/// Takes rays, or a single one.
fn rays<'py>(
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    max: Option<&Bound<'py, PyAny>>,
    of_one: bool,
) -> PyResult<Vec<Ray>> {
    let py = origins.py();
    type Made<'py> = (PyReadonlyArray2<'py, f32>, PyReadonlyArray2<'py, f32>, Floats<'py>);
    let made = call(py, "sapwise._arrays", "rays", (origins, directions, max, of_one))?;
    let (origins, directions, most): Made<'_> = made.extract()?;
    let (origins, directions) = (origins.as_slice()?.as_chunks().0, directions.as_slice()?.as_chunks().0);
    let most = most.readonly();
    let each = origins.iter().zip(directions).zip(most.as_slice()?);
    let rays: Vec<Ray> = each.map(|((&origin, &direction), &max)| Ray { origin, direction, max }).collect();
    match rays.iter().enumerate().find_map(|(index, ray)| ray.defect().map(|defect| (index, defect))) {
        Some((index, defect)) => Err(invalid_ray(py, "ray", index, defect)),
        None => Ok(rays),
    }
}

/// Takes one box.
fn one(given: &Bound<'_, PyAny>) -> PyResult<Aabb> {
    match kept(given)?.as_slice()? {
        &[aabb] => Ok(aabb),
        boxes => Err(unusable(given.py(), format!("there are {} boxes; give one, of shape (6,) or (4,)", boxes.len()))),
    }
}

/// Takes one point or motion of finite numbers.
fn point(given: &Bound<'_, PyAny>, name: &str) -> PyResult<[f32; 3]> {
    let py = given.py();
    let made = call(py, "sapwise._arrays", "points", (given, name, true))?;
    let made = made.cast::<PyArray2<f32>>()?.readonly();
    let point: [f32; 3] = made.as_slice()?.as_chunks().0[0];
    match Ray::new(point, [1.0; 3]).defect() {
        Some(defect) => Err(invalid_ray(py, name, 0, defect)),
        None => Ok(point),
    }
}

impl PyView {
    /// Runs a query without the interpreter's lock.
    fn query<T: Send>(&self, py: Python<'_>, query: impl FnOnce(View<'_>) -> Result<T, Error> + Send) -> PyResult<T> {
        let run = |space: &Space| query(self.by.as_ref().map_or_else(|| space.all(), |by| space.view(by)));
        self.held.read(py, run)?.map_err(|error| exception(py, &error, ""))
    }

    /// Returns the position of each box with each body that it overlaps, sorted.
    fn overlapping(&self, py: Python<'_>, boxes: &[Aabb]) -> PyResult<Vec<(usize, Handle)>> {
        self.query(py, |view| {
            let mut all = Vec::new();
            view.query_boxes(boxes, |k, handle| all.push((k, handle)))?;
            all.sort_unstable();
            Ok(all)
        })
    }

    /// Returns the hits of each ray with its position, sorted.
    fn hits(&self, py: Python<'_>, rays: &[Ray]) -> PyResult<Vec<(usize, Hit)>> {
        self.query(py, |view| {
            let mut all = Vec::new();
            for (k, ray) in rays.iter().enumerate() {
                let mut hits = Vec::new();
                view.cast_ray(ray, |handle, t| {
                    hits.push((t, handle));
                    f32::INFINITY
                })?;
                all.extend(sorted(hits).into_iter().map(|hit| (k, hit)));
            }
            Ok(all)
        })
    }
}

#[pymethods]
impl PyView {
    /// Find the bodies whose boxes overlap a box.
    ///
    /// Parameters
    /// ----------
    /// box : array_like, shape (6,) or (4,)
    ///
    /// Returns
    /// -------
    /// ndarray, shape (m,), uint64
    ///     Their handles, ascending.
    fn query_box<'py>(&self, r#box: &Bound<'py, PyAny>) -> PyResult<Handles<'py>> {
        let found = self.overlapping(r#box.py(), &[one(r#box)?])?;
        Ok(array(r#box.py(), found.into_iter().map(|(_, handle)| handle)))
    }

    /// Find the bodies whose boxes overlap each of these boxes.
    ///
    /// Parameters
    /// ----------
    /// boxes : array_like, shape (n, 6) or as in ``pairs``
    ///
    /// Returns
    /// -------
    /// positions : ndarray, shape (m,), int64
    ///     Positions in ``boxes``, ascending.
    /// handles : ndarray, shape (m,), uint64
    ///     A body that this box overlaps; those of one box ascend.
    fn query_boxes<'py>(&self, boxes: &Bound<'py, PyAny>) -> PyResult<(Bound<'py, PyArray1<i64>>, Handles<'py>)> {
        let py = boxes.py();
        let given = kept(boxes)?;
        let found = self.overlapping(py, given.as_slice()?)?;
        let positions: Vec<i64> = found.iter().map(|&(k, _)| k as i64).collect();
        Ok((positions.into_pyarray(py), array(py, found.into_iter().map(|(_, handle)| handle))))
    }

    /// Find the bodies whose boxes contain a point.
    ///
    /// Parameters
    /// ----------
    /// point : array_like, shape (3,) or (2,)
    ///
    /// Returns
    /// -------
    /// ndarray, shape (m,), uint64
    ///     Their handles, ascending.
    fn query_point<'py>(&self, point: &Bound<'py, PyAny>) -> PyResult<Handles<'py>> {
        let at = self::point(point, "point")?;
        let found = self.overlapping(point.py(), &[Aabb::new(at, at)])?;
        Ok(array(point.py(), found.into_iter().map(|(_, handle)| handle)))
    }

    /// Find all bodies whose boxes a ray meets.
    ///
    /// Parameters
    /// ----------
    /// origin, direction : array_like, shape (3,) or (2,)
    ///     The points of the ray are ``origin + t * direction`` with ``0 <= t <= max``.
    /// max : float, default inf
    ///
    /// Returns
    /// -------
    /// handles : ndarray, shape (m,), uint64
    ///     In the order in which the ray meets them.
    /// t : ndarray, shape (m,), float32
    ///     Where it enters each box: 0 if it begins there.
    #[pyo3(signature = (origin, direction, max=None))]
    fn cast_ray<'py>(
        &self,
        origin: &Bound<'py, PyAny>,
        direction: &Bound<'py, PyAny>,
        max: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Hits<'py>> {
        let py = origin.py();
        let rays = rays(origin, direction, max, true)?;
        Ok(apart(py, self.hits(py, &rays)?.into_iter().map(|(_, hit)| hit)))
    }

    /// Find all bodies whose boxes each of these rays meets.
    ///
    /// Parameters
    /// ----------
    /// origins, directions : array_like, shape (n, 3) or (n, 2)
    /// max : float or array_like, shape (n,), default inf
    ///     As in ``cast_ray``.
    ///
    /// Returns
    /// -------
    /// positions : ndarray, shape (m,), int64
    ///     Positions of the rays, ascending.
    /// handles : ndarray, shape (m,), uint64
    /// t : ndarray, shape (m,), float32
    ///     As in ``cast_ray``.
    #[pyo3(signature = (origins, directions, max=None))]
    fn cast_rays<'py>(
        &self,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        max: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyArray1<i64>>, Handles<'py>, Floats<'py>)> {
        let py = origins.py();
        let rays = rays(origins, directions, max, false)?;
        let hits = self.hits(py, &rays)?;
        let positions: Vec<i64> = hits.iter().map(|&(k, _)| k as i64).collect();
        let (handles, t) = apart(py, hits.into_iter().map(|(_, hit)| hit));
        Ok((positions.into_pyarray(py), handles, t))
    }

    /// Find the body that each of these rays meets first.
    ///
    /// Parameters
    /// ----------
    /// origins, directions : array_like, shape (n, 3) or (n, 2)
    /// max : float or array_like, shape (n,), default inf
    ///     As in ``cast_ray``.
    ///
    /// Returns
    /// -------
    /// handles : ndarray, shape (n,), uint64
    ///     Of several at the same ``t`` the lowest one; 0, which is no handle, if the ray meets none.
    /// t : ndarray, shape (n,), float32
    ///     Where the ray enters the box; inf if it meets none.
    #[pyo3(signature = (origins, directions, max=None))]
    fn first_hits<'py>(
        &self,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        max: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Hits<'py>> {
        let py = origins.py();
        let rays = rays(origins, directions, max, false)?;
        let first =
            self.query(py, |view| rays.iter().map(|ray| view.first_hit(ray)).collect::<Result<Vec<_>, Error>>())?;
        let handles: Vec<u64> = first.iter().map(|hit| hit.map_or(0, |(handle, _)| handle.to_bits())).collect();
        let t: Vec<f32> = first.iter().map(|hit| hit.map_or(f32::INFINITY, |(_, t)| t)).collect();
        Ok((handles.into_pyarray(py), t.into_pyarray(py)))
    }

    /// Find all bodies whose boxes a moving box meets.
    ///
    /// Parameters
    /// ----------
    /// box : array_like, shape (6,) or (4,)
    /// motion : array_like, shape (3,) or (2,)
    ///
    /// Returns
    /// -------
    /// handles : ndarray, shape (m,), uint64
    ///     In the order in which the box meets them.
    /// share : ndarray, shape (m,), float32
    ///     The share of the motion after which it touches each: 0 if it overlaps at the start.
    fn cast_box<'py>(&self, r#box: &Bound<'py, PyAny>, motion: &Bound<'py, PyAny>) -> PyResult<Hits<'py>> {
        let py = r#box.py();
        let (aabb, motion) = (one(r#box)?, point(motion, "motion")?);
        let hits = self.query(py, |view| {
            let mut all = Vec::new();
            view.cast_box(&aabb, motion, |handle, share| {
                all.push((share, handle));
                f32::INFINITY
            })?;
            Ok(sorted(all))
        })?;
        Ok(apart(py, hits.into_iter()))
    }

    /// Find the bodies whose boxes are nearest to a point.
    ///
    /// Parameters
    /// ----------
    /// point : array_like, shape (3,) or (2,)
    /// k : int
    ///     How many.
    ///
    /// Returns
    /// -------
    /// handles : ndarray, shape (m,), uint64
    ///     The nearest first; of several at one distance the lowest. Fewer than ``k`` if there are fewer.
    /// distances : ndarray, shape (m,), float32
    ///     0 if the point is inside.
    fn nearest<'py>(
        &self,
        point: &Bound<'py, PyAny>,
        #[pyo3(from_py_with = start::k)] k: usize,
    ) -> PyResult<Hits<'py>> {
        let at = self::point(point, "point")?;
        let near = self.query(point.py(), |view| view.nearest(at, k))?;
        Ok(apart(point.py(), near.into_iter().map(|(handle, distance)| (distance, handle))))
    }
}
