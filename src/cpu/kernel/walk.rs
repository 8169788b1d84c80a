//! Walks through a tree of nodes: finds the boxes that overlap a box, and the overlapping pairs.

use super::{Baseline, Group, LANES, Level, Marks, Node, Wanted, at_level, prefetch};
use crate::pairs::each_bit;
use crate::{Aabb, Membership, Pairs};
use std::ops::Range;

/// The nodes of a tree, and the box in each lane of its leaves.
///
/// Lane k of node n in a level above the leaves contains node 16 n + k of the level below. The last level that has
/// nodes is the top. There is at least one level above the leaves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Walk<'a> {
    pub(crate) levels: &'a [Vec<Node>],
    /// 16 for each leaf.
    pub(crate) ids: &'a [u32],
    /// Whether to prefetch nodes: they are likely not in the cache.
    pub(crate) far: bool,
    /// Leaves that are not compared with each other, ascending by `others`.
    pub(crate) apart: &'a [Apart],
    /// The memberships of all nodes, if walks test them.
    pub(crate) marks: Option<&'a [Vec<Marks>]>,
}

/// The boxes that are compared with those of a leaf.
struct Side<'a, W: Wanted> {
    node: &'a Node,
    bounds: &'a Aabb,
    ids: &'a [u32; LANES],
    marks: W,
    /// The query for the marks of others.
    by: &'a W::Query,
}

/// Returns what a walk tests beside bounds, for a level and a node of it.
trait MarksOf<W>: Fn(usize, usize) -> W + Copy {}
impl<W, F: Fn(usize, usize) -> W + Copy> MarksOf<W> for F {}

/// Returns nothing to test.
fn unmarked(_level: usize, _node: usize) {}

/// Returns the memberships to test.
fn marked(marks: &[Vec<Marks>]) -> impl MarksOf<&Marks> {
    |level, node| &marks[level][node]
}

/// Leaves whose pairs with others behind them are found in another way.
#[derive(Debug)]
pub(crate) struct Apart {
    pub(crate) leaves: Range<usize>,
    pub(crate) others: Range<usize>,
}

/// Leaves of a range from which costs are estimated, at most.
pub(crate) const SAMPLE: usize = 32;

/// Levels of a tree of 2^32 boxes.
pub(super) const MOST_LEVELS: usize = 9;

