//! A tree of the grown boxes with 16 children a node, for the boxes that get a new one.
//!
//! Sixteen boxes that are near in space share a leaf. A box that moves widens the nodes above its leaf and never changes
//! its leaf, so the tree gets worse until it is made again.

use crate::aabb::Aabb;
use crate::cpu::columns::{ensure, part};
use crate::cpu::kernel::node::{LANES, Node, each_overlapping};
use crate::cpu::level::Simd;
use crate::cpu::sort::sort;
use crate::cpu::workers::Workers;
use crate::error::Error;
use crate::load::Sample;

/// Boxes that move in one phase on all threads; fewer are moved in less time than a phase takes.
const SMALLEST_SPLIT: usize = 1024;

/// Boxes from which on what belongs to them is likely not in the second-level cache: 1.2 MB of boxes, and as much in the tree.
pub(super) const FAR: usize = 50_000;

/// Contains no box, not even an infinite one: whatever has no grown box yet is seen to have left it.
pub(super) const NOTHING: Aabb = Aabb::new([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);

/// In place of a box that is gone. No box has this number: there are at most this many.
const GONE: u32 = u32::MAX;

/// See the module.
#[derive(Debug)]
pub(super) struct Tree {
    /// The box in each lane of the leaves, leaf after leaf.
    ids: Vec<u32>,
    /// Places of `ids` in use.
    places: usize,
    /// The place of each box in `ids`.
    place_of: Vec<u32>,
    /// The leaves, which hold boxes; then nodes that hold bounds of the leaves, and so on. The last level has 16 nodes at first.
    levels: Vec<Vec<Node>>,
    /// Keys to sort: position along a Morton curve in the upper half, box in the lower; or the place and the box of those that
    /// moved.
    keys: Vec<u64>,
    /// How many moved; the keys are theirs.
    moved: usize,
    scratch: Vec<u64>,
    simd: Simd,
}

impl Tree {
    pub(super) fn new(simd: Simd) -> Self {
        Self {
            ids: Vec::new(),
            places: 0,
            place_of: Vec::new(),
            levels: Vec::new(),
            keys: Vec::new(),
            moved: 0,
            scratch: Vec::new(),
            simd,
        }
    }

    /// Makes the tree of these boxes, which look like the sample.
    pub(super) fn build(&mut self, workers: &Workers, boxes: &[Aabb], sample: &Sample) -> Result<(), Error> {
        ensure(&mut self.keys, boxes.len(), "sort keys")?;
        let keys = &mut self.keys[..boxes.len()];
        let curve = Curve::over(sample);
        workers.map(boxes, keys, |id, b| u64::from(curve.key(b)) << 32 | id as u64);
        sort(workers, &mut self.keys, &mut self.scratch, boxes.len())?;
        ensure(&mut self.ids, boxes.len(), "boxes in a tree")?;
        ensure(&mut self.place_of, boxes.len(), "boxes in a tree")?;
        self.places = boxes.len();
        for (place, &key) in self.keys[..boxes.len()].iter().enumerate() {
            self.ids[place] = key as u32;
            self.place_of[key as u32 as usize] = place as u32;
        }
        self.levels.iter_mut().for_each(Vec::clear);
        let mut children = boxes.len();
        for level in 0.. {
            let nodes = children.div_ceil(LANES);
            if self.levels.len() == level {
                self.levels.push(Vec::new());
            }
            grow(&mut self.levels[level], nodes)?;
            let (below, here) = self.levels.split_at_mut(level);
            if let Some(below) = below.last() {
                for (at, node) in below.iter().enumerate() {
                    here[0][at / LANES].set(at % LANES, &node.bounds());
                }
            } else {
                for (place, &id) in self.ids[..self.places].iter().enumerate() {
                    here[0][place / LANES].set(place % LANES, &boxes[id as usize]);
                }
            }
            if nodes <= LANES {
                break;
            }
            children = nodes;
        }
        Ok(())
    }

    /// Adds a box that is not in the tree. It has no bounds there before [`Tree::follow`] sets them.
    pub(super) fn insert(&mut self, id: u32) -> Result<(), Error> {
        ensure(&mut self.ids, self.places + 1, "boxes in a tree")?;
        ensure(&mut self.place_of, id as usize + 1, "boxes in a tree")?;
        self.ids[self.places] = id;
        self.place_of[id as usize] = self.places as u32;
        self.places += 1;
        // The last level takes whatever is added, so that no new level has to be made of what is there.
        let mut children = self.places;
        for level in self.levels.iter_mut().take_while(|level| !level.is_empty()) {
            children = children.div_ceil(LANES);
            grow(level, children)?;
        }
        Ok(())
    }

    /// Takes out a box.
    pub(super) fn remove(&mut self, id: u32) {
        let place = self.place_of[id as usize] as usize;
        self.levels[0][place / LANES].set(place % LANES, &NOTHING);
        self.ids[place] = GONE;
    }

    /// Gives boxes in the tree the bounds that they have now, `boxes[id]`.
    pub(super) fn follow(
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
        // In the order of the tree, so that what one box needs of it is still in the cache for the next.
        sort(workers, &mut self.keys, &mut self.scratch, self.moved)?;
        let keys = &self.keys[..self.moved];
        let Some((leaves, above)) = self.levels.split_first_mut() else { return Ok(()) };
        // Each task has leaves of its own.
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

    /// Part `k` of `parts` of the boxes that moved, those near in space together.
    pub(super) fn moved(&self, k: usize, parts: usize) -> impl Iterator<Item = u32> {
        self.keys[part(self.moved, k, parts)].iter().map(|&key| key as u32)
    }

    /// Calls `found` for every box that overlaps these bounds.
    #[inline]
    pub(super) fn overlapping(&self, bounds: &Aabb, mut found: impl FnMut(u32)) {
        let far = self.places > FAR;
        each_overlapping(self.simd, &self.levels, far, bounds, |place| {
            // Lanes that hold nothing, and those of boxes that are gone, overlap infinite bounds.
            if place < self.places && self.ids[place] != GONE {
                found(self.ids[place]);
            }
        });
    }
}

/// Adds empty nodes to a level until it has this many.
fn grow(level: &mut Vec<Node>, nodes: usize) -> Result<(), Error> {
    if level.len() < nodes {
        let refused = |_| Error::OutOfMemory { what: "nodes of a tree", elements: nodes };
        level.try_reserve(nodes - level.len()).map_err(refused)?;
        level.resize(nodes, Node::EMPTY);
    }
    Ok(())
}

/// Orders boxes so that those near in space, and of a size, are near in the order.
struct Curve {
    origin: [f32; 3],
    inverse_edge: f32,
    /// Edges from which on a box belongs to the next class of sizes.
    classes: [f32; 3],
}

/// Cells of the curve on each axis: ten bits.
const CELLS: f32 = 1024.0;

impl Curve {
    fn over(sample: &Sample) -> Self {
        let range = [0, 1, 2].map(|a| sample.range(a));
        let longest = range.iter().map(|r| r.1).fold(0.0, f64::max);
        let inverse = (f64::from(CELLS) / longest) as f32;
        // Boxes much larger than the others would widen the leaves that they share with them.
        let edge = sample.extent.iter().copied().fold(0.0, f64::max) as f32;
        Self {
            origin: range.map(|r| r.0 as f32),
            inverse_edge: if inverse.is_finite() { inverse } else { 0.0 },
            classes: [2.0 * edge, 8.0 * edge, 32.0 * edge],
        }
    }

    fn key(&self, b: &Aabb) -> u32 {
        let cell = |a: usize| {
            // NaN, of infinity less infinity, becomes 0.
            let middle = b.min[a] * 0.5 + b.max[a] * 0.5;
            ((middle - self.origin[a]) * self.inverse_edge).clamp(0.0, CELLS - 1.0) as u32
        };
        let edge = (0..3).map(|a| b.max[a] - b.min[a]).fold(0.0, f32::max);
        let class = self.classes.iter().filter(|&&from| edge > from).count() as u32;
        class << 30 | spread(cell(0)) | spread(cell(1)) << 1 | spread(cell(2)) << 2
    }
}

/// Ten bits with two zeros between any two of them.
fn spread(v: u32) -> u32 {
    let v = (v | v << 16) & 0x0300_00ff;
    let v = (v | v << 8) & 0x0300_f00f;
    let v = (v | v << 4) & 0x030c_30c3;
    (v | v << 2) & 0x0924_9249
}
