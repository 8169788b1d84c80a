//! The load of a frame: the counts that decide the cost of each algorithm.

mod displacement;
mod plan;
mod sampled_boxes;
mod scene_stats;
mod strip_grid;

use crate::{Aabb, mix};

pub(crate) use displacement::is_same_pace;
pub use displacement::{Displacement, Motion};
pub use plan::FramePlan;
pub use sampled_boxes::SampledBoxes;
pub use scene_stats::SceneStats;
pub use strip_grid::StripGrid;
pub(crate) use strip_grid::StripSpan;

/// The counts of a frame that decide the cost of each algorithm, estimated from a sample and the previous frame.
///
/// The number of boxes alone decides badly: measured crossovers differ by a factor of five between uniform and
/// clustered scenes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Load {
    /// Boxes in the frame.
    pub objects: u32,
    /// Pairs that overlap on the axis on which the fewest do: the tests of a sweep along that axis.
    pub axis_candidates: f64,
    /// Pairs that overlap on that axis and share a strip of the grid over the other two.
    pub strip_candidates: f64,
    /// Overlapping pairs: those of the previous frame, or an estimate from the sample if there is none.
    pub pairs: f64,
    /// Motion in a frame, 0 to 1, as [`Displacement::motion`](crate::algorithm::Displacement::motion) returns it: the
    /// mean over a sample of the greatest displacement of a bound since the previous frame, in mean edges of the box,
    /// at most 1 each. 0: nothing moves. 1: no frame helps with the next, or the previous frame is unknown.
    pub moved: f64,
    /// Share of the boxes of that sample that moved by more than a tenth of a mean edge, 0 to 1. 1 if the previous
    /// frame is unknown.
    pub moved_share: f64,
}

impl Load {
    /// Makes the load of a frame of `objects` boxes without pairs and without motion.
    ///
    /// ```
    /// use sapwise::algorithm::Load;
    ///
    /// let load = Load::of_objects(1000).with_pairs(450.0);
    /// assert_eq!((load.objects, load.pairs), (1000, 450.0));
    /// ```
    pub fn of_objects(objects: u32) -> Self {
        Self { objects, ..Self::default() }
    }

    /// Returns the load with this many overlapping pairs.
    #[must_use]
    pub fn with_pairs(self, pairs: f64) -> Self {
        Self { pairs, ..self }
    }

    /// Returns the load with this many candidates: pairs that overlap on the sweep axis, and those of them that share a
    /// strip.
    #[must_use]
    pub fn with_candidates(self, axis: f64, strip: f64) -> Self {
        Self { axis_candidates: axis, strip_candidates: strip, ..self }
    }

    /// Returns the load with this [motion](Self::moved).
    #[must_use]
    pub fn with_moved(self, moved: f64) -> Self {
        Self { moved, ..self }
    }

    /// Returns the load with this [share of moved boxes](Self::moved_share).
    #[must_use]
    pub fn with_moved_share(self, moved_share: f64) -> Self {
        Self { moved_share, ..self }
    }

    pub(crate) fn with_motion(self, Motion { moved, moved_share }: Motion) -> Self {
        Self { moved, moved_share, ..self }
    }

    /// Returns whether every number is finite and none is negative.
    pub fn is_sound(&self) -> bool {
        let Self { objects: _, axis_candidates, strip_candidates, pairs, moved, moved_share } = *self;
        [axis_candidates, strip_candidates, pairs, moved, moved_share].iter().all(|v| v.is_finite() && *v >= 0.0)
    }

    /// Estimates the load of a frame from up to 256 of its boxes, in a time that is constant above 16 000 boxes.
    ///
    /// `pairs` is the number of pairs of the previous frame, and `motion` that since; both `None` if there was none.
    pub fn estimate(boxes: &[Aabb], pairs: Option<f64>, motion: Option<Motion>) -> Self {
        Self::planned(boxes, pairs, motion).0
    }

    /// Estimates the load and the plan of a frame from the same sample.
    pub fn planned(boxes: &[Aabb], pairs: Option<f64>, motion: Option<Motion>) -> (Self, FramePlan) {
        let sample = SampledBoxes::from(boxes);
        let (plan, stats, grid) = FramePlan::of_sample(&sample, boxes.len());
        let n = boxes.len() as f64;
        let all = n * (n - 1.0).max(0.0) / 2.0;
        let (axis, shares) = (stats.sweep_axis(), stats.shares);
        let axis_candidates = shares[axis] * all;
        // Assumes independent axes, which is wrong for clusters. From the second frame on the number of pairs is known.
        let independent = shares.iter().product::<f64>() * all;
        let pairs = pairs.unwrap_or(independent);
        let strip_candidates = if grid.strips() == 1 {
            axis_candidates
        } else {
            strip_share(&sample, &grid, shares[axis], pairs / independent.max(1.0)) * all
        };
        let strip_candidates = strip_candidates.max(pairs).min(axis_candidates.max(pairs));
        let load = Self::of_objects(boxes.len() as u32)
            .with_candidates(axis_candidates, strip_candidates)
            .with_pairs(pairs)
            .with_motion(motion.unwrap_or(Motion::MOST));
        (load, plan)
    }

    /// Returns the load of a similar frame with another number of objects and pairs.
    #[must_use]
    pub fn rescaled(&self, objects: u32, pairs: f64) -> Self {
        let growth = if self.objects > 0 { f64::from(objects) / f64::from(self.objects) } else { 1.0 };
        let axis_candidates = self.axis_candidates * growth * growth;
        let strip_candidates = (self.strip_candidates * growth).min(axis_candidates);
        Self { objects, axis_candidates, strip_candidates, pairs, ..*self }
    }
}

/// Returns one position of each of `parts` equal parts of `0..count`, at a random place: boxes of a kind may follow
/// each other at regular distances, and an even spacing could meet all or none of them.
fn one_of_each(count: usize, parts: usize, seed: u64) -> impl Iterator<Item = usize> {
    let start = move |k: usize| (k as u64 * count as u64 / parts as u64) as usize;
    (0..parts).map(move |k| start(k) + (mix(seed ^ k as u64) % (start(k + 1) - start(k)) as u64) as usize)
}

/// Estimates the share of all pairs that overlap on the sweep axis and share a strip.
///
/// The sample counts it, but in a large scene it counts too few. There the expected share assumes independent axes,
/// times the root of the clumping that the pairs of the previous frame show. A gamma prior of shape 4 around the
/// expected share joins the two, as for a Poisson count.
fn strip_share(sample: &SampledBoxes, grid: &StripGrid, axis_share: f64, clumping: f64) -> f64 {
    const SHAPE: f64 = 4.0;
    let cells = |b: &Aabb| grid.cells_of(b);
    let across = [0, 1].map(|d| sample.share_of_pairs(|b| [cells(b)[d]]));
    let expected = axis_share * across[0] * across[1] * clumping.max(1.0).sqrt();
    let counted = sample.share_of_pairs(|b| {
        let [y, z] = cells(b);
        [(b.min[grid.axis], b.max[grid.axis]), y, z]
    });
    let count = sample.as_slice().len() as f64;
    let pairs = count * (count - 1.0) / 2.0;
    if expected > 0.0 { (SHAPE + counted * pairs) / (SHAPE / expected + pairs) } else { counted }
}
