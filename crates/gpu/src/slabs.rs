//! The paper's spatial subdivision: slabs along one axis, each with a halo, each pair owned by one slab.

use sapwise::internals::SceneStats;
use sapwise::{Aabb, Error};

/// Most boxes whose lower bounds place the cuts. With 4096, the size of a slab is off by less than 2 % of all boxes,
/// with rare exceptions.
const MOST_SAMPLED: usize = 4096;

/// The cuts between slabs on one axis. A lower bound on a cut belongs to the upper slab.
#[derive(Debug, Default)]
pub(super) struct Slabs {
    axis: usize,
    cuts: Vec<f32>,
    sampled: Vec<f32>,
}

/// The boxes of one slab and its halo.
#[derive(Debug, Default)]
pub(super) struct Members {
    pub(super) boxes: Vec<Aabb>,
    /// Number of each box in the frame, with the highest bit set if the box begins in this slab.
    pub(super) ids: Vec<u32>,
}

/// The bit of [`Members::ids`] that says that the box begins in the slab.
///
/// A pair is reported by the slab in which one of its boxes has the bit and both are members. That is exactly one
/// slab: the one in which the later of the two boxes begins. In lower slabs only the earlier box is a member, and in
/// higher ones both have begun below.
const BEGINS: u32 = 1 << 31;

impl Slabs {
    /// Cuts the axis on which the fewest pairs overlap into slabs with these shares of the boxes, ascending.
    ///
    /// The cuts follow the density of the boxes: half of the space may have a hundredth of them.
    pub(super) fn plan(&mut self, sample: &SceneStats, boxes: &[Aabb], shares: impl ExactSizeIterator<Item = f64>) {
        self.axis = sample.sweep_axis();
        let count = boxes.len().min(MOST_SAMPLED);
        self.sampled.clear();
        let at = |k: usize| ((2 * k as u64 + 1) * boxes.len() as u64 / (2 * count.max(1) as u64)) as usize;
        self.sampled.extend((0..count).map(|k| boxes[at(k)].min[self.axis]).filter(|v| !v.is_nan()));
        self.sampled.sort_unstable_by(f32::total_cmp);
        self.cuts.clear();
        let slabs = shares.len();
        let mut below = 0.0;
        for share in shares.take(slabs.saturating_sub(1)) {
            below += share;
            let place = (below * self.sampled.len() as f64) as usize;
            let cut = self.sampled.get(place).or(self.sampled.last()).copied().unwrap_or(0.0);
            self.cuts.push(cut);
        }
    }

    pub(super) fn count(&self) -> usize {
        self.cuts.len() + 1
    }

    /// Gathers the boxes of a slab. Returns `false` if there are more than `most`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(super) fn gather(
        &self,
        slab: usize,
        boxes: &[Aabb],
        most: usize,
        members: &mut Members,
    ) -> Result<bool, Error> {
        let low = slab.checked_sub(1).map(|k| self.cuts[k]);
        let high = self.cuts.get(slab).copied();
        members.boxes.clear();
        members.ids.clear();
        for (id, b) in boxes.iter().enumerate() {
            let (min, max) = (b.min[self.axis], b.max[self.axis]);
            // Each box begins in exactly one slab, invalid ones too: NaN is neither at nor above any cut.
            let begins = low.is_none_or(|low| min >= low) && !high.is_some_and(|high| min >= high);
            if begins || low.is_some_and(|low| min < low && max >= low) {
                if members.boxes.len() == most {
                    return Ok(false);
                }
                members.grow()?;
                members.boxes.push(*b);
                members.ids.push(id as u32 | if begins { BEGINS } else { 0 });
            }
        }
        Ok(true)
    }
}

impl Members {
    /// Makes room for one more.
    fn grow(&mut self) -> Result<(), Error> {
        if self.boxes.len() < self.boxes.capacity().min(self.ids.capacity()) {
            return Ok(());
        }
        let (count, more) = (self.boxes.len(), self.boxes.len().max(1024));
        let refused = |_| Error::OutOfMemory { what: "boxes of a slab", elements: count + more };
        self.boxes.try_reserve(more).and_then(|()| self.ids.try_reserve(more)).map_err(refused)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_scenes::Scenario;

    #[test]
    fn every_pair_has_one_owner() {
        let mut scene = Scenario::Clustered.start(3000, 5);
        scene.advance();
        let boxes = scene.boxes();
        let mut slabs = Slabs::default();
        slabs.plan(&SceneStats::of(boxes), boxes, [0.5, 0.3, 0.2].into_iter());
        assert_eq!(slabs.count(), 3);
        let mut owners = std::collections::BTreeMap::new();
        for (slab, share) in [0.5, 0.3, 0.2].into_iter().enumerate() {
            let mut m = Members::default();
            assert_eq!(slabs.gather(slab, boxes, 3000, &mut m), Ok(true));
            let own = m.ids.iter().filter(|&&id| id & BEGINS != 0).count() as f64;
            assert!((own / 3000.0 - share).abs() < 0.03, "{own}");
            for j in 0..m.boxes.len() {
                for i in 0..j {
                    if m.boxes[i].overlaps(&m.boxes[j]) && (m.ids[i] | m.ids[j]) & BEGINS != 0 {
                        let pair = (m.ids[i] & !BEGINS, m.ids[j] & !BEGINS);
                        *owners.entry(pair).or_insert(0) += 1;
                    }
                }
            }
        }
        let all =
            (0..3000).flat_map(|j| (0..j).map(move |i| (i, j))).filter(|&(i, j)| boxes[i].overlaps(&boxes[j])).count();
        assert_eq!(owners.len(), all);
        assert!(owners.values().all(|&count| count == 1));
    }

    #[test]
    fn degenerate_scenes_lose_no_box() {
        let nan = Aabb::new([f32::NAN; 3], [1.0; 3]);
        let inverted = Aabb::new([9.0; 3], [1.0; 3]);
        let far = Aabb::new([f32::INFINITY; 3], [f32::INFINITY; 3]);
        let mut boxes = vec![Aabb::cube([2.0; 3], 0.5); 50];
        boxes.extend([nan, inverted, far]);
        let mut slabs = Slabs::default();
        slabs.plan(&SceneStats::of(&boxes), &boxes, [0.25; 4].into_iter());
        let mut begun = 0;
        for slab in 0..4 {
            let mut m = Members::default();
            slabs.gather(slab, &boxes, 100, &mut m).unwrap();
            begun += m.ids.iter().filter(|&&id| id & BEGINS != 0).count();
        }
        assert_eq!(begun, 53);
    }
}
