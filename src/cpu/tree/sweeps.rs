//! Finds the pairs of boxes of two shapes along the only axis on which both are thin.
//!
//! Sixteen of n rods along x, spread over a world of edge 1, take a square of edge √(16 / n) on y and z. Their leaf
//! meets about √(n / 16) leaves of rods along y, but few of these rods overlap on z. If a copy of each kind is sorted
//! along z, a leaf of one copy meets few leaves of the other.

use super::order::Order;
use super::{Input, Tree, lay_out};
use crate::cpu::kernel::walk::{Apart, SAMPLE};
use crate::cpu::{LANES, Simd, Walk, part};
use crate::{Aabb, Error, Pairs};
use std::ops::Range;

/// Costs of a copy of a leaf, and of two copies that meet, in [tests of the tree](Walk::tests).
const COPY: u64 = 60;
const MEETING: u64 = 16;

/// Boxes of one shape, in whole leaves of the tree. Those in a leaf with boxes of other shapes are left out.
#[derive(Debug)]
pub(super) struct Kind {
    /// The axes on which the boxes are oversized, one bit each.
    pub(super) long: u32,
    pub(super) leaves: Range<usize>,
}

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Sweeps {
    kinds: Vec<Kind>,
    /// The boxes of kind k, sorted along axis a, at 3 k + a.
    sorted: Vec<Tree>,
    /// Two of these for each sweep.
    swept: Vec<[usize; 2]>,
    /// For each sweep, the leaves in the tree that need not be compared.
    pub(super) apart: Vec<Apart>,
}

impl Sweeps {
    /// Begins with a new tree, which holds boxes of these kinds.
    pub(super) fn begin(&mut self, kinds: impl Iterator<Item = Kind>) {
        self.kinds.clear();
        self.kinds.extend(kinds.filter(|kind| !kind.leaves.is_empty()));
    }

    /// Chooses the kinds whose pairs are cheaper to find here than with the tree, which has these boxes now.
    /// Passive boxes stand from leaf `active` on.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]. The sweeps chosen until then are complete.
    pub(super) fn choose(
        &mut self,
        tree: &Walk<'_>,
        active: usize,
        simd: Simd,
        order: &mut Order,
        input: Input<'_>,
    ) -> Result<(), Error> {
        let Self { kinds, sorted, swept, apart } = self;
        swept.clear();
        apart.clear();
        let mut is_sorted = 0_u64;
        for (j, b) in kinds.iter().enumerate() {
            for (i, a) in kinds[..j].iter().enumerate().filter(|(_, a)| a.leaves.start < active) {
                let (long, of_a, of_b) = (a.long | b.long, a.leaves.len() as u64, b.leaves.len() as u64);
                let copies = COPY * (of_a + of_b);
                // Saves the estimate if even a test of all boxes costs less.
                if a.long == b.long || long.count_ones() != 2 || of_a * of_b * LANES as u64 <= copies {
                    continue;
                }
                let axis = (!long).trailing_zeros() as usize;
                let most = tree.tests(a.leaves.clone(), b.leaves.clone()).saturating_sub(copies) / MEETING;
                // Saves copies that would be of no use.
                if most == 0 || likely_meeting(tree, a, b, axis) > most {
                    continue;
                }
                let both = [i, j].map(|kind| 3 * kind + axis);
                for (at, kind) in both.into_iter().zip([a, b]) {
                    if is_sorted >> at & 1 == 1 {
                        continue;
                    }
                    sorted.resize_with(sorted.len().max(at + 1), || Tree::new(simd));
                    let ids = &tree.ids[kind.leaves.start * LANES..kind.leaves.end * LANES];
                    sorted[at].build_along(order, input, ids, axis)?;
                    is_sorted |= 1 << at;
                }
                let [a_sorted, b_sorted] = both.map(|at| sorted[at].walk());
                let one_way = begun_within(&a_sorted, &b_sorted, axis, most);
                if one_way + begun_within(&b_sorted, &a_sorted, axis, most) <= most {
                    swept.push(if a.leaves.len() < b.leaves.len() { both } else { [both[1], both[0]] });
                    apart.push(Apart { leaves: a.leaves.clone(), others: b.leaves.clone() });
                }
            }
        }
        Ok(())
    }