at_level! {
    /// Calls `found` for every place in the leaves whose box overlaps `b` and, if the tree has marks, is wanted `by`
    /// the box. Returns the number of nodes compared with it.
    #[inline]
    pub(crate) fn each_overlapping[] [](
        walk: &Walk<'_>, b: &Aabb, by: impl FnOnce() -> Membership, found: impl FnMut(usize)
    ) -> u32 = Walk::each_overlapping;

    /// Adds the pairs of the boxes in these leaves with each other and with those in all leaves behind.
    pub(crate) fn self_pairs[] [](walk: &Walk<'_>, leaves: Range<usize>, pairs: &mut Pairs) = Walk::self_pairs;

    /// Adds the pairs of the boxes of a group with those in the leaves.
    pub(crate) fn pairs_with[] [](walk: &Walk<'_>, group: &Group, pairs: &mut Pairs) = Walk::pairs_with;
}

impl Walk<'_> {
    #[inline(always)]
    fn each_overlapping<L: Level>(
        &self,
        b: &Aabb,
        by: impl FnOnce() -> Membership,
        found: impl FnMut(usize),
        level: L,
    ) -> u32 {
        match self.marks {
            None => self.each((b, &()), 0..usize::MAX, 0, unmarked, found, level),
            Some(marks) => self.each((b, &by()), 0..usize::MAX, 0, marked(marks), found, level),
        }
    }

    #[inline(always)]
    fn self_pairs<L: Level>(&self, leaves: Range<usize>, pairs: &mut Pairs, level: L) {
        match self.marks {
            _ if pairs.is_any_over() => {}
            None => self.leaves_with_all_behind(leaves, unmarked, pairs, level),
            Some(marks) => self.leaves_with_all_behind(leaves, marked(marks), pairs, level),
        }
    }

    #[inline(always)]
    fn pairs_with<L: Level>(&self, group: &Group, pairs: &mut Pairs, level: L) {
        if pairs.is_any_over() {
            return;
        }
        let Some(marks) = self.marks else { return self.group_with_all(group, (), unmarked, pairs, level) };
        let of_group = pairs.screen().map_or(Marks::ALL, |screen| Marks::of(&group.ids, &screen.filter));
        self.group_with_all(group, &of_group, marked(marks), pairs, level);
    }

    #[inline(always)]
    fn leaves_with_all_behind<W: Wanted, L: Level>(
        &self,
        leaves: Range<usize>,
        marks: impl MarksOf<W>,
        pairs: &mut Pairs,
        simd: L,
    ) {
        for leaf in leaves {
            let node = &self.levels[0][leaf];
            let ids = self.ids_of(leaf);
            let (mine, by) = (marks(0, leaf), marks(1, leaf / LANES).query(leaf % LANES));
            let wants_own = !W::TESTS || mine.among(u32::MAX, &by) != 0;
            for (lane, &id) in ids.iter().enumerate().filter(|_| wants_own) {
                // Only lanes behind this one: each pair is found from its first lane.
                let hits = node.overlapping(&node.lane(lane), simd) & (u32::MAX - 1) << lane;
                let hits = mine.among(hits, &mine.query(lane));
                if hits != 0 {
                    add::<W, _>(id, ids, hits, pairs, simd);
                }
            }
            let bounds = self.bounds_of(leaf);
            let side = Side { node, bounds: &bounds, ids, marks: mine, by: &by };
            let mut from = leaf + 1;
            let apart = self.apart.iter().filter(|apart| apart.leaves.contains(&leaf)).map(|apart| &apart.others);
            for Range { start, end } in apart.chain([&(usize::MAX..usize::MAX)]) {
                let meet = |other| self.meet(&side, other, marks, pairs, simd);
                self.each((&bounds, &by), from..*start, 1, marks, meet, simd);
                from = *end;
            }
            // A caller who wants a thousand pairs must not wait for all.
            if pairs.is_over() {
                return;
            }
        }
    }

    #[inline(always)]
    fn group_with_all<W: Wanted, L: Level>(
        &self,
        group: &Group,
        of_group: W,
        marks: impl MarksOf<W>,
        pairs: &mut Pairs,
        simd: L,
    ) {
        let by = of_group.query_all();
        let side = Side { node: &group.node, bounds: &group.bounds, ids: &group.ids, marks: of_group, by: &by };
        let meet = |other| self.meet(&side, other, marks, pairs, simd);
        self.each((&group.bounds, &by), 0..usize::MAX, 1, marks, meet, simd);
    }

    /// Adds the pairs of the boxes of a node with those of a leaf.
    #[inline(always)]
    fn meet<W: Wanted, L: Level>(
        &self,
        side: &Side<'_, W>,
        leaf: usize,
        marks: impl MarksOf<W>,
        pairs: &mut Pairs,
        simd: L,
    ) {
        let (boxes, ids) = (side.node, side.ids);
        let (node, others) = (&self.levels[0][leaf], self.ids_of(leaf));
        let their_marks = marks(0, leaf);
        let mine = boxes.overlapping(&self.bounds_of(leaf), simd);
        let mine = side.marks.among(mine, &marks(1, leaf / LANES).query(leaf % LANES));
        if mine == 0 {
            return;
        }
        let theirs = their_marks.among(node.overlapping(side.bounds, simd), side.by);
        // Usually few boxes reach into the other leaf: take them from the side that has fewer.
        let (few, few_ids, few_marks, many, many_ids, many_marks, mut left) =
            if mine.count_ones() <= theirs.count_ones() {
                (boxes, ids, side.marks, node, others, their_marks, mine)
            } else {
                (node, others, their_marks, boxes, ids, side.marks, theirs)
            };
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let hits = many_marks.among(many.overlapping(&few.lane(lane), simd), &few_marks.query(lane));
            if hits != 0 {
                add::<W, _>(few_ids[lane], many_ids, hits, pairs, simd);
            }
        }
    }

    /// Estimates the cost of the pairs of a box in `some` leaves with one in `others`: one for each two leaves that
    /// meet, and one for each box of the first that meets the second.
    pub(crate) fn tests(&self, some: Range<usize>, others: Range<usize>) -> u64 {
        let step = some.len().div_ceil(SAMPLE).max(1);
        let mut tests = 0;
        for leaf in some.skip(step / 2).step_by(step) {
            let meet = |other| {
                let reach = self.levels[0][leaf].overlapping(&self.bounds_of(other), Baseline);
                tests += 1 + u64::from(reach.count_ones());
            };
            self.each((&self.bounds_of(leaf), &()), others.clone(), 1, unmarked, meet, Baseline);
        }
        tests * step as u64
    }

    /// Returns the boxes of a leaf.
    pub(crate) fn group(&self, leaf: usize) -> Group {
        Group { node: self.levels[0][leaf], bounds: self.bounds_of(leaf), ids: *self.ids_of(leaf) }
    }

    /// Returns the bounds of a leaf: NaN if it is empty.
    pub(crate) fn bounds_of(&self, leaf: usize) -> Aabb {
        self.levels[1][leaf / LANES].lane(leaf % LANES)
    }

    fn ids_of(&self, leaf: usize) -> &[u32; LANES] {
        &self.ids.as_chunks().0[leaf]
    }

    /// Calls `found` for every lane of level `bottom`, of those with these numbers, that overlaps a box and may be
    /// wanted by it. Lane k of node n has the number 16 n + k. Returns the number of nodes compared with the box.
    #[inline(always)]
    fn each<W: Wanted, L: Level>(
        &self,
        (b, by): (&Aabb, &W::Query),
        Range { start, end }: Range<usize>,
        bottom: usize,
        marks: impl MarksOf<W>,
        mut found: impl FnMut(usize),
        simd: L,
    ) -> u32 {
        let Some(top) = self.levels.iter().rposition(|level| !level.is_empty()) else { return 0 };
        // The lanes of a node that contain something of the range.
        let lanes = |level: usize, node: usize| {
            let (above, first) = (4 * (level - bottom), node * LANES);
            let before = (start >> above).saturating_sub(first);
            let mask = if before < LANES { u32::MAX << before } else { 0 };
            // Most ranges have no end.
            let until = if end == usize::MAX { LANES } else { end.div_ceil(1 << above).saturating_sub(first) };
            if until < LANES { mask & !(u32::MAX << until) } else { mask }
        };
        let mut looked = 0;
        for root in (start >> (4 * (top - bottom) + 4))..self.levels[top].len() {
            // For each level: the node whose children are visited, and a mask of those left.
            let mut open = [(0, 0); MOST_LEVELS];
            let mut at = top;
            open[at] = (root, marks(at, root).among(self.levels[at][root].overlapping(b, simd) & lanes(at, root), by));
            looked += 1;
            loop {
                let (node, left) = &mut open[at];
                if *left == 0 || at == bottom {
                    let first = *node * LANES;
                    each_bit(*left, |lane| found(first + lane));
                    at += 1;
                    if at > top {
                        break;
                    }
                    continue;
                }
                let child = *node * LANES + left.trailing_zeros() as usize;
                *left &= *left - 1;
                let below = &self.levels[at - 1];
                if self.far && *left != 0 {
                    let next = *node * LANES + left.trailing_zeros() as usize;
                    below.get(next).into_iter().for_each(prefetch);
                }
                at -= 1;
                open[at] = (child, marks(at, child).among(below[child].overlapping(b, simd) & lanes(at, child), by));
                looked += 1;
            }
        }
        looked
    }
}

