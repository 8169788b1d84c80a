//! The tree of the grown boxes, refitted for boxes that get a new one.
//!
//! A box that moves widens the nodes above its leaf and never changes its leaf, so the tree gets worse until its boxes
//! are sorted anew.

use super::grown::NOTHING;
use crate::cpu::{Input, LANES, Members, NOBODY, Simd, Tree, Workers, ensure, part, sort, split};
use crate::{Aabb, Error, SceneStats};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Fewest boxes that all threads move in a phase: fewer are moved in less time than a phase takes.
const SMALLEST_SPLIT: usize = 1024;

/// See the module.
#[derive(Debug, Default)]
pub(crate) struct GrownTree {
    /// Also of other boxes than grown ones, while their places are not asked for.
    pub(crate) tree: Tree,
    /// The place of each box in the tree, which any thread may write.
    place_of: Vec<AtomicU32>,
    /// One bit for each box that is out of the tree, while others are sorted anew.
    out: Vec<u64>,
    /// The moved boxes: place in the upper half, position in the input in the lower.
    keys: Vec<u64>,
    moved: usize,
    scratch: Vec<u64>,
    /// The bounds of the moved boxes below each parent of leaves, if they changed its bounds; nothing after a refit.
    widened: Vec<Aabb>,
}

impl GrownTree {
    pub(crate) fn new(simd: Simd) -> Self {
        Self { tree: Tree::new(simd), ..Self::default() }
    }

    pub(crate) fn reserve(&mut self, objects: usize) -> Result<(), Error> {
        self.tree.reserve(objects)?;
        ensure(&mut self.place_of, objects, "boxes in a tree")
    }

    /// Builds the tree of the members, of which `stats` are the statistics.
    pub(crate) fn build(&mut self, input: Input<'_>, members: Members<'_>, stats: &SceneStats) -> Result<(), Error> {
        self.tree.build(input, members, stats)?;
        self.note_places(input.workers, input.boxes.len())
    }

    /// Moves the boxes `far` to new leaves, which have no bounds until [`refit`](Self::refit) sets them; those from
    /// `new` on are not in the tree yet. Goes on to sort all boxes anew if that has begun or is `wanted`. Returns
    /// whether they stand in the new order.
    pub(crate) fn update(
        &mut self,
        input: Input<'_>,
        (far, new): (impl Iterator<Item = u32> + Clone, usize),
        wanted: bool,
    ) -> Result<bool, Error> {
        let Input { workers, boxes, screen } = input;
        ensure(&mut self.place_of, boxes.len(), "boxes in a tree")?;
        ensure(&mut self.out, boxes.len().div_ceil(64), "boxes in a tree")?;
        far.clone().take_while(|&id| (id as usize) < new).for_each(|id| self.remove(id));
        let mut renewed = false;
        if wanted || self.tree.is_being_renewed() {
            far.clone().for_each(|id| self.out[id as usize / 64] |= 1 << (id % 64));
            let out = |id: u32| self.out[id as usize / 64] >> (id % 64) & 1 == 1;
            let jumped = (far.clone(), out);
            let done = self.tree.renew(input, jumped, || SceneStats::of(boxes));
            far.clone().for_each(|id| self.out[id as usize / 64] = 0);
            renewed = done?;
            if renewed {
                self.note_places(workers, boxes.len())?;
            }
        }
        let place_of = &mut self.place_of;
        self.tree.insert(boxes, far, screen, |place, id| *place_of[id as usize].get_mut() = place as u32)?;
        Ok(renewed)
    }

    /// Notes the place of each box.
    fn note_places(&mut self, workers: &Workers, boxes: usize) -> Result<(), Error> {
        ensure(&mut self.place_of, boxes, "boxes in a tree")?;
        let (ids, place_of) = (self.tree.ids(), &self.place_of);
        let size = ids.len().div_ceil(workers.tasks()).max(SMALLEST_SPLIT);
        workers.each_of(ids.chunks(size).zip((0..).step_by(size)), |(ids, first)| {
            for (place, &id) in (first..).zip(ids).filter(|&(_, &id)| id != NOBODY) {
                place_of[id as usize].store(place as u32, Relaxed);
            }
        });
        Ok(())
    }

    /// Removes a box.
    pub(crate) fn remove(&mut self, id: u32) {
        self.tree.remove(*self.place_of[id as usize].get_mut() as usize);
    }

