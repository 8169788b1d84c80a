//! A glance at a frame: what a few hundred of its boxes tell about all of them.

use crate::Aabb;

/// Boxes looked at, at most. 256 boxes give 32 640 pairs: an axis on which 1 % of the pairs overlap is then known to
/// about 10 %, and the glance takes microseconds.
const SAMPLE: usize = 256;

/// Boxes looked at, at least: the quantile of the extents needs a few.
const SMALLEST_SAMPLE: usize = 32;

/// Statistics of an evenly spaced sample of boxes. Infinite bounds are clamped before they enter any sum.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sample {
    /// Mean of the centres on each axis.
    pub(crate) mean: [f64; 3],
    /// Standard deviation of the centres on each axis.
    pub(crate) deviation: [f64; 3],
    /// Lowest minimum in the sample on each axis.
    pub(crate) low: [f64; 3],
    /// Highest minimum in the sample on each axis.
    pub(crate) high: [f64; 3],
    /// The extent that nine boxes in ten do not exceed, on each axis.
    pub(crate) extent: [f64; 3],
    /// Share of the pairs whose intervals overlap, on each axis.
    pub(crate) overlap: [f64; 3],
}

/// Beyond this a bound counts as this: squares and sums of clamped values stay finite in `f64`.
const CLAMP: f64 = 1.0e30;

impl Sample {
    /// Looks at up to 256 boxes without the pair counts of [`Sample::with_overlaps`].
    pub(crate) fn of(boxes: &[Aabb]) -> Self {
        let (chosen, count) = choose(boxes);
        Self::statistics(&chosen[..count])
    }

    /// Looks at up to 256 boxes and counts the pairs among them that overlap on each axis.
    pub(crate) fn with_overlaps(boxes: &[Aabb]) -> Self {
        let (chosen, count) = choose(boxes);
        let chosen = &chosen[..count];
        let mut sample = Self::statistics(chosen);
        let pairs = (count * count.saturating_sub(1) / 2).max(1) as f64;
        for axis in 0..3 {
            let mut low = [0.0_f32; SAMPLE];
            let mut high = [0.0_f32; SAMPLE];
            for (k, b) in chosen.iter().enumerate() {
                low[k] = b.min[axis];
                high[k] = b.max[axis];
            }
            let mut hits = 0_u32;
            for i in 1..count {
                let (l, h) = (low[i], high[i]);
                // A sum over two slices without a branch: the compiler turns it into vector comparisons.
                hits += low[..i].iter().zip(&high[..i]).map(|(&a, &b)| u32::from(a <= h) & u32::from(l <= b)).sum::<u32>();
            }
            sample.overlap[axis] = f64::from(hits) / pairs;
        }
        sample
    }

    /// The axis on which the centres spread most.
    pub(crate) fn widest_axis(&self) -> usize {
        (0..3).max_by(|&a, &b| self.deviation[a].total_cmp(&self.deviation[b])).unwrap_or(0)
    }

    fn statistics(boxes: &[Aabb]) -> Self {
        let mut sample = Self::default();
        if boxes.is_empty() {
            return sample;
        }
        let count = boxes.len() as f64;
        for axis in 0..3 {
            let bound = |v: f32| f64::from(v).clamp(-CLAMP, CLAMP);
            let mut extents = [0.0_f64; SAMPLE];
            let (mut sum, mut square, mut low, mut high) = (0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
            // Sums are taken from the first centre: far from the origin they would cancel otherwise.
            let origin = (bound(boxes[0].min[axis]) + bound(boxes[0].max[axis])) / 2.0;
            for (b, extent) in boxes.iter().zip(&mut extents) {
                let (min, max) = (bound(b.min[axis]), bound(b.max[axis]));
                let centre = (min + max) / 2.0 - origin;
                sum += centre;
                square += centre * centre;
                low = f64::min(low, min);
                high = f64::max(high, min);
                *extent = max - min;
            }
            let mean = sum / count;
            sample.mean[axis] = mean + origin;
            sample.deviation[axis] = (square / count - mean * mean).max(0.0).sqrt();
            sample.low[axis] = low;
            sample.high[axis] = high;
            let rank = boxes.len() * 9 / 10;
            sample.extent[axis] = *extents[..boxes.len()].select_nth_unstable_by(rank, f64::total_cmp).1;
        }
        sample
    }
}

/// Evenly spaced boxes, skipping invalid ones: this runs before the input is checked.
fn choose(boxes: &[Aabb]) -> ([Aabb; SAMPLE], usize) {
    let mut chosen = [Aabb::default(); SAMPLE];
    let mut count = 0;
    // Twice the root of the count: the cost of the glance stays a small share of the frame's at every size, while the
    // share of overlapping pairs, which falls with the count, stays countable.
    let wanted = boxes.len().min((2 * boxes.len().isqrt()).clamp(SMALLEST_SAMPLE, SAMPLE));
    for k in 0..wanted {
        // One box from the middle of each of `wanted` equal parts; u64 because the product passes 32 bits.
        let at = ((2 * k as u64 + 1) * boxes.len() as u64 / (2 * wanted as u64)) as usize;
        if boxes[at].defect().is_none() {
            chosen[count] = boxes[at];
            count += 1;
        }
    }
    (chosen, count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_frame_and_an_invalid_one_give_zeros() {
        assert_eq!(Sample::of(&[]).extent, [0.0; 3]);
        assert_eq!(Sample::with_overlaps(&[Aabb::cube([f32::NAN; 3], 1.0)]).overlap, [0.0; 3]);
    }

    #[test]
    fn a_row_of_boxes_spreads_on_its_axis() {
        let boxes: Vec<Aabb> = (0..1000).map(|k| Aabb::cube([0.0, 10.0 * k as f32, 5.0], 0.5)).collect();
        let sample = Sample::with_overlaps(&boxes);
        assert_eq!(sample.widest_axis(), 1);
        assert_eq!(sample.extent, [1.0; 3]);
        assert_eq!(sample.overlap, [1.0, 0.0, 1.0]);
        // Evenly spaced over 10 000: deviation = length / sqrt(12).
        assert!((sample.deviation[1] - 2886.75).abs() < 30.0, "{}", sample.deviation[1]);
    }

    #[test]
    fn infinite_boxes_leave_every_figure_finite() {
        let inf = f32::INFINITY;
        let boxes = [Aabb::new([-inf; 3], [inf; 3]), Aabb::new([inf; 3], [inf; 3]), Aabb::cube([0.0; 3], 1.0)];
        let sample = Sample::with_overlaps(&boxes);
        let all = [sample.mean, sample.deviation, sample.low, sample.high, sample.extent, sample.overlap];
        assert!(all.iter().flatten().all(|v| v.is_finite()), "{sample:?}");
    }
}