/// Adds the pairs of a box with each of `others` whose bit is set.
#[inline(always)]
fn add<W: Wanted, L: Level>(id: u32, others: &[u32; LANES], hits: u32, pairs: &mut Pairs, simd: L) {
    if let Some(room) = pairs.room(LANES).and_then(|room| room.first_chunk_mut()) {
        simd.write(id, others, hits, room);
        let count = hits.count_ones() as usize;
        if W::TESTS { pairs.extend_by_tested(count) } else { pairs.extend_by(count) }
    } else {
        pairs.push_mask(id, others, hits);
    }
}

#[cfg(test)]
mod tests {
    use super::super::write_each;
    use super::*;
    use crate::Pair;
    use crate::cpu::Simd;

    #[test]
    fn every_level_writes_the_pairs_of_any_hits() {
        fn write<L: Level>(others: &[u32; LANES], hits: u32, level: L) -> [Pair; LANES] {
            let mut written = [(0, 0); LANES];
            level.write(77, others, hits, &mut written);
            written
        }
        at_level! {
            fn written[] [](others: &[u32; LANES], hits: u32) -> [Pair; LANES] = write;
        }
        let others: [u32; LANES] = std::array::from_fn(|k| 10 * k as u32 + u32::from(k % 3 == 0) * 4_000_000_000);
        for hits in 0..1_u32 << LANES {
            let mut expected = [(0, 0); LANES];
            write_each(77, &others, hits, &mut expected);
            for simd in Simd::every() {
                let written = written(simd, &others, hits);
                let count = hits.count_ones() as usize;
                assert_eq!(written[..count], expected[..count], "{simd:?} {hits:b}");
            }
        }
    }
}