    /// Refits the tree to the moved boxes, which have the bounds `boxes[id]` now.
    pub(crate) fn refit<'a>(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        moved: impl Iterator<Item = &'a [u32]> + Clone + Send,
    ) -> Result<(), Error> {
        self.moved = moved.clone().map(<[u32]>::len).sum();
        if self.moved == 0 {
            return Ok(());
        }
        let workers = if self.moved < SMALLEST_SPLIT { &workers.fit(0) } else { workers };
        ensure(&mut self.keys, self.moved, "boxes that moved")?;
        let keys = &mut self.keys[..self.moved];
        let parts = split(keys, moved.clone().map(<[u32]>::len)).zip(moved);
        let place_of = &self.place_of;
        workers.each_of(parts, |(keys, moved)| {
            for (key, &id) in keys.iter_mut().zip(moved) {
                *key = u64::from(place_of[id as usize].load(Relaxed)) << 32 | u64::from(id);
            }
        });
        // Sorts by place: the nodes of one box are then in the cache for the next.
        sort(workers, keys, &mut self.scratch)?;
        let [leaves, parents, above @ ..] = self.tree.levels_mut() else { return Ok(()) };
        let known = self.widened.len();
        ensure(&mut self.widened, parents.len(), "boxes in a tree")?;
        self.widened[known..].fill(NOTHING);
        let widened = &mut self.widened[..parents.len()];
        // Each task has its own parents, and the leaves below them.
        let size = parents.len().div_ceil(workers.tasks()).max(1);
        let mut rest = &*keys;
        let parts = parents.chunks_mut(size).zip(leaves.chunks_mut(size * LANES)).zip(widened.chunks_mut(size));
        let parts = parts.zip((0..).step_by(size * LANES * LANES)).map(|(((parents, leaves), widened), first)| {
            let end = (first + leaves.len() * LANES) as u64;
            let (part, behind) = rest.split_at(rest.partition_point(|key| key >> 32 < end));
            rest = behind;
            (parents, leaves, widened, first, part)
        });
        workers.each_of(parts, |(parents, leaves, widened, first, part)| {
            for &key in part {
                let (place, b) = ((key >> 32) as usize - first, &boxes[key as u32 as usize]);
                let (leaf, parent) = (place / LANES, place / LANES / LANES);
                leaves[leaf].set(place % LANES, b);
                if parents[parent].widen(leaf % LANES, b) {
                    widened[parent] = widened[parent].union(b);
                }
            }
        });
        for (parent, bounds) in widened.iter_mut().enumerate().filter(|(_, bounds)| **bounds != NOTHING) {
            let bounds = std::mem::replace(bounds, NOTHING);
            let mut at = parent;
            for level in above.iter_mut().take_while(|level| !level.is_empty()) {
                if !level[at / LANES].widen(at % LANES, &bounds) {
                    break;
                }
                at /= LANES;
            }
        }
        Ok(())
    }

    /// Returns the moved boxes in part `k` of `parts` of the tree, in its order.
    pub(crate) fn moved(&self, k: usize, parts: usize) -> impl Iterator<Item = u32> {
        let keys = &self.keys[..self.moved];
        let places = part(self.tree.ids().len(), k, parts);
        let [first, end] = [places.start, places.end].map(|at| keys.partition_point(|key| key >> 32 < at as u64));
        keys[first..end].iter().map(|&key| key as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splitmix::mix;

    #[test]
    fn tree_renewed_while_boxes_jump_is_as_good_as_a_new_one() {
        let mut random = 0;
        let mut below = |n: u64| {
            random += 1;
            (mix(random) >> 20) % n
        };
        let mut anywhere = |_: u32| Aabb::cube([0; 3].map(|_| below(3000) as f32 * 0.01), 0.5);
        let mut boxes: Vec<Aabb> = (0..4000).map(&mut anywhere).collect();
        let (workers, mut tree) = (Workers::one(), GrownTree::new(Simd::Portable));
        let nodes =
            |tree: &GrownTree, boxes: &[Aabb]| -> u32 { boxes.iter().map(|b| tree.tree.overlapping(b, |_| {})).sum() };
        let input = Input { workers: &workers, boxes: &boxes, screen: None };
        tree.build(input, Members::From(0), &SceneStats::of(&boxes)).unwrap();
        let new = nodes(&tree, &boxes);
        for frame in 0.. {
            let jumped: Vec<u32> = (frame..4000).step_by(100).collect();
            jumped.iter().for_each(|&id| boxes[id as usize] = anywhere(id));
            let far = (jumped.iter().copied(), boxes.len());
            let input = Input { workers: &workers, boxes: &boxes, screen: None };
            let renewed = tree.update(input, far, frame == 0).unwrap();
            tree.refit(&workers, &boxes, std::iter::once(&jumped[..])).unwrap();
            if renewed {
                break;
            }
        }
        let renewed = nodes(&tree, &boxes);
        assert!(f64::from(renewed) < 1.2 * f64::from(new), "{new} nodes, {renewed} after the renewal");
    }
}
