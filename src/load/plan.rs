//! What is known of a frame before its pairs are searched.

use super::sample::{Chosen, Sample};
use super::strip_grid::StripGrid;
use crate::aabb::Aabb;

/// What was worked out about a frame to choose an algorithm, handed on to the one that runs it:
/// [`BroadPhase::find_pairs_with`](crate::BroadPhase::find_pairs_with).
///
/// An algorithm works out itself what is not known. The default knows nothing.
#[derive(Debug, Clone, Default)]
pub struct FramePlan {
    seen: Option<(Sample, StripGrid)>,
    moved: Option<f64>,
    pairs: Option<f64>,
}

impl FramePlan {
    /// The sample of a frame and the grid laid for it.
    pub(super) fn seen(chosen: &Chosen, objects: usize) -> (Self, Sample, StripGrid) {
        let sample = Sample::statistics(chosen);
        let grid = StripGrid::plan(&sample, objects);
        (Self { seen: Some((sample, grid)), ..Self::default() }, sample, grid)
    }

    /// The same plan of a frame in which the boxes moved so far.
    pub(crate) fn with_moved(self, moved: Option<f64>) -> Self {
        Self { moved, ..self }
    }

    /// The same plan of a frame in which about so many pairs overlap.
    pub(crate) fn with_pairs(self, pairs: Option<f64>) -> Self {
        Self { pairs, ..self }
    }

    /// How far the boxes move from a frame to the next, where that is known: [`Displacement::moved`](crate::Displacement::moved) of this
    /// frame, or of one not long before.
    #[must_use]
    pub fn moved(&self) -> Option<f64> {
        self.moved
    }

    /// How many pairs overlap in a frame, where that is known of one not long before.
    #[must_use]
    pub fn pairs(&self) -> Option<f64> {
        self.pairs
    }

    /// The sample of this frame.
    pub(crate) fn sample(&self, boxes: &[Aabb]) -> Sample {
        self.seen.map_or_else(|| Sample::of(boxes), |(sample, _)| sample)
    }

    /// The grid for this frame.
    pub(crate) fn grid(&self, boxes: &[Aabb]) -> StripGrid {
        self.seen.map_or_else(|| StripGrid::plan(&Sample::of(boxes), boxes.len()), |(_, grid)| grid)
    }
}
