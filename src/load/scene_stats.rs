//! Statistics of a frame, from a few hundred of its boxes.

use super::sampled_boxes::{MOST, SampledBoxes};
use crate::Aabb;
use std::cmp::Ordering;

/// Divisor for the share of the sample at either end that says nothing about where boxes lie: boxes pooled far away, or
/// asleep below the floor.
const TAIL: usize = 16;

/// Bounds are clamped to this, so that their differences are finite in `f64`.
const CLAMP: f64 = 1.0e30;

/// Statistics of a frame: ranks and counts, which a few boxes anywhere in space don't change.
#[derive(Debug, Clone, Copy, Default)]
pub struct SceneStats {
    /// Start and length of the range in which most centres lie, on each axis: the cells of a grid share it, and those
    /// at the ends take the boxes beyond.
    pub ranges: [(f64, f64); 3],
    /// The 0.9 quantile of the extents on each axis.
    pub extent: [f64; 3],
    /// Share of all pairs that overlap on each axis.
    pub shares: [f64; 3],
}

impl SceneStats {
    /// Estimates the statistics from a sample of the boxes.
    pub fn of(boxes: &[Aabb]) -> Self {
        Self::of_sample(&SampledBoxes::from(boxes))
    }

    /// Estimates the statistics of the boxes at these positions.
    pub fn of_members(boxes: &[Aabb], members: &[u32]) -> Self {
        Self::of_sample(&SampledBoxes::among(members.len(), |k| &boxes[members[k] as usize]))
    }

    /// Returns the axis on which the fewest pairs overlap: a sweep along it has the fewest candidates.
    pub fn sweep_axis(&self) -> usize {
        // The sample of a large world may hold no overlapping pair. Then take the axis on which boxes are shortest for
        // their range.
        let order = |a: usize| (self.shares[a], self.extent[a] / self.ranges[a].1);
        (0..3).min_by(|&a, &b| order(a).partial_cmp(&order(b)).unwrap_or(Ordering::Equal)).unwrap_or(0)
    }

    /// Computes the statistics of a sample.
    pub fn of_sample(sample: &SampledBoxes) -> Self {
        let boxes = sample.as_slice();
        let mut stats = Self::default();
        let (count, tail) = (boxes.len(), boxes.len() / TAIL);
        if count == 0 {
            return stats;
        }
        for axis in 0..3 {
            let bound = |v: f32| f64::from(v).clamp(-CLAMP, CLAMP);
            let (mut centres, mut extents) = ([0.0_f64; MOST], [0.0_f64; MOST]);
            for ((b, centre), extent) in boxes.iter().zip(&mut centres).zip(&mut extents) {
                let (min, max) = (bound(b.min[axis]), bound(b.max[axis]));
                *centre = (min + max) / 2.0;
                *extent = max - min;
            }
            let centres = &mut centres[..count];
            let (below, &mut low, above) = centres.select_nth_unstable_by(tail, f64::total_cmp);
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
            // Extends the range by what the tails would cover if boxes were spread evenly.
            let more = if last == 0 { 0.0 } else { (high - low) * tail as f64 / last as f64 };
            let (low, high) = (lowest.max(low - more), highest.min(high + more));
            stats.ranges[axis] = (low, high - low);
            stats.extent[axis] = *extents[..count].select_nth_unstable_by(count * 9 / 10, f64::total_cmp).1;
            stats.shares[axis] = sample.share_of_pairs(|b| [(b.min[axis], b.max[axis])]);
        }
        stats
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mix;

    #[test]
    fn empty_and_invalid_frames_give_zeros() {
        assert_eq!(SceneStats::of(&[]).extent, [0.0; 3]);
        let invalid = [Aabb::cube([f32::NAN; 3], 1.0)];
        assert_eq!(SceneStats::of(&invalid).extent, [0.0; 3]);
        assert_eq!(SampledBoxes::from(&invalid).share_of_pairs(|b| [(b.min[0], b.max[0])]), 0.0);
    }

    #[test]
    fn row_of_boxes_is_swept_along_itself() {
        let boxes: Vec<Aabb> = (0..1000).map(|k| Aabb::cube([0.0, 10.0 * k as f32, 5.0], 0.5)).collect();
        let stats = SceneStats::of(&boxes);
        assert_eq!((stats.sweep_axis(), stats.extent, stats.shares), (1, [1.0; 3], [1.0, 0.0, 1.0]));
        let sample = SampledBoxes::from(&boxes);
        assert_eq!(sample.share_of_pairs(|b| [(b.min[0], b.max[0]), (b.min[2], b.max[2])]), 1.0);
        let (low, length) = stats.ranges[1];
        assert!(low.abs() < 600.0 && (length - 10_000.0).abs() < 900.0, "{low} {length}");
        assert_eq!(stats.ranges[0], (0.0, 0.0));
    }

    #[test]
    fn boxes_far_away_change_neither_axis_nor_ranges() {
        let at = |k: u64, a: u64| (mix(3 * k + a) % 10_000) as f32;
        let near = |k: u64| Aabb::cube([at(k, 0) / 10.0, at(k, 1) / 100.0, at(k, 2) / 100.0], 0.5);
        let scene = |far: f32| -> Vec<Aabb> {
            let pooled = |k: u64| Aabb::cube([500.0, -far, 50.0], 0.5 + k as f32 * 1e-6);
            (0..20_000).map(|k| if k % 50 == 7 { pooled(k) } else { near(k) }).collect()
        };
        for far in [0.0, 4.0e6, 1.0e38] {
            let stats = SceneStats::of(&scene(far));
            assert_eq!(stats.sweep_axis(), 0, "{far}");
            for (axis, length) in [1000.0, 100.0, 100.0].into_iter().enumerate() {
                let (low, range) = stats.ranges[axis];
                assert!(low > -0.2 * length && range > 0.8 * length && range < 1.2 * length, "{far}: {low} {range}");
            }
        }
    }

    #[test]
    fn statistics_of_infinite_boxes_are_finite() {
        let inf = f32::INFINITY;
        let boxes = [Aabb::new([-inf; 3], [inf; 3]), Aabb::new([inf; 3], [inf; 3]), Aabb::cube([0.0; 3], 1.0)];
        let stats = SceneStats::of(&boxes);
        let all = stats.ranges.iter().flat_map(|&(low, length)| [low, length]).chain(stats.extent).chain(stats.shares);
        assert!(all.into_iter().all(f64::is_finite), "{stats:?}");
    }
}
