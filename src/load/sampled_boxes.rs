//! A sample of the boxes of a frame.

use super::one_of_each;
use crate::{Aabb, mix};

/// Most boxes of a sample. 256 boxes have 32 640 pairs: if 1 % of them overlap on an axis, the sample shows that to
/// about 10 %.
pub(super) const MOST: usize = 256;

/// Fewest boxes of a sample: the quantile of the extents needs a few.
const FEWEST: usize = 32;

/// Up to 256 boxes of a frame, without invalid ones: the sample is taken before the input is checked.
#[derive(Debug)]
pub struct SampledBoxes {
    boxes: [Aabb; MOST],
    count: usize,
}

impl SampledBoxes {
    /// Samples a frame.
    pub fn from(boxes: &[Aabb]) -> Self {
        Self::among(boxes.len(), |k| &boxes[k])
    }

    /// Samples `count` boxes, of which `of` returns number k.
    pub fn among<'a>(count: usize, of: impl Fn(usize) -> &'a Aabb) -> Self {
        // Twice the root of the count: the sample costs a small share of the frame at every size, and the share of
        // overlapping pairs, which falls with the count, stays countable.
        let wanted = count.min((2 * count.isqrt()).clamp(FEWEST, MOST));
        // Other boxes in each frame if anything moves, and the same ones for the same frame.
        let middle = if wanted == 0 { Aabb::default() } else { *of(count / 2) };
        let [x, y, _] = middle.min.map(f32::to_bits);
        let seed = mix(u64::from(x) << 32 | u64::from(y));
        Self::first(one_of_each(count, wanted, seed).map(of))
    }

    /// Takes the first 256 of boxes that were sampled elsewhere.
    pub fn given(boxes: &[Aabb]) -> Self {
        Self::first(boxes.iter())
    }

    fn first<'a>(boxes: impl Iterator<Item = &'a Aabb>) -> Self {
        let mut sample = Self { boxes: [Aabb::default(); MOST], count: 0 };
        for b in boxes.filter(|b| b.defect().is_none()).take(MOST) {
            sample.boxes[sample.count] = *b;
            sample.count += 1;
        }
        sample
    }

    /// Returns the sampled boxes.
    pub fn as_slice(&self) -> &[Aabb] {
        &self.boxes[..self.count]
    }

    /// Returns the share of all pairs whose intervals meet on every axis. `interval` returns the intervals of a box,
    /// ends included.
    pub fn share_of_pairs<const N: usize, T: PartialOrd + Copy + Default>(
        &self,
        interval: impl Fn(&Aabb) -> [(T, T); N],
    ) -> f64 {
        let count = self.count;
        let (mut low, mut high) = ([[T::default(); MOST]; N], [[T::default(); MOST]; N]);
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
    fn regularly_spaced_boxes_are_met_by_their_share() {
        for every in [16, 64, 256, 512] {
            for first in [0, every / 2] {
                let kind = |k: usize| if k % every == first { 100.0 } else { k as f32 * 1e-6 };
                let boxes: Vec<Aabb> = (0..131_072).map(|k| Aabb::cube([kind(k); 3], 0.5)).collect();
                let sample = SampledBoxes::from(&boxes);
                let met = sample.as_slice().iter().filter(|b| b.min[0] > 50.0).count();
                assert!(met <= 256 / every + 20, "{every} from {first}: {met}");
            }
        }
    }
}
