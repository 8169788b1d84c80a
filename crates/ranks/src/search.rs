//! The search of one rank, over its own boxes and those that others sent.

use crate::balance::Times;
use crate::cuts::{Region, centre};
use crate::sample::Sample;
use crate::share::predicted_ns;
use sapwise::algorithm::Load;
use sapwise::{Aabb, Adaptive, BroadPhase, Error, Pairs};
use std::time::Instant;

/// Words of a box: six floats and its id.
pub(crate) const BOX_WORDS: usize = 4;

/// Encodes a box as words.
#[inline]
pub(crate) fn words(b: &Aabb, id: u64) -> [u64; BOX_WORDS] {
    let two = |low: f32, high: f32| u64::from(low.to_bits()) | u64::from(high.to_bits()) << 32;
    [two(b.min[0], b.min[1]), two(b.min[2], b.max[0]), two(b.max[1], b.max[2]), id]
}

/// Decodes a box.
#[inline]
fn of_words(w: &[u64]) -> (Aabb, u64) {
    let low = |w: u64| f32::from_bits(w as u32);
    let high = |w: u64| f32::from_bits((w >> 32) as u32);
    (Aabb::new([low(w[0]), high(w[0]), low(w[1])], [high(w[1]), low(w[2]), high(w[2])]), w[3])
}

/// Searches the boxes of a region.
pub(crate) struct LocalSearch {
    pub(crate) adaptive: Adaptive,
    /// Own boxes first, then those of each rank in turn.
    pub(crate) boxes: Vec<Aabb>,
    /// The ids of these boxes.
    pub(crate) ids: Vec<u64>,
    /// The ends of the own boxes, of those of rank 0, of rank 1 and so on.
    ends: Vec<usize>,
    pub(crate) found: Pairs,
    pub(crate) times: Times,
    /// Whether `found` holds the pairs of `boxes`: the last search succeeded, and its boxes are still here.
    pub(crate) whole: bool,
    /// The error of the last search.
    pub(crate) error: Option<Error>,
}

impl LocalSearch {
    pub(crate) fn new(adaptive: Adaptive) -> Self {
        Self {
            adaptive,
            boxes: Vec::new(),
            ids: Vec::new(),
            ends: Vec::new(),
            found: Pairs::new(),
            times: Times::default(),
            whole: false,
            error: None,
        }
    }

    pub(crate) fn clear(&mut self) {
        self.boxes.clear();
        self.ids.clear();
        self.ends.clear();
        self.whole = false;
    }

    #[inline]
    pub(crate) fn keep(&mut self, b: Aabb, id: u64) {
        self.boxes.push(b);
        self.ids.push(id);
    }

    /// Adds the boxes of all ranks, with the number from each.
    pub(crate) fn receive(&mut self, received: &[u64], counts: impl Iterator<Item = usize>) {
        let more = received.len() / BOX_WORDS;
        self.boxes.reserve(more);
        self.ids.reserve(more);
        let mut end = self.boxes.len();
        self.ends.push(end);
        self.ends.extend(counts.map(|count| {
            end += count;
            end
        }));
        for w in received.chunks_exact(BOX_WORDS) {
            let (b, id) = of_words(w);
            self.keep(b, id);
        }
    }

    /// The rank that a box belongs to.
    #[inline]
    pub(crate) fn owner(&self, at: u32, own: usize) -> usize {
        let at = at as usize;
        // `ends` is empty if there is no other rank.
        if self.ends.first().is_none_or(|end| at < *end) {
            own
        } else {
            self.ends.partition_point(|end| *end <= at) - 1
        }
    }

    /// Fills [`found`](Self::found) with the pairs of these boxes and notes the time.
    pub(crate) fn run(&mut self) -> Result<(), Error> {
        let began = Instant::now();
        let result = self.adaptive.find_pairs(&self.boxes, &mut self.found);
        self.times.push(self.boxes.len() as u64, began.elapsed().as_nanos() as u64);
        self.whole = result.is_ok();
        self.error = result.clone().err();
        result
    }

    /// Finds the pairs of the only rank's boxes, without copying them.
    pub(crate) fn run_on(&mut self, boxes: &[Aabb], limit: Option<usize>) -> Result<(), Error> {
        self.found.set_limit(limit);
        let result = self.adaptive.find_pairs(boxes, &mut self.found);
        self.error = result.clone().err();
        result
    }

    /// The load of the last search.
    pub(crate) fn load(&self) -> Option<Load> {
        self.adaptive.last_decision().map(|d| d.load)
    }

    /// Predicts the time of loads: by the corrected tuning, scaled to the times of the last frames, which contain
    /// what a tuning does not know, such as another program on the cores.
    pub(crate) fn predictor(&self) -> impl Fn(&Load) -> f64 + use<> {
        let tuning = self.adaptive.learned();
        let measured = self.times.medians().zip(self.load());
        let correction =
            measured.map_or(1.0, |((_, ns), load)| (ns as f64 / predicted_ns(&tuning, &load)).clamp(1e-3, 1e3));
        move |load| correction * predicted_ns(&tuning, load)
    }

    /// Samples of the last search whose centres are in the region, weighted by their pairs. `pair_cost` is the cost
    /// of a pair over that of a box.
    pub(crate) fn samples(&self, region: &Region, pair_cost: f64) -> Vec<Sample> {
        let mut pairs = vec![0_u32; self.boxes.len()];
        for &(i, j) in &self.found {
            pairs[i as usize] += 1;
            pairs[j as usize] += 1;
        }
        let mut samples = Sample::with_pairs(&self.boxes, Sample::MOST, |k| pairs[k], pair_cost);
        // The rest is in the samples of other ranks.
        samples.retain(|s| region.holds(centre(&s.bounds)));
        samples
    }

    /// Bytes of memory, without the algorithms.
    pub(crate) fn bytes(&self) -> usize {
        self.boxes.capacity() * size_of::<Aabb>() + self.ids.capacity() * 8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::{Registry, Tuning};

    #[test]
    fn boxes_survive_as_words_and_know_their_owner() {
        let registry = Registry::with_cores(1);
        let mut search = LocalSearch::new(Adaptive::new(Tuning::usual(&registry), &registry).unwrap());
        let odd = Aabb::new([f32::NEG_INFINITY, -0.0, 1e-42], [f32::INFINITY, 3.5, f32::MAX]);
        search.keep(odd, 1);
        assert_eq!(search.owner(0, 3), 3);
        let sent = [words(&odd, u64::MAX), words(&Aabb::cube([2.0; 3], 1.0), 7), words(&odd, 0)].concat();
        search.receive(&sent, [1, 0, 2, 0].into_iter());
        assert_eq!(search.ids, [1, u64::MAX, 7, 0]);
        assert_eq!(search.boxes[1].min.map(f32::to_bits), odd.min.map(f32::to_bits));
        assert_eq!((search.boxes[1], search.boxes[2]), (odd, Aabb::cube([2.0; 3], 1.0)));
        assert_eq!([0, 1, 2, 3].map(|at| search.owner(at, 3)), [3, 0, 2, 2]);
        search.run().unwrap();
        assert!(search.found.len() == 6 && search.load().is_some());
    }
}
