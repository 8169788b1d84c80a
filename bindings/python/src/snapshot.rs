//! The pickles of spaces: the library's snapshot in the format of postcard.

use crate::space::PySpace;
use crate::{Held, PyTuning, Start, failed, unusable};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sapwise::Space;

/// Begins a snapshot. The number rises with its layout.
const HEAD: &[u8] = b"sapwise space 2\n";

/// Returns what `pickle` keeps of a space: `restored_space` and its arguments.
pub(crate) fn reduced<'py>(py: Python<'py>, held: &Held<Space>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let written = held.read(py, |space| postcard::to_extend(space, HEAD.to_vec()))?;
    let bytes = written.map_err(|why| failed(py, format!("no snapshot of the space: {why}")))?;
    let Start { threads, learning, exploring, limit, .. } = held.start;
    let arguments = (PyBytes::new(py, &bytes), held.tuning(py)?, threads, learning, exploring, limit);
    Ok((py.import("sapwise._sapwise")?.getattr("restored_space")?, arguments.into_pyobject(py)?.into_any()))
}

/// Makes a space from what ``Space.__reduce__`` has returned.
#[pyfunction]
pub(crate) fn restored_space<'py>(
    py: Python<'py>,
    snapshot: &[u8],
    tuning: &PyTuning,
    threads: Option<u32>,
    learning: bool,
    exploring: bool,
    limit: Option<usize>,
) -> PyResult<Bound<'py, PySpace>> {
    let Some(snapshot) = snapshot.strip_prefix(HEAD) else {
        return Err(unusable(py, "this is no snapshot of a Space of this version; pickle the space again"));
    };
    let restored: Space = py
        .detach(|| postcard::from_bytes(snapshot))
        .map_err(|why| unusable(py, format!("the snapshot is damaged: {why}; pickle the space again")))?;
    let start = Start { threads, learning, exploring, limit, ..Start::new(None, false, false, Some(tuning), None)? };
    let made = PySpace::initial(py, start, |adaptive| {
        let mut space = Space::with(adaptive);
        space.clone_from(&restored);
        space
    })?;
    Bound::new(py, made)
}