    /// Adds part `k` of `parts` of the pairs.
    pub(super) fn pairs(&self, k: usize, parts: usize, pairs: &mut Pairs) {
        for &[few, many] in &self.swept {
            let (few, many) = (&self.sorted[few], &self.sorted[many]);
            for leaf in part(few.levels[0].len(), k, parts) {
                many.pairs_with(&few.walk().group(leaf), pairs);
            }
        }
    }
}

impl Tree {
    /// Builds the tree of the boxes at these positions, sorted by lower bound on an axis.
    fn build_along(&mut self, order: &mut Order, input: Input<'_>, members: &[u32], axis: usize) -> Result<(), Error> {
        let Self { ids, levels, .. } = self;
        order.sort_along(input, members, axis)?;
        lay_out(levels, ids, members.len())?;
        input.workers.map(order.ids(), ids, |_, &key| members[key as u32 as usize]);
        self.fill(input, |_, _| true);
        Ok(())
    }
}

/// Estimates how many pairs of leaves overlap on an axis, from a sample of their boxes. That is too few: a leaf is
/// longer than a box.
fn likely_meeting(tree: &Walk<'_>, a: &Kind, b: &Kind, axis: usize) -> u64 {
    let step = |kind: &Kind| kind.leaves.len().div_ceil(SAMPLE);
    let some = |kind: &Kind| kind.leaves.clone().step_by(step(kind)).map(|leaf| tree.levels[0][leaf].lane(0));
    let meet = |a: &Aabb, b: &Aabb| (a.min[axis] <= b.max[axis]) & (b.min[axis] <= a.max[axis]);
    let met: usize = some(a).map(|a| some(b).filter(|b| meet(&a, b)).count()).sum();
    met as u64 * step(a) as u64 * step(b) as u64
}

