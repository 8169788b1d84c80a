//! Finds the pairs of a frame in the lists of kept pairs.

use super::grown::Grown;
use super::tree::GrownTree;
use crate::cpu::kernel::{overlap, prefetch};
use crate::{Aabb, Pairs};

/// What is needed to find the pairs of a frame in the lists of kept pairs.
pub(super) struct Sift<'a> {
    pub(super) boxes: &'a [Aabb],
    pub(super) grown: &'a Grown,
    pub(super) tree: &'a GrownTree,
    /// Number of lists.
    pub(super) parts: usize,
    /// Whether to prefetch boxes: they are likely not in the cache.
    pub(super) far: bool,
    pub(super) nobody_left: bool,
}

impl Sift<'_> {
    /// Drops the pairs of boxes that left from list `k`, finds the new ones, and adds those that overlap to `found`.
    /// Returns the number of visited nodes.
    // Inlined into a loop over lists, the test of a pair took 1.6 times as long.
    #[inline(never)]
    pub(super) fn list(&self, k: usize, list: &mut Pairs, found: &mut Pairs) -> u64 {
        let Self { boxes, grown, tree, .. } = *self;
        let overlap = |(i, j): (u32, u32)| overlap(&boxes[i as usize], &boxes[j as usize]);
        let fetch = |(i, j): (u32, u32)| {
            if self.far {
                // Pairs of removed boxes are still in the list.
                [i, j].iter().filter_map(|&id| boxes.get(id as usize)).for_each(prefetch);
            }
        };
        if self.nobody_left {
            found.extend_where(list.as_slice(), fetch, overlap);
            return 0;
        }
        list.sift(found, |pair| grown.is_dirty(pair), fetch, overlap);
        let mut nodes = 0;
        for i in tree.moved(k, self.parts) {
            // The frame is made again from scratch.
            if !list.is_complete() {
                break;
            }
            nodes += u64::from(grown.meet(tree, i, |j| {
                list.push(i, j);
                if overlap((i, j)) {
                    found.push(i, j);
                }
            }));
        }
        nodes
    }
}
