//! A tree of boxes with 16 children a node, built in the order of a space-filling curve.
//!
//! Sixteen boxes that are near in space share a leaf, sixteen leaves a node, and so on. One test compares a box with
//! all 16. Dense places don't matter: if more than two leaves of boxes share a cell of the curve, a finer curve orders
//! them. Nor do boxes as long as the world: the order has a part for each shape of oversized boxes. See [`curve`].
//! Pairs of two shapes may be cheaper to find without the tree: see [`sweeps`].

mod codes;
mod curve;
mod insertion;
mod order;
mod queries;
mod renewal;
mod sweeps;
mod upkeep;
mod wear;

use crate::cpu::kernel::bounds::Bounds;
use crate::cpu::kernel::walk;
use crate::cpu::{Group, LANES, Marks, Node, Simd, SimdLevel, Walk, Workers, part, prefetch, reserve};
use crate::{Aabb, Error, FramePlan, Pairs, SceneStats, Screen};
use curve::Curve;
use order::Order;
use renewal::Renewal;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use sweeps::{Kind, Sweeps};

pub(crate) use queries::Near;
pub(crate) use upkeep::Upkeep;
pub(crate) use wear::Wear;

/// The id of an empty lane. No box has it: there are at most this many boxes.
pub(crate) const NOBODY: u32 = u32::MAX;

/// Number of boxes above which the tree is likely not in the second-level cache: 1.2 MB of boxes, and as much in the
/// tree.
pub(crate) const FAR: usize = 50_000;

/// Boxes to prefetch ahead.
const AHEAD: usize = 16;

/// Fewest nodes above the leaves that a task fills, with their 256 boxes each.
const SMALLEST_FILL: usize = 4;

/// Places over boxes beyond which a tree has too many empty lanes.
const MOST_PLACES: f64 = 4.0 / 3.0;

/// See the module.
#[derive(Debug, Default)]
pub struct Tree {
    /// The box in each lane of the leaves, leaf after leaf.
    ids: Vec<u32>,
    /// Places in use, those of removed boxes included.
    pub(crate) places: usize,
    /// The leaves, then nodes with the bounds of the leaves, and so on. There are at least two levels. The last level
    /// that is not empty had at most 16 nodes when the tree was built.
    levels: Vec<Vec<Node>>,
    /// The memberships of all nodes if the filter is [partial](Screen::is_partial), otherwise empty.
    marks: Vec<Vec<Marks>>,
    /// Leaves with active boxes. The leaves behind them hold [passive](Screen) boxes.
    active: usize,
    sweeps: Sweeps,
    order: Order,
    /// The curve of the present order.
    curve: Option<Curve>,
    renewal: Option<Renewal>,
    /// Boxes that are being inserted.
    inserted: Vec<u64>,
    /// The leaves into which boxes are inserted, ascending: the code at which each began, and its number.
    leaves: Vec<(u32, u32)>,
    simd: Simd,
}

/// The boxes of a frame that are in a tree.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Members<'a> {
    /// The boxes from this position on.
    From(usize),
    /// The boxes at these positions, which ascend.
    Of(&'a [u32]),
}

/// The boxes of a frame, what the filter rules out among them, and the threads that work on them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Input<'a> {
    pub(crate) workers: &'a Workers,
    pub(crate) boxes: &'a [Aabb],
    pub(crate) screen: Option<&'a Screen>,
}

impl Members<'_> {
    fn len(&self, boxes: &[Aabb]) -> usize {
        match self {
            Self::From(first) => boxes.len() - first,
            Self::Of(ids) => ids.len(),
        }
    }
}

impl Tree {
    pub(crate) fn new(simd: Simd) -> Self {
        Self { simd, ..Self::default() }
    }