/// Returns the number of leaves of `b` that begin within the range of a leaf of `a` on the axis, summed over the
/// leaves of `a`, or any number above `most`. The leaves of both ascend by their begin.
fn begun_within(a: &Walk<'_>, b: &Walk<'_>, axis: usize, most: u64) -> u64 {
    let begin = |leaf: usize| b.bounds_of(leaf).min[axis];
    let (count, mut first, mut begun) = (b.levels[0].len(), 0, 0_u64);
    // The last leaves may be empty. Their bounds are NaN, which compares false.
    for range in (0..a.levels[0].len()).map(|leaf| a.bounds_of(leaf)) {
        while first < count && begin(first) < range.min[axis] {
            first += 1;
        }
        begun += (first..count).take_while(|&leaf| begin(leaf) <= range.max[axis]).count() as u64;
        if begun > most {
            break;
        }
    }
    begun
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::{Members, Threads, Upkeep, Workers};
    use crate::{Filter, FramePlan, Membership, SceneStats, mix};

    /// Returns a rod along x, y or z, or a few times a cube or a sheet, with its centre in a world of edge 100.
    fn long_box(k: u64, length: f32) -> Aabb {
        let unit = |a: u64| (mix(4 * k + a) >> 40) as f32 / (1 << 24) as f32;
        let kind = match (unit(3) * 100.0) as u32 {
            0 => 3,
            1..5 => 0,
            k => [1, 2, 4][k as usize % 3],
        };
        let centre = [0, 1, 2].map(|a| unit(a) * 100.0);
        let half = [0, 1, 2].map(|a| if kind >> a & 1 == 1 { length / 2.0 } else { 0.02 });
        Aabb::new([0, 1, 2].map(|a| centre[a] - half[a]), [0, 1, 2].map(|a| centre[a] + half[a]))
    }

    fn workers() -> Workers {
        Workers::new("tree", if cfg!(feature = "parallel") { 3 } else { 1 }, &Threads::default())
    }

    /// Boxes walk, jump, come, go, become infinite, and become fixed or cease to be.
    #[test]
    fn pairs_of_long_boxes_are_right_in_every_frame_of_churn() {
        const FRAMES: u64 = 36;
        let workers = workers();
        let mut oracle = crate::cpu::brute::create(1, &Threads::default(), Simd::Portable).unwrap();
        let mut trees: Vec<_> = Simd::every().map(|simd| (Tree::new(simd), Upkeep::new(false))).collect();
        let mut random = 0;
        let mut below = |n: usize| {
            random += 1;
            (mix(random) >> 20) as usize % n
        };
        let mut boxes: Vec<Aabb> = (0..16_000).map(|k| long_box(k, 150.0)).collect();
        let (mut swept, mut swept_fixed) = (0, 0);
        for frame in 0..FRAMES {
            match frame % 6 {
                0 => boxes.truncate(boxes.len() - below(200)),
                1 => boxes.extend((0..below(300) as u64).map(|k| long_box(frame << 20 | k, 150.0))),
                2 => (0..40).for_each(|k| {
                    let at = below(boxes.len());
                    boxes[at] = long_box(frame << 30 | k, 80.0);
                }),
                3 => boxes[7].max[1] = if frame % 4 == 0 { f32::INFINITY } else { boxes[7].min[1] + 1.0 },
                _ => boxes.iter_mut().for_each(|b| {
                    let by = below(100) as f32 * 0.001 - 0.05;
                    (0..3).for_each(|a| (b.min[a], b.max[a]) = (b.min[a] + by, b.max[a] + by));
                }),
            }
            // Half of the boxes are fixed, after a time others.
            let fixed = |k: u64| mix(k + frame / 18).is_multiple_of(2);
            let owner = |k: u64| if frame < 18 { 0 } else { (k % 3) as u32 };
            let of = |k| Membership { fixed: fixed(k), owner: owner(k), ..Membership::ALL };
            let filter = (frame % 18 > 8).then(|| Filter::new((0..18_000).map(of).collect()));
            let mut expected = Pairs::new();
            expected.set_filter(filter.clone());
            oracle.find_pairs(&boxes, &mut expected).unwrap();
            for (tree, upkeep) in &mut trees {
                let input = Input { workers: &workers, boxes: &boxes, screen: expected.screen() };
                upkeep.update(tree, input, &FramePlan::default()).unwrap();
                let mut pairs = Pairs::new();
                pairs.set_filter(filter.clone());
                (0..5).for_each(|k| tree.self_pairs(k, 5, &mut pairs));
                assert_eq!((pairs.len(), pairs.fingerprint()), (expected.len(), expected.fingerprint()), "{frame}");
                swept += usize::from(!tree.sweeps.swept.is_empty());
                swept_fixed += usize::from(tree.sweeps.apart.iter().any(|apart| apart.others.start >= tree.active));
            }
        }
        let all = trees.len() * FRAMES as usize;
        assert!(swept > all * 3 / 4 && swept_fixed > all / 3, "{swept} and {swept_fixed} frames of {all}");
        assert!(trees.iter().all(|(_, upkeep)| upkeep.builds < FRAMES / 2), "trees are refitted");
    }

    #[test]
    fn beams_are_swept_unless_they_cross_at_one_height() {
        let mut boxes: Vec<Aabb> = (0..12_000).map(|k| long_box(k, 30.0)).collect();
        let swept = |boxes: &[Aabb]| {
            let mut tree = Tree::new(Simd::Portable);
            let input = Input { workers: &workers(), boxes, screen: None };
            tree.build(input, Members::From(0), &SceneStats::of(boxes)).unwrap();
            let long = |leaves: &Range<usize>| tree.sweeps.kinds.iter().find(|k| k.leaves == *leaves).map(|k| k.long);
            let pairs = tree.sweeps.apart.iter().map(|apart| [&apart.leaves, &apart.others].map(long));
            pairs.collect::<Vec<_>>().contains(&[Some(1), Some(2)])
        };
        assert!(swept(&boxes));
        for b in boxes.iter_mut().filter(|b| b.max[2] - b.min[2] < 1.0) {
            (b.min[2], b.max[2]) = (50.0, 50.04);
        }
        assert!(!swept(&boxes));
    }
}
