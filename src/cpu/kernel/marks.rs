//! The memberships of what is in the lanes of a node, tested after the bounds.

use super::{LANES, prefetch};
use crate::cpu::NOBODY;
use crate::{Filter, Membership};

/// Boxes to prefetch ahead.
const AHEAD: usize = LANES;

/// The memberships in the lanes of a node. That of several boxes is their union, which wants every box that one of
/// them wants, and perhaps others.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Marks {
    groups: [u32; LANES],
    masks: [u32; LANES],
    owners: [u32; LANES],
    /// One bit for each lane with a box that may move.
    moving: u32,
}

/// The membership of a lane without a box. A box in no group is in no pair.
const NONE: Membership = Membership { groups: 0, mask: 0, fixed: true, owner: 0 };

/// The test of a walk beside that of bounds: memberships, or `()` for no test.
pub(crate) trait Wanted: Copy {
    /// Whether all unwanted boxes are ruled out.
    const TESTS: bool;
    type Query: Copy;
    /// Returns what another node tests of a lane.
    fn query(self, lane: usize) -> Self::Query;
    /// Returns what another node tests of all lanes.
    fn query_all(self) -> Self::Query;
    /// Returns the lanes of `hits` in which a box may be wanted.
    fn among(self, hits: u32, query: &Self::Query) -> u32;
}

impl Wanted for () {
    const TESTS: bool = false;
    type Query = ();

    #[inline(always)]
    fn query(self, _lane: usize) {}

    #[inline(always)]
    fn query_all(self) {}

    #[inline(always)]
    fn among(self, hits: u32, (): &()) -> u32 {
        hits
    }
}

impl Wanted for &Marks {
    const TESTS: bool = true;
    type Query = Membership;

    #[inline(always)]
    fn query(self, lane: usize) -> Membership {
        Membership {
            groups: self.groups[lane],
            mask: self.masks[lane],
            fixed: self.moving >> lane & 1 == 0,
            owner: self.owners[lane],
        }
    }

    #[inline(always)]
    fn query_all(self) -> Membership {
        (0..LANES).fold(NONE, |all, lane| union(&all, &self.query(lane)))
    }

    #[inline(always)]
    fn among(self, hits: u32, by: &Membership) -> u32 {
        if hits == 0 {
            return 0;
        }
        let mut wanted = [true; LANES];
        for (lane, wanted) in wanted.iter_mut().enumerate() {
            let others = (self.owners[lane] != by.owner) | (by.owner == 0);
            *wanted = (self.groups[lane] & by.mask != 0) & (self.masks[lane] & by.groups != 0) & others;
        }
        let may_move = if by.fixed { self.moving } else { u32::MAX };
        hits & may_move & wanted.iter().enumerate().fold(0, |mask, (lane, &wanted)| mask | u32::from(wanted) << lane)
    }
}

impl Marks {
    /// No box in any lane.
    pub(crate) const EMPTY: Self = Self { groups: [0; LANES], masks: [0; LANES], owners: [0; LANES], moving: 0 };

    /// Every box may be wanted.
    pub(crate) const ALL: Self =
        Self { groups: [u32::MAX; LANES], masks: [u32::MAX; LANES], owners: [0; LANES], moving: u32::MAX };

    /// Returns the memberships of these boxes.
    pub(crate) fn of(ids: &[u32; LANES], filter: &Filter) -> Self {
        let mut marks = Self::EMPTY;
        ids.iter().enumerate().filter(|&(_, &id)| id != NOBODY).for_each(|(lane, &id)| marks.set(lane, filter.of(id)));
        marks
    }

    /// Writes the memberships of the boxes of each leaf.
    pub(crate) fn fill(leaves: &mut [Self], ids: &[u32], filter: &Filter) {
        let of_leaves = ids.as_chunks().0;
        for (at, (leaf, of_leaf)) in leaves.iter_mut().zip(of_leaves).enumerate() {
            // Neighbours on the curve lie anywhere in memory.
            let ahead = ids.iter().skip(at * LANES + AHEAD).take(LANES);
            ahead.filter_map(|&id| filter.memberships.get(id as usize)).for_each(prefetch);
            *leaf = Self::of(of_leaf, filter);
        }
    }

    /// Returns the memberships of these nodes.
    pub(crate) fn above(nodes: &[Self]) -> Self {
        let mut marks = Self::EMPTY;
        nodes.iter().enumerate().for_each(|(lane, below)| marks.set(lane, &below.query_all()));
        marks
    }

    fn set(&mut self, lane: usize, of: &Membership) {
        (self.groups[lane], self.masks[lane], self.owners[lane]) = (of.groups, of.mask, of.owner);
        self.moving = self.moving & !(1 << lane) | u32::from(!of.fixed) << lane;
    }

    /// Makes a lane contain boxes of this membership too.
    pub(crate) fn widen(&mut self, lane: usize, by: &Membership) {
        let all = union(&Wanted::query(&*self, lane), by);
        self.set(lane, &all);
    }
}

fn union(a: &Membership, b: &Membership) -> Membership {
    if a.groups == 0 {
        *b
    } else if b.groups == 0 {
        *a
    } else {
        Membership {
            groups: a.groups | b.groups,
            mask: a.mask | b.mask,
            fixed: a.fixed & b.fixed,
            owner: if a.owner == b.owner { a.owner } else { 0 },
        }
    }
}