    /// Builds the tree of these boxes on one thread.
    ///
    /// # Errors
    /// [`Error::InvalidBox`] for the first invalid box, and [`Error::OutOfMemory`].
    pub fn of(boxes: &[Aabb]) -> Result<Self, Error> {
        let mut tree = Self::new(Simd::at_most(SimdLevel::in_use()));
        let input = Input { workers: &Workers::one(), boxes, screen: None };
        tree.build(input, Members::From(0), &SceneStats::of(boxes))?;
        Ok(tree)
    }

    /// Reserves memory for a tree of this many boxes.
    pub(crate) fn reserve(&mut self, objects: usize) -> Result<(), Error> {
        self.order.reserve(objects)
    }

    /// Builds the tree of the members, of which `stats` are the statistics. Passive boxes come last.
    ///
    /// # Errors
    /// [`Error::InvalidBox`] for the first invalid member, and [`Error::OutOfMemory`].
    pub(crate) fn build(&mut self, input: Input<'_>, members: Members<'_>, stats: &SceneStats) -> Result<(), Error> {
        let curve = Curve::over(stats, members.len(input.boxes));
        let split = self.order.sort(input, members, &curve)?;
        self.arrange(input, curve, split, |_| false)?;
        self.sweep(input);
        Ok(())
    }

    /// Puts the sorted boxes into leaves. The first `split` of them are active.
    fn arrange(
        &mut self,
        input: Input<'_>,
        curve: Curve,
        split: usize,
        out: impl Fn(u32) -> bool + Sync,
    ) -> Result<(), Error> {
        let Self { ids, places: in_use, levels, active, sweeps, order, .. } = self;
        let sorted = order.ids();
        // The passive boxes begin a new leaf.
        *active = split.div_ceil(LANES);
        let passive_from = if split == sorted.len() { split } else { *active * LANES };
        *in_use = passive_from + sorted.len() - split;
        lay_out(levels, ids, *in_use)?;
        let places = &mut ids[..*in_use];
        places[split..passive_from].fill(NOBODY);
        let passive = places.len().min(passive_from);
        let (before, behind) = places.split_at_mut(passive);
        let of = |_, &key: &u64| if out(key as u32) { NOBODY } else { key as u32 };
        input.workers.map(&sorted[..split], &mut before[..split], of);
        input.workers.map(&sorted[split..], behind, of);
        ids[*in_use..].fill(NOBODY);
        sweeps.begin(order.shapes.iter().map(|(long, at)| {
            let by = if at.start < split { 0 } else { passive_from - split };
            Kind { long: *long, leaves: (at.start + by).div_ceil(LANES)..(at.end + by) / LANES }
        }));
        self.fill(input, |_, _| true);
        self.leaves.clear();
        self.leaves.extend(self.order.starts.iter().copied().zip(0..));
        (self.curve, self.renewal) = (Some(curve), None);
        self.mark(input)
    }

    /// Chooses the pairs that are not found by walking through the tree.
    fn sweep(&mut self, input: Input<'_>) {
        let Self { ids, levels, active, sweeps, order, simd, .. } = self;
        let tree = Walk { levels, ids, far: false, apart: &[], marks: None };
        // Without memory for a sweep, the tree finds its pairs.
        let _ = sweeps.choose(&tree, *active, *simd, order, input);
    }

    /// Makes room for the boxes from position `before` on, which are new, in leaves behind all others. Boxes beyond the
    /// last one are taken out by [`refit`](Self::refit). Returns `false` if the tree has to be built instead.
    fn resize(&mut self, input: Input<'_>, before: usize, plan: &FramePlan) -> bool {
        let Self { ids, places, levels, active, order, .. } = self;
        let Input { boxes, screen, .. } = input;
        if boxes.len() <= before {
            return true;
        }
        // Behind passive boxes stand no others, because pairs are only looked for from the leaves before them.
        let all_active = places.div_ceil(LANES) <= *active;
        let all_passive = || screen.is_some_and(|s| (before..boxes.len()).all(|id| s.is_passive(id)));
        if boxes.len() - before > before / 4 || !all_active && !all_passive() {
            return false;
        }
        let curve = Curve::over(&plan.stats(boxes), boxes.len() - before);
        if order.sort(Input { screen: None, ..input }, Members::From(before), &curve).is_err() {
            // A build reports the error.
            return false;
        }
        let first = ids.len();
        *places = first + boxes.len() - before;
        if all_active {
            *active = places.div_ceil(LANES);
        }
        if lay_out(levels, ids, *places).is_err() {
            return false;
        }
        ids[first..].fill(NOBODY);
        ids[first..].iter_mut().zip(order.ids()).for_each(|(id, &key)| *id = key as u32);
        true
    }

