//! The boxes of a caller: borrowed if they have the layout of the library, else converted.

use crate::error::{call, exception, invalid_box, two};
use crate::narrow::rounded;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use sapwise::error::BoxDefect;
use sapwise::{Aabb, Error};

/// The boxes of a caller during a call.
pub(crate) enum Boxes<'py> {
    /// The memory of an array of shape (n, 6), 32-bit floats in C order. The borrow keeps it alive, and keeps other
    /// Rust extensions from writing to it; nothing keeps Python from that.
    Borrowed(PyReadonlyArray2<'py, f32>),
    /// A copy of any other input.
    Owned(Vec<Aabb>),
}

// An `Aabb` is six floats, minimum then maximum, and nothing else.
const _: () = assert!(size_of::<Aabb>() == 6 * size_of::<f32>() && align_of::<Aabb>() == align_of::<f32>());

impl Boxes<'_> {
    /// Returns the boxes as the library takes them.
    pub(crate) fn as_slice(&self) -> PyResult<&[Aabb]> {
        match self {
            Self::Owned(boxes) => Ok(boxes),
            Self::Borrowed(array) => {
                let floats = array.as_slice()?;
                // SAFETY: `Aabb` is `repr(C)` of twice three floats, with their alignment and without padding, as
                // asserted above. All bit patterns are valid. `floats` has 6 floats a box.
                Ok(unsafe { std::slice::from_raw_parts(floats.as_ptr().cast::<Aabb>(), floats.len() / 6) })
            }
        }
    }
}

/// Takes the boxes of a caller: one array, or separate lower and upper corners. `which` follows "box 3" in errors.
pub(crate) fn boxes<'py>(
    boxes: &Bound<'py, PyAny>,
    upper: Option<&Bound<'py, PyAny>>,
    which: &str,
) -> PyResult<Boxes<'py>> {
    let py = boxes.py();
    if upper.is_none()
        && let Some(borrowed) = as_it_lies(boxes)
    {
        return Ok(borrowed);
    }
    let made = call(py, "sapwise._arrays", "boxes", (boxes, upper, which))?;
    if let Ok(corners) = made.cast::<PyTuple>() {
        let (lower, upper) = two(corners)?;
        return if let (Ok(lower), Ok(upper)) = (lower.cast::<PyArray2<f32>>(), upper.cast::<PyArray2<f32>>()) {
            let (lower, upper) = (lower.readonly(), upper.readonly());
            let (lower, upper) = (triples(lower.as_slice()?), triples(upper.as_slice()?));
            Ok(Boxes::Owned(lower.iter().zip(upper).map(|(&min, &max)| Aabb::new(min, max)).collect()))
        } else {
            let (lower, upper) = (lower.cast::<PyArray2<f64>>()?.readonly(), upper.cast::<PyArray2<f64>>()?.readonly());
            let (lower, upper) = (triples(lower.as_slice()?), triples(upper.as_slice()?));
            owned(py, which, lower.len(), lower.iter().copied().zip(upper.iter().copied()))
        };
    }
    if let Some(borrowed) = as_it_lies(&made) {
        return Ok(borrowed);
    }
    let wide = made.cast::<PyArray2<f64>>()?.readonly();
    let corners = triples(wide.as_slice()?);
    owned(py, which, corners.len() / 2, corners.chunks_exact(2).map(|c| (c[0], c[1])))
}

/// Groups floats in threes.
fn triples<T>(floats: &[T]) -> &[[T; 3]] {
    floats.as_chunks().0
}

/// Borrows an aligned array of shape (n, 6) of 32-bit floats in C order. `None` for other arrays, and for subclasses,
/// such as masked arrays.
fn as_it_lies<'py>(array: &Bound<'py, PyAny>) -> Option<Boxes<'py>> {
    let array = array.cast::<PyArray2<f32>>().ok()?;
    let plain = array.get_type().is(array.py().get_type::<PyUntypedArray>());
    let lies = array.shape()[1] == 6 && array.is_c_contiguous() && array.data().is_aligned();
    // If another Rust extension is writing to it, it is copied, which reports that.
    if plain && lies { array.try_readonly().ok().map(Boxes::Borrowed) } else { None }
}

/// Rounds boxes of 64-bit floats.
fn owned<'py>(
    py: Python<'py>,
    which: &str,
    count: usize,
    corners: impl Iterator<Item = ([f64; 3], [f64; 3])> + Send,
) -> PyResult<Boxes<'py>> {
    let convert = || -> Result<Vec<Aabb>, Result<(usize, BoxDefect), Error>> {
        let mut boxes = Vec::new();
        let refused = |_| Err(Error::OutOfMemory { what: "boxes", elements: count });
        boxes.try_reserve_exact(count).map_err(refused)?;
        for (index, (min, max)) in corners.enumerate() {
            boxes.push(rounded(min, max).map_err(|defect| Ok((index, defect)))?);
        }
        Ok(boxes)
    };
    py.detach(convert).map(Boxes::Owned).map_err(|why| match why {
        Ok((index, defect)) => invalid_box(py, which, index, defect),
        Err(error) => exception(py, &error, which),
    })
}
