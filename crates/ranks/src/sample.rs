//! Samples of the boxes by which space is cut.

use crate::cuts::{Cuts, centre};
use sapwise::Aabb;
use sapwise::internals::splitmix;

/// One box that stands for several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The box, which is valid.
    pub bounds: Aabb,
    /// The work that it stands for; [`Sample::UNIT`] is one box of the usual cost.
    pub weight: u64,
    /// The part that it is in while space is cut.
    pub(crate) part: u32,
}

impl Sample {
    /// The weight of one box of the usual cost.
    pub const UNIT: u64 = 1024;

    /// The most samples of a rank. They give a share of the work to 0.8 %, and to 2.6 % for the worst of a thousand
    /// ranks.
    pub const MOST: usize = 16_384;

    /// Takes up to `most` valid boxes of the usual cost: one from each of `most` equal parts of the list.
    pub fn of(boxes: &[Aabb], most: usize) -> Vec<Self> {
        Self::with_pairs(boxes, most, |_| 0, 0.0)
    }

    /// The same with boxes that cost `pair_cost` more for each pair. `pairs_of` returns the number of pairs of the
    /// box at a position; each pair counts half for each of its boxes.
    pub fn with_pairs(boxes: &[Aabb], most: usize, pairs_of: impl Fn(usize) -> u32, pair_cost: f64) -> Vec<Self> {
        let count = boxes.len().min(most);
        let start = |k: usize| (k as u128 * boxes.len() as u128 / count as u128) as usize;
        let take = |k: usize| {
            let (first, end) = (start(k), start(k + 1));
            // Not at regular distances, at which boxes of one kind may lie.
            let at = first + (splitmix::next(&mut (k as u64)) % (end - first) as u64) as usize;
            let bounds = boxes[at];
            let cost = 1.0 + pair_cost * f64::from(pairs_of(at)) / 2.0;
            let weight = ((end - first) as f64 * cost * Self::UNIT as f64).clamp(1.0, 1e15) as u64;
            bounds.defect().is_none().then_some(Self { bounds, weight, part: 0 })
        };
        (0..count).filter_map(take).collect()
    }

    /// Returns the weight of the samples in each region.
    pub fn weights(samples: &[Self], cuts: &Cuts) -> Vec<u64> {
        let mut weights = vec![0; cuts.regions().len()];
        samples.iter().for_each(|s| weights[cuts.rank_of(centre(&s.bounds))] += s.weight);
        weights
    }

    /// Multiplies the weight of each sample by the cost of a box in its region.
    pub fn weigh(samples: &mut [Self], cuts: &Cuts, costs: &[f64]) {
        for s in samples {
            let cost = costs[cuts.rank_of(centre(&s.bounds))];
            s.weight = (s.weight as f64 * cost).clamp(1.0, 1e15) as u64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_stand_for_all_valid_boxes() {
        let mut boxes: Vec<Aabb> = (0..1000).map(|k| Aabb::cube([k as f32; 3], 0.5)).collect();
        for most in [1, 7, 999, 1000, 5000] {
            let sample = Sample::of(&boxes, most);
            assert_eq!(sample.len(), most.min(1000));
            assert_eq!(sample.iter().map(|s| s.weight).sum::<u64>(), 1000 * Sample::UNIT);
            assert!(sample.is_sorted_by(|a, b| a.bounds.min[0] < b.bounds.min[0]));
        }
        let weighed = Sample::with_pairs(&boxes, 1000, |k| k as u32 % 5, 0.5);
        assert!(weighed.iter().zip(0..).all(|(s, k)| s.weight == Sample::UNIT + Sample::UNIT / 4 * (k % 5)));
        boxes.iter_mut().step_by(2).for_each(|b| b.min[0] = f32::NAN);
        assert_eq!(Sample::of(&boxes, 1000).len(), 500);
        assert!(Sample::of(&[], 10).is_empty());
    }
}