    /// Gives each box of the tree its present bounds, and takes out those beyond the last one. Returns `false` if a box
    /// is invalid, or has become passive or ceased to be; then the tree is of no use.
    fn refit(&mut self, input: Input<'_>) -> bool {
        let passive_from = self.active * LANES;
        let is_passive = |id| input.screen.is_some_and(|s| s.is_passive(id));
        let right = if input.screen.is_none() && self.places <= passive_from {
            self.fill(input, |_, _| true)
        } else {
            self.fill(input, |place, id| is_passive(id) == (place >= passive_from))
        };
        // A build reports an error.
        if !right || self.mark(input).is_err() {
            return false;
        }
        self.sweep(input);
        true
    }

    /// Writes the bounds of all boxes to the leaves, and those of the leaves to the nodes above. Returns whether every
    /// box is valid and `belongs` to its place.
    fn fill(&mut self, input: Input<'_>, belongs: impl Fn(usize, usize) -> bool + Sync) -> bool {
        let (Self { ids, levels, .. }, Input { workers, boxes, .. }) = (self, input);
        let used = levels.iter().rposition(|level| !level.is_empty()).map_or(0, |top| top + 1);
        let (leaves, above) = levels.split_at_mut(1);
        let parents = &mut above[0];
        let size = parents.len().div_ceil(workers.tasks()).max(SMALLEST_FILL);
        let parts =
            parents.chunks_mut(size).zip(leaves[0].chunks_mut(size * LANES)).zip(ids.chunks_mut(size * LANES * LANES));
        let right = AtomicBool::new(true);
        workers.each_of(parts.zip((0..).step_by(size * LANES * LANES)), |(((parents, leaves), ids), start)| {
            let mut all_right = true;
            for (at, leaf) in leaves.iter_mut().enumerate() {
                *leaf = Node::EMPTY;
                let first = at * LANES;
                let mut bounds = Bounds::none();
                for lane in 0..LANES {
                    // Neighbours on the curve lie anywhere in memory.
                    if let Some(next) = ids.get(first + lane + AHEAD).and_then(|&id| boxes.get(id as usize)) {
                        prefetch(next);
                    }
                    let id = ids[first + lane] as usize;
                    let Some(b) = boxes.get(id) else {
                        ids[first + lane] = NOBODY;
                        continue;
                    };
                    leaf.set(lane, b);
                    bounds.add(b);
                    all_right &= belongs(start + first + lane, id);
                }
                if at % LANES == 0 {
                    parents[at / LANES] = Node::EMPTY;
                }
                all_right &= bounds.is_valid();
                if let Some(bounds) = bounds.get() {
                    parents[at / LANES].set(at % LANES, &bounds);
                }
            }
            if !all_right {
                right.store(false, Relaxed);
            }
        });
        for level in 1..used.saturating_sub(1) {
            let (below, here) = levels.split_at_mut(level + 1);
            here[0].fill(Node::EMPTY);
            for (at, node) in below[level].iter().enumerate() {
                here[0][at / LANES].set(at % LANES, &node.bounds());
            }
        }
        right.into_inner()
    }

