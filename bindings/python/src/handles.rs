//! Handles of a space as arrays of NumPy.

use crate::call;
use crate::error::stale;
use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use sapwise::{Error, Handle, Space};

/// Takes one handle or several.
pub(crate) fn handles(given: &Bound<'_, PyAny>) -> PyResult<Vec<Handle>> {
    let py = given.py();
    // Subclasses are converted, which refuses masked arrays.
    let plain = given.get_type().is(py.get_type::<PyUntypedArray>());
    let array = match given.cast::<PyArray1<u64>>() {
        Ok(array) if plain && array.is_c_contiguous() && array.data().is_aligned() => array.clone(),
        _ => call(py, "sapwise._arrays", "handles", (given,))?.cast_into::<PyArray1<u64>>()?,
    };
    let array = array.try_readonly()?;
    let numbers = array.as_slice()?;
    // Collected into a result, the list would grow step by step.
    let mut handles = Vec::with_capacity(numbers.len());
    for (index, &bits) in numbers.iter().enumerate() {
        handles.push(Handle::from_bits(bits).ok_or_else(|| stale(py, index, bits))?);
    }
    Ok(handles)
}

/// Makes the exception for the first handle without a body.
pub(crate) fn first_stale(py: Python<'_>, handles: &[Handle], of: Handle) -> PyErr {
    stale(py, handles.iter().position(|&handle| handle == of).unwrap_or(0), of.to_bits())
}

/// Returns the first handle that names no body.
pub(crate) fn check(space: &Space, handles: &[Handle]) -> Result<(), Error> {
    let stale = handles.iter().find(|&&handle| !space.contains(handle));
    stale.map_or(Ok(()), |&handle| Err(Error::StaleHandle { handle }))
}

/// Makes an array of handles.
pub(crate) fn array(py: Python<'_>, handles: impl IntoIterator<Item = Handle>) -> Bound<'_, PyArray1<u64>> {
    handles.into_iter().map(Handle::to_bits).collect::<Vec<u64>>().into_pyarray(py)
}

/// Returns the bits of the handles of these pairs, two each.
pub(crate) fn bits(pairs: &[(Handle, Handle)]) -> Vec<u64> {
    pairs.iter().flat_map(|&(a, b)| [a.to_bits(), b.to_bits()]).collect()
}
