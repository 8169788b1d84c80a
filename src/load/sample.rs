//! A glance at a frame: what a few hundred of its boxes tell about all of them.

use crate::aabb::Aabb;
use crate::splitmix::mix;
use std::cmp::Ordering;

/// Boxes looked at, at most. 256 boxes give 32 640 pairs: an axis on which 1 % of the pairs overlap is then known to
/// about 10 %.
const SAMPLE: usize = 256;

/// Boxes looked at, at least: the quantile of the extents needs a few.
const SMALLEST_SAMPLE: usize = 32;

/// Share of the sample on either side that says nothing about where the boxes lie: what is pooled far away or asleep below the floor.
const TAIL: usize = 16;

/// Statistics of a sample of boxes: ranks and counts, which a few boxes anywhere in space don't move.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sample {
    /// Where the middles of most boxes begin on each axis, and the length over which they lie.
    ranges: [(f64, f64); 3],
    /// The extent that nine boxes in ten do not exceed, on each axis.
    pub(crate) extent: [f64; 3],
    /// The share of all pairs that overlap on each axis.
    pub(crate) shares: [f64; 3],
}

/// Beyond this a bound counts as this: differences of clamped values stay finite in `f64`.
const CLAMP: f64 = 1.0e30;

impl Sample {
    /// Looks at up to 256 boxes.
    pub(crate) fn of(boxes: &[Aabb]) -> Self {
        Self::statistics(&Chosen::from(boxes))
    }

    /// Looks at up to 256 of the boxes at these positions.
    pub(crate) fn of_members(boxes: &[Aabb], members: &[u32]) -> Self {
        Self::statistics(&Chosen::among(members.len(), |k| &boxes[members[k] as usize]))
    }

    /// Where cells of a grid on this axis begin, and how much length they share: that of most of the boxes. The cells at its ends take
    /// those that lie beyond.
    pub(crate) fn range(&self, axis: usize) -> (f64, f64) {
        self.ranges[axis]
    }

    /// The axis along which a sweep has the fewest candidates: on which the fewest pairs overlap.
    pub(crate) fn sweep_axis(&self) -> usize {
        // In a large world a sample may hold no pair that overlaps; then the axis on which the boxes are the shortest part of the world.
        let order = |a: usize| (self.shares[a], self.extent[a] / self.ranges[a].1);
        (0..3).min_by(|&a, &b| order(a).partial_cmp(&order(b)).unwrap_or(Ordering::Equal)).unwrap_or(0)
    }

    /// The statistics of boxes that were chosen already.
    pub(crate) fn statistics(chosen: &Chosen) -> Self {
        let boxes = chosen.as_slice();
        let mut sample = Self::default();
        let (count, tail) = (boxes.len(), boxes.len() / TAIL);
        if count == 0 {
            return sample;
        }
        for axis in 0..3 {
            let bound = |v: f32| f64::from(v).clamp(-CLAMP, CLAMP);
            let (mut middles, mut extents) = ([0.0_f64; SAMPLE], [0.0_f64; SAMPLE]);
            for ((b, middle), extent) in boxes.iter().zip(&mut middles).zip(&mut extents) {
                let (min, max) = (bound(b.min[axis]), bound(b.max[axis]));
                *middle = (min + max) / 2.0;
                *extent = max - min;
            }
            let middles = &mut middles[..count];
            let (below, &mut low, above) = middles.select_nth_unstable_by(tail, f64::total_cmp);
            let lowest = below.iter().copied().fold(low, f64::min);
            let last = count - 1 - 2 * tail;
            // `above` begins behind position `tail`.
            let (high, highest) = match last {
                0 => (low, above.iter().copied().fold(low, f64::max)),
                _ => {
                    let (_, &mut high, beyond) = above.select_nth_unstable_by(last - 1, f64::total_cmp);
                    (high, beyond.iter().copied().fold(high, f64::max))
                }
            };
            // An even spread goes on for as long as its share of the sample says.
            let more = if last == 0 { 0.0 } else { (high - low) * tail as f64 / last as f64 };
            let (low, high) = (lowest.max(low - more), highest.min(high + more));
            sample.ranges[axis] = (low, high - low);
            sample.extent[axis] = *extents[..count].select_nth_unstable_by(count * 9 / 10, f64::total_cmp).1;
            sample.shares[axis] = chosen.share_of_pairs(|b| [(b.min[axis], b.max[axis])]);
        }
        sample
    }
}

/// Boxes of a frame, without the invalid ones: a glance is taken before the input is checked.
pub(crate) struct Chosen {
    boxes: [Aabb; SAMPLE],
    count: usize,
}

impl Chosen {
    pub(crate) fn from(boxes: &[Aabb]) -> Self {
        Self::among(boxes.len(), |k| &boxes[k])
    }

