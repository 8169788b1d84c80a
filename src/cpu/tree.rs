//! A tree of boxes with 16 children a node, made in the order of a curve through space.
//!
//! Sixteen boxes that are near in space share a leaf, sixteen leaves a node, and so on; one test compares a box with all 16. Where boxes
//! lie does not matter: the curve begins anew, on a scale of its own, wherever more than two leaves of boxes share one of its cells.

mod curve;

use crate::aabb::Aabb;
use crate::cpu::columns::part;
use crate::cpu::kernel::node::{Group, LANES, Node};
use crate::cpu::kernel::prefetch;
use crate::cpu::kernel::walk::Walk;
use crate::cpu::level::Simd;
use crate::cpu::workers::Workers;
use crate::error::Error;
use crate::filter::Filter;
use crate::load::Sample;
use crate::pairs::Pairs;
use curve::{Curve, Order};
use std::ops::Range;

/// In place of a box where a lane of a leaf has none. No box has this number: there are at most this many.
pub(crate) const NOBODY: u32 = u32::MAX;

/// Boxes from which on what belongs to them is likely not in the second-level cache: 1.2 MB of boxes, and as much in the tree.
pub(crate) const FAR: usize = 50_000;

/// Boxes that are asked for before they are needed.
const AHEAD: usize = 16;

/// Nodes above the leaves that one task fills at the least, with their 256 boxes each.
const SMALLEST_FILL: usize = 4;

/// See the module.
#[derive(Debug)]
pub(crate) struct Tree {
    /// The box in each lane of the leaves, leaf after leaf.
    ids: Vec<u32>,
    /// Places in use, those of boxes that were taken out included.
    places: usize,
    /// The leaves, which hold boxes; then nodes that hold bounds of the leaves, and so on. There are two levels at least, and the last one
    /// that is not empty had 16 nodes at most when the tree was made.
    levels: Vec<Vec<Node>>,
    /// Leaves that hold boxes that may move; those behind them hold fixed ones.
    moving: usize,
    order: Order,
    simd: Simd,
}

/// Which boxes of a frame are in a tree.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Members<'a> {
    /// Every box.
    All,
    /// Those at these positions, which ascend.
    Of(&'a [u32]),
}

impl Tree {
    pub(crate) fn new(simd: Simd) -> Self {
        Self { ids: Vec::new(), places: 0, levels: Vec::new(), moving: 0, order: Order::default(), simd }
    }

    /// Makes room for a tree of this many boxes.
    pub(crate) fn reserve(&mut self, objects: usize) -> Result<(), Error> {
        self.order.reserve(objects)
    }

    /// Makes the tree of the members among `boxes`, which look like the sample. Boxes that `filter` calls fixed come last.
    ///
    /// # Errors
    /// [`Error::InvalidBox`] for the first member that is one, and [`Error::OutOfMemory`].
    pub(crate) fn build(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        members: Members<'_>,
        sample: &Sample,
        filter: Option<&Filter>,
    ) -> Result<(), Error> {
        let Self { ids, places: in_use, levels, moving, order, .. } = self;
        let split = order.sort(workers, boxes, members, &Curve::over(sample), filter)?;
        let sorted = order.ids();
        // The fixed boxes begin with a leaf of their own.
        *moving = split.div_ceil(LANES);
        let fixed_from = if split == sorted.len() { split } else { *moving * LANES };
        let places = fixed_from + sorted.len() - split;
        *in_use = places;
        let used = lay_out(levels, ids, places)?;
        let (leaves, above) = levels.split_at_mut(1);
        let parents = &mut above[0];
        let size = parents.len().div_ceil(workers.tasks()).max(SMALLEST_FILL);
        let parts =
            parents.chunks_mut(size).zip(leaves[0].chunks_mut(size * LANES)).zip(ids.chunks_mut(size * LANES * LANES));
        workers.each_of(parts.zip((0..).step_by(size * LANES * LANES)), |(((parents, leaves), ids), first)| {
            for (at, leaf) in leaves.iter_mut().enumerate() {
                *leaf = Node::EMPTY;
                let mut bounds: Option<Aabb> = None;
                for lane in 0..LANES {
                    let place = first + at * LANES + lane;
                    let from = if place < split {
                        place
                    } else if (fixed_from..places).contains(&place) {
                        place - fixed_from + split
                    } else {
                        ids[at * LANES + lane] = NOBODY;
                        continue;
                    };
                    // In the order of the curve boxes lie anywhere in memory.
                    if let Some(&next) = sorted.get(from + AHEAD) {
                        prefetch(&boxes[next as u32 as usize]);
                    }
                    let id = sorted[from] as u32;
                    let b = &boxes[id as usize];
                    ids[at * LANES + lane] = id;
                    leaf.set(lane, b);
                    bounds = Some(bounds.map_or(*b, |all| all.union(b)));
                }
                if at % LANES == 0 {
                    parents[at / LANES] = Node::EMPTY;
                }
                if let Some(bounds) = bounds {
                    parents[at / LANES].set(at % LANES, &bounds);
                }
            }
        });
        for level in 1..used - 1 {
            let (below, here) = levels.split_at_mut(level + 1);
            here[0].fill(Node::EMPTY);
            for (at, node) in below[level].iter().enumerate() {
                here[0][at / LANES].set(at % LANES, &node.bounds());
            }
        }
        Ok(())
    }

