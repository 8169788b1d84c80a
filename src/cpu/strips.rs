//! Strips.
use crate::sample::Sample;

/// The two grid axes and the width of a cell on each, for a sweep along `axis`.
pub(crate) fn strip_cells(sample: &Sample, objects: usize, axis: usize) -> [(usize, f64); 2] {
    let axes = [(axis + 1) % 3, (axis + 2) % 3];
    let _ = (sample, objects);
    axes.map(|a| (a, 1.0))
}