    /// Writes the memberships of all boxes to the leaves, and their unions to the nodes above.
    fn mark(&mut self, Input { workers, screen, .. }: Input<'_>) -> Result<(), Error> {
        let Self { ids, levels, marks, .. } = self;
        let Some(screen) = screen.filter(|screen| screen.is_partial) else {
            marks.clear();
            return Ok(());
        };
        marks.resize_with(levels.len(), Vec::new);
        for (marks, level) in marks.iter_mut().zip(&*levels) {
            marks.truncate(level.len());
            grow(marks, level.len(), Marks::EMPTY)?;
        }
        let leaves = &mut marks[0];
        let size = leaves.len().div_ceil(workers.tasks()).max(SMALLEST_FILL * LANES);
        workers.each_of(leaves.chunks_mut(size).zip(ids.chunks(size * LANES)), |(leaves, ids)| {
            Marks::fill(leaves, ids, &screen.filter);
        });
        for level in 1..marks.len() {
            let (below, here) = marks.split_at_mut(level);
            for (node, below) in here[0].iter_mut().zip(below[level - 1].chunks(LANES)) {
                *node = Marks::above(below);
            }
        }
        Ok(())
    }

    /// Returns half the surface area of all leaves, whose edges count as at most `longest`.
    fn half_area(&self, longest: f32) -> f64 {
        self.levels.get(1).map_or(0.0, |level| level.iter().map(|node| f64::from(node.half_area(longest))).sum())
    }

    /// Returns whether too many lanes are empty for this many boxes.
    pub(crate) fn is_sparse(&self, boxes: usize) -> bool {
        self.places as f64 > MOST_PLACES * boxes as f64 + 64.0
    }

    /// Adds part `k` of `parts` of the pairs of its boxes with each other, without those of two passive boxes.
    pub(crate) fn self_pairs(&self, k: usize, parts: usize, pairs: &mut Pairs) {
        // All pairs are found from the leaves with active boxes.
        walk::self_pairs(self.simd, &self.walk(), part(self.active, k, parts), pairs);
        self.sweeps.pairs(k, parts, pairs);
    }

    /// Adds the pairs of the boxes of a group with those in the tree. None of the group is in the tree.
    pub(crate) fn pairs_with(&self, group: &Group, pairs: &mut Pairs) {
        walk::pairs_with(self.simd, &self.walk(), group, pairs);
    }

    fn walk(&self) -> Walk<'_> {
        let marks = Some(&self.marks[..]).filter(|marks| !marks.is_empty());
        Walk { levels: &self.levels, ids: &self.ids, far: self.ids.len() > FAR, apart: &self.sweeps.apart, marks }
    }

    /// Sorts boxes that are not in the tree along its curve. Until it is built again, [`others`](Self::others) returns
    /// them.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub(crate) fn sort_others(&mut self, workers: &Workers, boxes: &[Aabb]) -> Result<(), Error> {
        let curve = self.curve.take().unwrap_or_else(|| Curve::over(&SceneStats::of(boxes), boxes.len()));
        self.order.sort(Input { workers, boxes, screen: None }, Members::From(0), &curve).map(drop)
    }

    /// Returns the sorted boxes: their positions are in the lower halves.
    pub(crate) fn others(&self) -> &[u64] {
        self.order.ids()
    }

    /// Returns the box at each place: place `p` is lane `p % 16` of leaf `p / 16`.
    pub(crate) fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Returns the levels: the leaves, their parents, and so on.
    pub(crate) fn levels_mut(&mut self) -> &mut [Vec<Node>] {
        &mut self.levels
    }
}

/// Makes room for this many places and for the nodes above them, with unspecified content.
fn lay_out(levels: &mut Vec<Vec<Node>>, ids: &mut Vec<u32>, places: usize) -> Result<(), Error> {
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
    Ok(())
}

/// Adds empty elements to a list until it has at least this many.
fn grow<T: Copy>(list: &mut Vec<T>, len: usize, empty: T) -> Result<(), Error> {
    if list.len() < len {
        reserve(list, len - list.len(), "boxes in a tree")?;
        list.resize(len, empty);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn third_of_the_places_may_be_empty() {
        let is_sparse = |places| Tree { places, ..Tree::default() }.is_sparse(1000);
        assert!(!is_sparse(1200) && is_sparse(1500));
    }
}
