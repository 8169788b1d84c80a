//! What the choice of an algorithm has worked out about a frame.

use super::sampled_boxes::SampledBoxes;
use super::scene_stats::SceneStats;
use super::strip_grid::StripGrid;
use crate::Aabb;

/// What the choice of an algorithm has worked out about a frame, for the algorithm that runs it:
/// [`BroadPhase::find_pairs_with`](crate::BroadPhase::find_pairs_with).
///
/// An algorithm works out the rest itself. The default plan is empty.
#[derive(Debug, Clone, Default)]
pub struct FramePlan {
    stats: Option<(SceneStats, StripGrid)>,
    moved: Option<f64>,
    pairs: Option<f64>,
}

impl FramePlan {
    /// Makes a plan with the statistics of a sample and the grid for them.
    pub(super) fn of_sample(sample: &SampledBoxes, objects: usize) -> (Self, SceneStats, StripGrid) {
        let stats = SceneStats::of_sample(sample);
        let grid = StripGrid::plan(&stats, objects);
        (Self { stats: Some((stats, grid)), ..Self::default() }, stats, grid)
    }

    /// Returns the plan with this motion.
    pub fn with_moved(self, moved: Option<f64>) -> Self {
        Self { moved, ..self }
    }

    /// Returns the plan with about this many overlapping pairs.
    pub fn with_pairs(self, pairs: Option<f64>) -> Self {
        Self { pairs, ..self }
    }

    /// Returns the motion in a frame, [`Motion::moved`](crate::algorithm::Motion::moved) of this frame or of a recent
    /// one; `None` if unknown.
    pub fn moved(&self) -> Option<f64> {
        self.moved
    }

    /// Returns the number of overlapping pairs in a recent frame; `None` if unknown.
    pub fn pairs(&self) -> Option<f64> {
        self.pairs
    }

    /// Returns the statistics of this frame.
    pub fn stats(&self, boxes: &[Aabb]) -> SceneStats {
        self.stats.map_or_else(|| SceneStats::of(boxes), |(stats, _)| stats)
    }

    /// Returns the grid for this frame.
    pub fn grid(&self, boxes: &[Aabb]) -> StripGrid {
        self.stats.map_or_else(|| StripGrid::plan(&SceneStats::of(boxes), boxes.len()), |(_, grid)| grid)
    }
}
