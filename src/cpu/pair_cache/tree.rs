//! The tree of the grown boxes, refitted for boxes that get a new one.
//!
//! A box that moves widens the nodes above its leaf and never changes its leaf, so the tree gets worse until its boxes
//! are sorted anew.

use crate::aabb::Aabb;
use crate::cpu::columns::{ensure, part};
use crate::cpu::kernel::node::LANES;
use crate::cpu::level::Simd;
use crate::cpu::sort::sort;
use crate::cpu::tree::{Members, NOBODY, Tree};
use crate::cpu::workers::Workers;
use crate::error::Error;
use crate::filter::Filter;
use crate::load::SceneStats;
use crate::pairs::Pairs;

/// Fewest boxes that all threads move in a phase: fewer are moved in less time than a phase takes.
const SMALLEST_SPLIT: usize = 1024;

/// See the module.
#[derive(Debug)]
pub(super) struct GrownTree {
    tree: Tree,
    /// The place of each box in the tree.
    place_of: Vec<u32>,
    /// The moved boxes: place in the upper half, position in the input in the lower.
    keys: Vec<u64>,
    moved: usize,
    scratch: Vec<u64>,
}

impl GrownTree {
    pub(super) fn new(simd: Simd) -> Self {
        Self { tree: Tree::new(simd), place_of: Vec::new(), keys: Vec::new(), moved: 0, scratch: Vec::new() }
    }

    pub(super) fn reserve(&mut self, objects: usize) -> Result<(), Error> {
        self.tree.reserve(objects)?;
        ensure(&mut self.place_of, objects, "boxes in a tree")
    }

    /// Builds the tree of these boxes, of which `stats` are the statistics.
    pub(super) fn build(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        stats: &SceneStats,
        filter: Option<&Filter>,
    ) -> Result<(), Error> {
        self.tree.build(workers, boxes, Members::From(0), stats, filter)?;
        self.note_places(boxes.len())
    }

    /// Goes on to sort all boxes anew if that has begun or is `wanted`. Returns whether they stand in the new order now.
    pub(super) fn renew(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        filter: Option<&Filter>,
        wanted: bool,
    ) -> Result<bool, Error> {
        let goes_on = wanted || self.tree.is_being_renewed();
        let renewed = goes_on && self.tree.renew(workers, boxes, || SceneStats::of(boxes), filter)?;
        if renewed {
            self.note_places(boxes.len())?;
        }
        Ok(renewed)
    }

    /// Returns the number of places in use, those of removed boxes included.
    pub(super) fn places(&self) -> usize {
        self.tree.places()
    }

    /// Notes the place of each box.
    fn note_places(&mut self, boxes: usize) -> Result<(), Error> {
        ensure(&mut self.place_of, boxes, "boxes in a tree")?;
        for (place, &id) in self.tree.ids().iter().enumerate().filter(|&(_, &id)| id != NOBODY) {
            self.place_of[id as usize] = place as u32;
        }
        Ok(())
    }

    /// Returns the tree for the boxes themselves, whose places are not known then.
    pub(super) fn of_boxes(&mut self) -> &mut Tree {
        &mut self.tree
    }

    /// Adds part `k` of `parts` of the pairs of all boxes that were in the tree when it was built.
    pub(super) fn self_pairs(&self, k: usize, parts: usize, pairs: &mut Pairs) {
        self.tree.self_pairs(k, parts, pairs);
    }

    /// Moves boxes to new leaves, which have no bounds until [`refit`](Self::refit) sets them. Boxes from `new` on are
    /// not in the tree yet.
    pub(super) fn insert(
        &mut self,
        boxes: &[Aabb],
        ids: impl Iterator<Item = u32> + Clone,
        new: usize,
    ) -> Result<(), Error> {
        ensure(&mut self.place_of, boxes.len(), "boxes in a tree")?;
        ids.clone().take_while(|&id| (id as usize) < new).for_each(|id| self.remove(id));
        let place_of = &mut self.place_of;
        self.tree.append(boxes, ids, |place, id| place_of[id as usize] = place as u32)
    }

    /// Removes a box.
    pub(super) fn remove(&mut self, id: u32) {
        self.tree.remove(self.place_of[id as usize] as usize);
    }

    /// Refits the tree to the moved boxes, which have the bounds `boxes[id]` now.
    pub(super) fn refit(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        moved: impl Iterator<Item = u32> + Clone,
    ) -> Result<(), Error> {
        self.moved = moved.clone().count();
        if self.moved == 0 {
            return Ok(());
        }
        ensure(&mut self.keys, self.moved, "boxes that moved")?;
        for (key, id) in self.keys.iter_mut().zip(moved) {
            *key = u64::from(self.place_of[id as usize]) << 32 | u64::from(id);
        }
        let keys = &mut self.keys[..self.moved];
        // Sorts by place: the nodes of one box are then in the cache for the next.
        sort(workers, keys, &mut self.scratch)?;
        let keys = &*keys;
        let Some((leaves, above)) = self.tree.levels_mut() else { return Ok(()) };
        // Each task has its own leaves.
        let size = leaves.len().div_ceil(if self.moved < SMALLEST_SPLIT { 1 } else { workers.tasks() }).max(1);
        let mut rest = keys;
        let parts = leaves.chunks_mut(size).zip((0..).step_by(size)).map(|(leaves, first)| {
            let end = ((first + leaves.len()) * LANES) as u64;
            let (part, behind) = rest.split_at(rest.partition_point(|key| key >> 32 < end));
            rest = behind;
            (leaves, first, part)
        });
        workers.each_of(parts, |(leaves, first, part)| {
            for &key in part {
                let place = (key >> 32) as usize;
                leaves[place / LANES - first].set(place % LANES, &boxes[key as u32 as usize]);
            }
        });
        for &key in keys {
            let mut at = (key >> 32) as usize;
            for level in above.iter_mut().take_while(|level| !level.is_empty()) {
                at /= LANES;
                if !level[at / LANES].widen(at % LANES, &boxes[key as u32 as usize]) {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Returns the moved boxes in part `k` of `parts` of the tree, in its order.
    pub(super) fn moved(&self, k: usize, parts: usize) -> impl Iterator<Item = u32> {
        let keys = &self.keys[..self.moved];
        let places = part(self.tree.ids().len(), k, parts);
        let [first, end] = [places.start, places.end].map(|at| keys.partition_point(|key| key >> 32 < at as u64));
        keys[first..end].iter().map(|&key| key as u32)
    }

    /// Calls `found` for every box that overlaps these bounds. Returns the number of visited nodes.
    #[inline]
    pub(super) fn overlapping(&self, bounds: &Aabb, found: impl FnMut(u32)) -> u32 {
        self.tree.overlapping(bounds, found)
    }
}
