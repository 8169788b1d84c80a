//! What is known about a frame before it runs.

mod displacement;
mod plan;
mod sample;
mod strip_grid;

use crate::aabb::Aabb;

pub use displacement::Displacement;
pub(crate) use displacement::{is_same_pace, paces_apart_ln};
pub use plan::FramePlan;
pub(crate) use sample::{Chosen, Sample};
pub(crate) use strip_grid::{StripGrid, StripSpan};

/// The figures of a frame that decide what each algorithm costs, all known from a sample and the frame before.
///
/// The count alone is a poor switch: between uniform and clustered scenes measured borders move by a factor of five.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Load {
    /// Boxes in the frame.
    pub objects: u32,
    /// Pairs that overlap on the axis on which the fewest do: what a sweep along that axis has to test.
    pub axis_candidates: f64,
    /// Pairs that overlap on that axis and share a strip of the grid over the other two.
    pub strip_candidates: f64,
    /// Overlapping pairs: those of the frame before where there is one, else a guess from the sample.
    pub pairs: f64,
    /// How far the boxes move in a frame ([`Displacement::moved`](crate::Displacement::moved)): the mean over a sample of the
    /// greatest displacement of a bound since the frame before, in mean edges of the box and no more than 1 each. 0: nothing
    /// moves. 1: no frame helps with the next, and so it is where no frame before is known.
    pub moved: f64,
}

impl Load {
    /// A frame of this many boxes of which nothing else is known: no pair, and none of them moves.
    #[must_use]
    pub fn of_objects(objects: u32) -> Self {
        Self { objects, ..Self::default() }
    }

    /// Whether a frame of another load takes about as long, to that share: counts differ by no more than that share of themselves and of the
    /// objects, each of which takes as long as some pairs.
    pub(crate) fn is_within(&self, share: f64, other: &Self) -> bool {
        let objects = f64::from(self.objects);
        let counts = |l: &Self| [f64::from(l.objects), l.axis_candidates, l.strip_candidates, l.pairs];
        // False for NaN.
        let near = |(a, b): (f64, f64)| (a - b).abs() <= share * (a + objects);
        counts(self).into_iter().zip(counts(other)).all(near) && (self.moved - other.moved).abs() <= share * self.moved
    }

    /// The same with this many overlapping pairs.
    #[must_use]
    pub fn with_pairs(self, pairs: f64) -> Self {
        Self { pairs, ..self }
    }

    /// The same with this many candidates: pairs that overlap on one axis, and those of them that share a strip.
    #[must_use]
    pub fn with_candidates(self, axis: f64, strip: f64) -> Self {
        Self { axis_candidates: axis, strip_candidates: strip, ..self }
    }

    /// The same with boxes that move so far in a frame.
    #[must_use]
    pub fn with_moved(self, moved: f64) -> Self {
        Self { moved, ..self }
    }

    /// Whether every figure is finite and none negative.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        [self.axis_candidates, self.strip_candidates, self.pairs, self.moved].iter().all(|v| v.is_finite() && *v >= 0.0)
    }

    /// Estimates the load of a frame from up to 256 of its boxes, in a time that does not grow beyond 16 000 objects.
    ///
    /// `pairs` is the number of pairs of the frame before and `moved` how far the boxes have moved since, if there was one.
    #[must_use]
    pub fn estimate(boxes: &[Aabb], pairs: Option<f64>, moved: Option<f64>) -> Self {
        Self::planned(boxes, pairs, moved).0
    }

    /// As [`estimate`](Self::estimate), with the plan of the frame that follows from the same sample.
    pub(crate) fn planned(boxes: &[Aabb], pairs: Option<f64>, moved: Option<f64>) -> (Self, FramePlan) {
        let chosen = Chosen::from(boxes);
        let (plan, sample, grid) = FramePlan::seen(&chosen, boxes.len());
        let n = boxes.len() as f64;
        let all = n * (n - 1.0).max(0.0) / 2.0;
        let (axis, shares) = (sample.sweep_axis(), sample.shares);
        let axis_candidates = shares[axis] * all;
        // Independence of the axes is wrong for clusters, but the frame before corrects it from the second frame on.
        let independent = shares.iter().product::<f64>() * all;
        let pairs = pairs.unwrap_or(independent);
        let strip_candidates = if grid.strips() == 1 {
            axis_candidates
        } else {
            strip_share(&chosen, &grid, shares[axis], pairs / independent.max(1.0)) * all
        };
        let strip_candidates = strip_candidates.max(pairs).min(axis_candidates.max(pairs));
        (
            Self { objects: boxes.len() as u32, axis_candidates, strip_candidates, pairs, moved: moved.unwrap_or(1.0) },
            plan,
        )
    }

    /// The load of a frame that looks and moves like this one but has another number of objects and pairs.
    #[must_use]
    pub fn rescaled(&self, objects: u32, pairs: f64) -> Self {
        let growth = if self.objects > 0 { f64::from(objects) / f64::from(self.objects) } else { 1.0 };
        let axis_candidates = self.axis_candidates * growth * growth;
        let strip_candidates = (self.strip_candidates * growth).min(axis_candidates);
        Self { objects, axis_candidates, strip_candidates, pairs, moved: self.moved }
    }
}

/// The share of all pairs that overlap on the sweep axis and share a strip.
///
/// Counted in the sample where it is large enough to be counted. In a large scene it is not; there the three axes are taken to
/// be independent, and the clumping that the pairs of the frame before show is taken to hold at the width of a cell by half.
/// The two are joined like a Poisson count with a gamma prior of shape 4.
fn strip_share(chosen: &Chosen, grid: &StripGrid, axis_share: f64, clumping: f64) -> f64 {
    const SHAPE: f64 = 4.0;
    let cells = |b: &Aabb| grid.cells_of(b);
    let across = [0, 1].map(|d| chosen.share_of_pairs(|b| [cells(b)[d]]));
    let expected = axis_share * across[0] * across[1] * clumping.max(1.0).sqrt();
    let counted = chosen.share_of_pairs(|b| {
        let [y, z] = cells(b);
        [(b.min[grid.axis], b.max[grid.axis]), y, z]
    });
    let count = chosen.as_slice().len() as f64;
    let pairs = count * (count - 1.0) / 2.0;
    if expected > 0.0 { (SHAPE + counted * pairs) / (SHAPE / expected + pairs) } else { counted }
}
