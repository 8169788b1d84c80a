//! The boxes of a caller: borrowed if they have the layout of the library, else rounded outward.

use crate::{call, exception, invalid_box};
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use sapwise::error::BoxDefect;
use sapwise::{Aabb, Error};

/// The boxes of a caller during a call.
pub(crate) enum Boxes<'py> {
    /// The memory of an array of shape (n, 6), 32-bit floats in C order. The borrow keeps it alive, and keeps other
    /// Rust extensions from writing to it; nothing keeps Python from that.
    Borrowed(PyReadonlyArray2<'py, f32>),
    /// Those of an array of 64-bit floats, and this array if any bound was rounded.
    Rounded(Vec<Aabb>, Option<PyReadonlyArray2<'py, f64>>),
}

// An `Aabb` is six floats, minimum then maximum, and nothing else.
const _: () = assert!(size_of::<Aabb>() == 6 * size_of::<f32>() && align_of::<Aabb>() == align_of::<f32>());

/// The corners of boxes as the caller gave them.
#[derive(Clone, Copy)]
pub(crate) enum Corners<'a> {
    Exact(&'a [Aabb]),
    Wide(&'a [[f64; 6]]),
}

impl Corners<'_> {
    fn of(&self, k: u32) -> [f64; 6] {
        match self {
            Self::Exact(boxes) => {
                let Aabb { min: [a, b, c], max: [d, e, f] } = boxes[k as usize];
                [a, b, c, d, e, f].map(f64::from)
            }
            Self::Wide(rows) => rows[k as usize],
        }
    }

    /// Returns whether box `k` and box `l` of `others` are no further apart than `margin` on each axis.
    pub(crate) fn meet(&self, k: u32, others: &Self, l: u32, margin: f64) -> bool {
        let (a, b) = (self.of(k), others.of(l));
        (0..3).all(|axis| a[axis] <= b[axis + 3] + margin && b[axis] <= a[axis + 3] + margin)
    }
}

impl Boxes<'_> {
    /// Returns the boxes as the library takes them.
    pub(crate) fn as_slice(&self) -> PyResult<&[Aabb]> {
        match self {
            Self::Rounded(boxes, _) => Ok(boxes),
            Self::Borrowed(array) => {
                let floats = array.as_slice()?;
                // SAFETY: `Aabb` is `repr(C)` of twice three floats, with their alignment and without padding, as
                // asserted above. All bit patterns are valid. `floats` has 6 floats a box.
                Ok(unsafe { std::slice::from_raw_parts(floats.as_ptr().cast::<Aabb>(), floats.len() / 6) })
            }
        }
    }

    /// Returns the corners as the caller gave them.
    pub(crate) fn corners(&self) -> PyResult<Corners<'_>> {
        match self {
            Self::Rounded(_, Some(wide)) => Ok(Corners::Wide(wide.as_slice()?.as_chunks().0)),
            _ => self.as_slice().map(Corners::Exact),
        }
    }

    /// Warns, once in a process, if a bound was rounded, which may add pairs.
    pub(crate) fn warn_if_rounded(&self, py: Python<'_>) -> PyResult<()> {
        if let Self::Rounded(_, Some(_)) = self {
            call(py, "sapwise._arrays", "warn_of_rounding", ())?;
        }
        Ok(())
    }
}

/// Takes the boxes of a caller: one array, or separate lower and upper corners. `which` follows "box 3" in errors.
pub(crate) fn boxes<'py>(
    boxes: &Bound<'py, PyAny>,
    upper: Option<&Bound<'py, PyAny>>,
    which: &str,
) -> PyResult<Boxes<'py>> {
    if upper.is_none()
        && let Some(borrowed) = as_it_lies(boxes)
    {
        return Ok(borrowed);
    }
    converted(call(boxes.py(), "sapwise._arrays", "boxes", (boxes, upper, which))?, which)
}

/// Takes boxes, or a single one of shape (6,) or (4,), for a structure that keeps them. Warns if any is rounded.
pub(crate) fn kept<'py>(given: &Bound<'py, PyAny>) -> PyResult<Boxes<'py>> {
    if let Some(borrowed) = as_it_lies(given) {
        return Ok(borrowed);
    }
    let py = given.py();
    let boxes = converted(call(py, "sapwise._arrays", "box_or_boxes", (given,))?, "")?;
    boxes.warn_if_rounded(py)?;
    Ok(boxes)
}

/// Takes what `sapwise._arrays` has made: 32-bit or 64-bit floats of shape (n, 6), in C order.
fn converted<'py>(made: Bound<'py, PyAny>, which: &str) -> PyResult<Boxes<'py>> {
    if let Some(borrowed) = as_it_lies(&made) {
        return Ok(borrowed);
    }
    let py = made.py();
    let wide = made.cast::<PyArray2<f64>>()?.readonly();
    let rows: &[[f64; 6]] = wide.as_slice()?.as_chunks().0;
    let (boxes, is_exact) = py.detach(|| rounded(rows)).map_err(|why| match why {
        Error::InvalidBox { index, defect } => invalid_box(py, which, index, defect),
        error => exception(py, &error, which),
    })?;
    Ok(Boxes::Rounded(boxes, (!is_exact).then_some(wide)))
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

/// Rounds boxes of 64-bit floats outward. Returns them, and whether every bound stayed the same. Defects are checked
/// before, because rounding may hide an inverted box.
fn rounded(rows: &[[f64; 6]]) -> Result<(Vec<Aabb>, bool), Error> {
    let mut boxes = Vec::new();
    boxes.try_reserve_exact(rows.len()).map_err(|_| Error::OutOfMemory { what: "boxes", elements: rows.len() })?;
    let mut is_exact = true;
    for (index, &[a, b, c, d, e, f]) in rows.iter().enumerate() {
        let (min, max) = ([a, b, c], [d, e, f]);
        if !(0..3).all(|axis| min[axis] <= max[axis]) {
            let nan = rows[index].iter().any(|v| v.is_nan());
            let defect = if nan { BoxDefect::NotANumber } else { BoxDefect::Inverted };
            return Err(Error::InvalidBox { index, defect });
        }
        let aabb = Aabb::from_f64(min, max);
        is_exact &= aabb.min.map(f64::from) == min && aabb.max.map(f64::from) == max;
        boxes.push(aabb);
    }
    Ok((boxes, is_exact))
}
