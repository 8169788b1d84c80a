//! A glance at a frame: what a few hundred of its boxes tell about all of them.

use crate::aabb::Aabb;

/// Boxes looked at, at most. 256 boxes give 32 640 pairs: an axis on which 1 % of the pairs overlap is then known to
/// about 10 %.
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
}

/// Beyond this a bound counts as this: squares and sums of clamped values stay finite in `f64`.
const CLAMP: f64 = 1.0e30;

impl Sample {
    /// Looks at up to 256 boxes.
    pub(crate) fn of(boxes: &[Aabb]) -> Self {
        Self::statistics(&Chosen::from(boxes))
    }

    /// The statistics of boxes that were chosen elsewhere, of up to 256 of them.
    #[cfg(feature = "gpu")]
    pub(crate) fn of_all(boxes: &[Aabb]) -> Self {
        let mut chosen = Chosen { boxes: [Aabb::default(); SAMPLE], count: 0 };
        for b in boxes.iter().filter(|b| b.defect().is_none()).take(SAMPLE) {
            chosen.boxes[chosen.count] = *b;
            chosen.count += 1;
        }
        Self::statistics(&chosen)
    }

    /// Where cells of a grid on this axis begin, and how much length they share.
    pub(crate) fn range(&self, axis: usize) -> (f64, f64) {
        // Three deviations hold all of a uniform scene and leave out far outliers, which the border cells take.
        let low = self.low[axis].max(self.mean[axis] - 3.0 * self.deviation[axis]);
        let high = self.high[axis].min(self.mean[axis] + 3.0 * self.deviation[axis]);
        (low, (high - low).max(0.0))
    }

    /// The axis on which the centres spread most.
    pub(crate) fn widest_axis(&self) -> usize {
        (0..3).max_by(|&a, &b| self.deviation[a].total_cmp(&self.deviation[b])).unwrap_or(0)
    }

    /// The statistics of boxes that were chosen already.
    pub(crate) fn statistics(chosen: &Chosen) -> Self {
        let boxes = chosen.as_slice();
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

/// Evenly spaced boxes of a frame, without the invalid ones: a glance is taken before the input is checked.
pub(crate) struct Chosen {
    boxes: [Aabb; SAMPLE],
    count: usize,
}

impl Chosen {
    pub(crate) fn from(boxes: &[Aabb]) -> Self {
        let mut chosen = Self { boxes: [Aabb::default(); SAMPLE], count: 0 };
        // Twice the root of the count: the cost of the glance stays a small share of the frame's at every size, while the
        // share of overlapping pairs, which falls with the count, stays countable.
        let wanted = boxes.len().min((2 * boxes.len().isqrt()).clamp(SMALLEST_SAMPLE, SAMPLE));
        for k in 0..wanted {
            // One box from the middle of each of `wanted` equal parts; u64 because the product passes 32 bits.
            let at = ((2 * k as u64 + 1) * boxes.len() as u64 / (2 * wanted as u64)) as usize;
            if boxes[at].defect().is_none() {
                chosen.boxes[chosen.count] = boxes[at];
                chosen.count += 1;
            }
        }
        chosen
    }

    pub(crate) fn as_slice(&self) -> &[Aabb] {
        &self.boxes[..self.count]
    }

    /// For each chosen box what `interval` says of it, then the share of all pairs whose intervals meet; the ends belong to
    /// the intervals.
    pub(crate) fn share_of_pairs<const N: usize, T: PartialOrd + Copy + Default>(
        &self,
        interval: impl Fn(&Aabb) -> [(T, T); N],
    ) -> f64 {
        let count = self.count;
        let (mut low, mut high) = ([[T::default(); SAMPLE]; N], [[T::default(); SAMPLE]; N]);
        for (k, b) in self.as_slice().iter().enumerate() {
            for (axis, (l, h)) in interval(b).into_iter().enumerate() {
                low[axis][k] = l;
                high[axis][k] = h;
            }
        }
        let mut hits = 0_u32;
        for i in 1..count {
            // A sum without a branch: compilers turn it into vector comparisons.
            hits += (0..i)
                .map(|j| {
                    let meet = |a: usize| u32::from(low[a][j] <= high[a][i]) & u32::from(low[a][i] <= high[a][j]);
                    (0..N).map(meet).fold(1, |all, one| all & one)
                })
                .sum::<u32>();
        }
        f64::from(hits) / (count * count.saturating_sub(1) / 2).max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_frame_and_an_invalid_one_give_zeros() {
        assert_eq!(Sample::of(&[]).extent, [0.0; 3]);
        let invalid = [Aabb::cube([f32::NAN; 3], 1.0)];
        assert_eq!(Sample::of(&invalid).extent, [0.0; 3]);
        assert_eq!(Chosen::from(&invalid).share_of_pairs(|b| [(b.min[0], b.max[0])]), 0.0);
    }

    #[test]
    fn a_row_of_boxes_spreads_on_its_axis() {
        let boxes: Vec<Aabb> = (0..1000).map(|k| Aabb::cube([0.0, 10.0 * k as f32, 5.0], 0.5)).collect();
        let sample = Sample::of(&boxes);
        assert_eq!(sample.widest_axis(), 1);
        assert_eq!(sample.extent, [1.0; 3]);
        let chosen = Chosen::from(&boxes);
        let share = |axis: usize| chosen.share_of_pairs(|b| [(b.min[axis], b.max[axis])]);
        assert_eq!([share(0), share(1), share(2)], [1.0, 0.0, 1.0]);
        assert_eq!(chosen.share_of_pairs(|b| [(b.min[0], b.max[0]), (b.min[2], b.max[2])]), 1.0);
        // Evenly spaced over 10 000: deviation = length / sqrt(12).
        assert!((sample.deviation[1] - 2886.75).abs() < 30.0, "{}", sample.deviation[1]);
    }

    #[test]
    fn infinite_boxes_leave_every_figure_finite() {
        let inf = f32::INFINITY;
        let boxes = [Aabb::new([-inf; 3], [inf; 3]), Aabb::new([inf; 3], [inf; 3]), Aabb::cube([0.0; 3], 1.0)];
        let sample = Sample::of(&boxes);
        let all = [sample.mean, sample.deviation, sample.low, sample.high, sample.extent];
        assert!(all.iter().flatten().all(|v| v.is_finite()), "{sample:?}");
    }
}
