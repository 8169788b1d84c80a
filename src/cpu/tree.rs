//! A tree of boxes with 16 children a node, built in the order of a space-filling curve.
//!
//! Sixteen boxes that are near in space share a leaf, sixteen leaves a node, and so on. One test compares a box with
//! all 16. Dense places don't matter: if more than two leaves of boxes share a cell of the curve, a finer curve orders
//! them.

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
use crate::load::SceneStats;
use crate::pairs::Pairs;
use curve::{Curve, Order};
use std::ops::Range;

/// The id of an empty lane. No box has it: there are at most this many boxes.
pub(crate) const NOBODY: u32 = u32::MAX;

/// Number of boxes above which the tree is likely not in the second-level cache: 1.2 MB of boxes, and as much in the
/// tree.
pub(crate) const FAR: usize = 50_000;

/// Boxes to prefetch ahead.
const AHEAD: usize = 16;

/// Fewest nodes above the leaves that a task fills, with their 256 boxes each.
const SMALLEST_FILL: usize = 4;

/// See the module.
#[derive(Debug)]
pub(crate) struct Tree {
    /// The box in each lane of the leaves, leaf after leaf.
    ids: Vec<u32>,
    /// Places in use, those of removed boxes included.
    places: usize,
    /// The leaves, then nodes with the bounds of the leaves, and so on. There are at least two levels. The last level
    /// that is not empty had at most 16 nodes when the tree was built.
    levels: Vec<Vec<Node>>,
    /// Leaves with boxes that may move. The leaves behind them hold fixed boxes.
    moving: usize,
    order: Order,
    simd: Simd,
}

/// The boxes of a frame that are in a tree.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Members<'a> {
    /// Every box.
    All,
    /// The boxes at these positions, which ascend.
    Of(&'a [u32]),
}

impl Tree {
    pub(crate) fn new(simd: Simd) -> Self {
        Self { ids: Vec::new(), places: 0, levels: Vec::new(), moving: 0, order: Order::default(), simd }
    }

    /// Reserves memory for a tree of this many boxes.
    pub(crate) fn reserve(&mut self, objects: usize) -> Result<(), Error> {
        self.order.reserve(objects)
    }

    /// Builds the tree of the members of `boxes`, of which `stats` are the statistics. Boxes that `filter` calls fixed
    /// come last.
    ///
    /// # Errors
    /// [`Error::InvalidBox`] for the first invalid member, and [`Error::OutOfMemory`].
    pub(crate) fn build(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        members: Members<'_>,
        stats: &SceneStats,
        filter: Option<&Filter>,
    ) -> Result<(), Error> {
        let Self { ids, places: in_use, levels, moving, order, .. } = self;
        let split = order.sort(workers, boxes, members, &Curve::over(stats), filter)?;
        let sorted = order.ids();
        // The fixed boxes begin a new leaf.
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
                    // Neighbours on the curve lie anywhere in memory.
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

    /// Returns part `k` of `parts` of the leaves with boxes that may move. All pairs are found from these leaves.
    pub(crate) fn part(&self, k: usize, parts: usize) -> Range<usize> {
        part(self.moving, k, parts)
    }

    /// Adds the pairs of the boxes in these leaves with each other and with those in all leaves behind.
    pub(crate) fn self_pairs(&self, leaves: Range<usize>, pairs: &mut Pairs) {
        self.walk().self_pairs(self.simd, leaves, pairs);
    }

    /// Adds the pairs of the boxes of a group with those in the tree. None of the group is in the tree.
    pub(crate) fn pairs_with(&self, group: &Group, pairs: &mut Pairs) {
        self.walk().pairs_with(self.simd, group, pairs);
    }

    /// Calls `found` for every box that overlaps these bounds. Returns the number of visited nodes.
    #[inline]
    pub(crate) fn overlapping(&self, bounds: &Aabb, mut found: impl FnMut(u32)) -> u32 {
        self.walk().each_overlapping(self.simd, bounds, |place| found(self.ids[place]))
    }

    fn walk(&self) -> Walk<'_> {
        Walk { levels: &self.levels, ids: &self.ids, far: self.ids.len() > FAR }
    }

    /// Returns the box at each place: place `p` is lane `p % 16` of leaf `p / 16`.
    pub(crate) fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Adds a box without bounds behind all others, and returns its place.
    pub(crate) fn append(&mut self, id: u32) -> Result<usize, Error> {
        let place = self.places;
        if place == self.ids.len() {
            let places = (place / LANES + 1) * LANES;
            grow(&mut self.ids, places, NOBODY)?;
            let mut nodes = places / LANES;
            // The last level grows beyond 16 nodes, so that no level has to be added.
            for level in self.levels.iter_mut().take_while(|level| !level.is_empty()) {
                grow(level, nodes, Node::EMPTY)?;
                nodes = nodes.div_ceil(LANES);
            }
        }
        self.ids[place] = id;
        self.places += 1;
        Ok(place)
    }

    /// Removes the box at a place.
    pub(crate) fn remove(&mut self, place: usize) {
        self.levels[0][place / LANES].empty(place % LANES);
        self.ids[place] = NOBODY;
    }

    /// Returns the leaves, and the levels above them from the lowest on.
    pub(crate) fn levels_mut(&mut self) -> Option<(&mut Vec<Node>, &mut [Vec<Node>])> {
        self.levels.split_first_mut()
    }
}

/// Makes room for this many places and for the nodes above them, with unspecified content. Returns the number of
/// levels.
fn lay_out(levels: &mut Vec<Vec<Node>>, ids: &mut Vec<u32>, places: usize) -> Result<usize, Error> {
    let mut nodes = places.div_ceil(LANES);
    ids.truncate(nodes * LANES);
    grow(ids, nodes * LANES, NOBODY)?;
    let mut level = 0;
    loop {
        if levels.len() == level {
            levels.push(Vec::new());
        }
        levels[level].truncate(nodes);
        grow(&mut levels[level], nodes, Node::EMPTY)?;
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

/// Adds empty elements to a list until it has at least this many.
fn grow<T: Copy>(list: &mut Vec<T>, len: usize, empty: T) -> Result<(), Error> {
    if list.len() < len {
        let refused = |_| Error::OutOfMemory { what: "boxes in a tree", elements: len };
        list.try_reserve(len - list.len()).map_err(refused)?;
        list.resize(len, empty);
    }
    Ok(())
}
