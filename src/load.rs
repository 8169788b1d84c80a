//! What is known about a frame before it runs.

use crate::Aabb;
use crate::cpu::StripGrid;
use crate::sample::Sample;

/// The figures of a frame that decide what each algorithm costs, all known from a sample and the frame before.
///
/// The count alone is a poor switch: between uniform and clustered scenes measured borders move by a factor of five.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Load {
    /// Boxes in the frame.
    pub objects: u32,
    /// Pairs that overlap on the axis of greatest variance: what a sweep along that axis has to test.
    pub axis_candidates: f64,
    /// Pairs that overlap on that axis and share a strip of the grid over the other two.
    pub strip_candidates: f64,
    /// Overlapping pairs: those of the frame before where there is one, else a guess from the sample.
    pub pairs: f64,
    /// Share of the boxes that changed since the frame before, 0 to 1; 1 where there is none.
    pub moved: f64,
}

impl Load {
    /// Estimates the load of a frame from up to 256 of its boxes, in a few microseconds at any number of objects.
    ///
    /// `pairs` is the number of pairs of the frame before, if there was one.
    #[must_use]
    pub fn estimate(boxes: &[Aabb], pairs: Option<f64>) -> Self {
        let sample = Sample::with_overlaps(boxes);
        Self::from_sample(&sample, boxes.len(), pairs)
    }

    /// The load of a frame that looks like this one but has another number of objects and pairs.
    #[must_use]
    pub fn rescaled(&self, objects: u32, pairs: f64) -> Self {
        let ratio = |now: f64, then: f64| if then > 0.0 { now / then } else { 1.0 };
        let growth = ratio(f64::from(objects), f64::from(self.objects));
        let axis_candidates = self.axis_candidates * growth * growth;
        let strip_candidates = (self.strip_candidates * ratio(pairs, self.pairs)).min(axis_candidates);
        Self { objects, axis_candidates, strip_candidates, pairs, moved: self.moved }
    }

    fn from_sample(sample: &Sample, objects: usize, pairs: Option<f64>) -> Self {
        let n = objects as f64;
        let all = n * (n - 1.0).max(0.0) / 2.0;
        let axis = sample.widest_axis();
        let axis_candidates = sample.overlap[axis] * all;
        // Independence of the axes is wrong for clusters, but the frame before corrects it from the second frame on.
        let guess = sample.overlap.iter().product::<f64>() * all;
        let pairs = pairs.unwrap_or(guess);
        let strip_candidates = strip_candidates(sample, objects, pairs).min(axis_candidates).max(pairs.min(axis_candidates));
        Self { objects: objects as u32, axis_candidates, strip_candidates, pairs, moved: 1.0 }
    }
}

/// Two boxes meet in a strip when they overlap after each is widened to whole cells, by half a cell at either end on
/// average. So candidates exceed pairs by the ratio of a widened to a plain interval on each of the two grid axes.
fn strip_candidates(sample: &Sample, objects: usize, pairs: f64) -> f64 {
    let widening = |(axis, width): (usize, f64)| {
        // A single cell spans everything that overlaps on no axis too.
        let width = width.min(sample.high[axis] - sample.low[axis] + sample.extent[axis]);
        if width > 0.0 { 1.0 + width / (2.0 * sample.extent[axis]).max(width * 1e-3) } else { 1.0 }
    };
    pairs * StripGrid::plan(sample, objects).widths().map(widening).iter().product::<f64>()
}