    fn among<'a>(count: usize, of: impl Fn(usize) -> &'a Aabb) -> Self {
        let mut chosen = Self { boxes: [Aabb::default(); SAMPLE], count: 0 };
        // Twice the root of the count: the cost of the glance stays a small share of the frame's at every size, while the
        // share of overlapping pairs, which falls with the count, stays countable.
        let wanted = count.min((2 * count.isqrt()).clamp(SMALLEST_SAMPLE, SAMPLE));
        if wanted == 0 {
            return chosen;
        }
        // Others in each frame of a scene in which anything moves, and the same for the same boxes.
        let [x, y, _] = of(count / 2).min.map(f32::to_bits);
        let seed = mix(u64::from(x) << 32 | u64::from(y));
        let start = |k: usize| (k as u64 * count as u64 / wanted as u64) as usize;
        for k in 0..wanted {
            // One box out of each of `wanted` equal parts, at a place that differs from part to part: boxes of a kind may follow each other
            // at regular distances, and an even spacing could meet all of them or none.
            let (first, end) = (start(k), start(k + 1));
            let b = of(first + (mix(seed ^ k as u64) % (end - first) as u64) as usize);
            if b.defect().is_none() {
                chosen.boxes[chosen.count] = *b;
                chosen.count += 1;
            }
        }
        chosen
    }

    /// Boxes that were chosen elsewhere, up to 256 of them.
    #[cfg(feature = "gpu")]
    pub(crate) fn given(boxes: &[Aabb]) -> Self {
        let mut chosen = Self { boxes: [Aabb::default(); SAMPLE], count: 0 };
        for b in boxes.iter().filter(|b| b.defect().is_none()).take(SAMPLE) {
            chosen.boxes[chosen.count] = *b;
            chosen.count += 1;
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
    fn a_row_of_boxes_is_swept_along_itself() {
        let boxes: Vec<Aabb> = (0..1000).map(|k| Aabb::cube([0.0, 10.0 * k as f32, 5.0], 0.5)).collect();
        let sample = Sample::of(&boxes);
        assert_eq!((sample.sweep_axis(), sample.extent, sample.shares), (1, [1.0; 3], [1.0, 0.0, 1.0]));
        let chosen = Chosen::from(&boxes);
        assert_eq!(chosen.share_of_pairs(|b| [(b.min[0], b.max[0]), (b.min[2], b.max[2])]), 1.0);
        let (low, length) = sample.range(1);
        assert!(low.abs() < 600.0 && (length - 10_000.0).abs() < 900.0, "{low} {length}");
        assert_eq!(sample.range(0), (0.0, 0.0));
    }

    #[test]
    fn boxes_far_away_move_neither_the_axis_nor_the_ranges() {
        let at = |k: u64, a: u64| (mix(3 * k + a) % 10_000) as f32;
        let near = |k: u64| Aabb::cube([at(k, 0) / 10.0, at(k, 1) / 100.0, at(k, 2) / 100.0], 0.5);
        let scene = |far: f32| -> Vec<Aabb> {
            let pooled = |k: u64| Aabb::cube([500.0, -far, 50.0], 0.5 + k as f32 * 1e-6);
            (0..20_000).map(|k| if k % 50 == 7 { pooled(k) } else { near(k) }).collect()
        };
        for far in [0.0, 4.0e6, 1.0e38] {
            let sample = Sample::of(&scene(far));
            assert_eq!(sample.sweep_axis(), 0, "{far}");
            for (axis, length) in [1000.0, 100.0, 100.0].into_iter().enumerate() {
                let (low, range) = sample.range(axis);
                assert!(low > -0.2 * length && range > 0.8 * length && range < 1.2 * length, "{far}: {low} {range}");
            }
        }
    }

    #[test]
    fn boxes_of_a_kind_at_regular_distances_are_met_by_their_share() {
        for every in [16, 64, 256, 512] {
            for first in [0, every / 2] {
                let kind = |k: usize| if k % every == first { 100.0 } else { k as f32 * 1e-6 };
                let boxes: Vec<Aabb> = (0..131_072).map(|k| Aabb::cube([kind(k); 3], 0.5)).collect();
                let chosen = Chosen::from(&boxes);
                let met = chosen.as_slice().iter().filter(|b| b.min[0] > 50.0).count();
                assert!(met <= 256 / every + 20, "{every} from {first}: {met}");
            }
        }
    }

    #[test]
    fn infinite_boxes_leave_every_figure_finite() {
        let inf = f32::INFINITY;
        let boxes = [Aabb::new([-inf; 3], [inf; 3]), Aabb::new([inf; 3], [inf; 3]), Aabb::cube([0.0; 3], 1.0)];
        let sample = Sample::of(&boxes);
        let all =
            sample.ranges.iter().flat_map(|&(low, length)| [low, length]).chain(sample.extent).chain(sample.shares);
        assert!(all.into_iter().all(f64::is_finite), "{sample:?}");
    }
}