    /// Part `k` of `parts` of the leaves that hold boxes that may move: all pairs are found from those.
    pub(crate) fn part(&self, k: usize, parts: usize) -> Range<usize> {
        part(self.moving, k, parts)
    }

    /// Adds the pairs of the boxes in these leaves, which hold moving boxes, with one another and with those in all leaves behind.
    pub(crate) fn self_pairs(&self, leaves: Range<usize>, pairs: &mut Pairs) {
        self.walk().self_pairs(self.simd, leaves, pairs);
    }

    /// Adds the pairs of the boxes of a group, none of which is in the tree, with those in the tree.
    pub(crate) fn pairs_with(&self, group: &Group, pairs: &mut Pairs) {
        self.walk().pairs_with(self.simd, group, pairs);
    }

    /// Calls `found` for every box that overlaps these bounds. Returns how many nodes it looked at.
    #[inline]
    pub(crate) fn overlapping(&self, bounds: &Aabb, mut found: impl FnMut(u32)) -> u32 {
        self.walk().each_overlapping(self.simd, bounds, |place| found(self.ids[place]))
    }

    fn walk(&self) -> Walk<'_> {
        Walk { levels: &self.levels, ids: &self.ids, far: self.ids.len() > FAR }
    }

    /// The box at each place: lane `p % 16` of leaf `p / 16`.
    pub(crate) fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Adds a box behind all others, at the place that is returned, without bounds.
    pub(crate) fn append(&mut self, id: u32) -> Result<usize, Error> {
        let place = self.places;
        if place == self.ids.len() {
            let places = (place / LANES + 1) * LANES;
            grow_list(&mut self.ids, places)?;
            let mut nodes = places / LANES;
            // The last level takes whatever is added, so that no new level has to be made of what is there.
            for level in self.levels.iter_mut().take_while(|level| !level.is_empty()) {
                grow(level, nodes)?;
                nodes = nodes.div_ceil(LANES);
            }
        }
        self.ids[place] = id;
        self.places += 1;
        Ok(place)
    }

    /// Takes the box at a place out of the tree.
    pub(crate) fn remove(&mut self, place: usize) {
        self.levels[0][place / LANES].empty(place % LANES);
        self.ids[place] = NOBODY;
    }

    /// The leaves, and the levels above them from the lowest on.
    pub(crate) fn levels_mut(&mut self) -> Option<(&mut Vec<Node>, &mut [Vec<Node>])> {
        self.levels.split_first_mut()
    }
}

/// Makes room for this many places and for the nodes over them, and leaves what is in them as it is. Returns the number of levels.
fn lay_out(levels: &mut Vec<Vec<Node>>, ids: &mut Vec<u32>, places: usize) -> Result<usize, Error> {
    let mut nodes = places.div_ceil(LANES);
    ids.truncate(nodes * LANES);
    grow_list(ids, nodes * LANES)?;
    let mut level = 0;
    loop {
        if levels.len() == level {
            levels.push(Vec::new());
        }
        levels[level].truncate(nodes);
        grow(&mut levels[level], nodes)?;
        if level > 0 && nodes <= LANES {
            break;
        }
        level += 1;
        nodes = nodes.div_ceil(LANES);
    }
    // Levels of a larger tree keep their memory.
    levels[level + 1..].iter_mut().for_each(Vec::clear);
    Ok(level + 1)
}

fn grow_list(ids: &mut Vec<u32>, places: usize) -> Result<(), Error> {
    ids.try_reserve(places.saturating_sub(ids.len()))
        .map_err(|_| Error::OutOfMemory { what: "boxes in a tree", elements: places })?;
    ids.resize(places, NOBODY);
    Ok(())
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
