//! Which of the overlapping pairs a caller wants.

use crate::pair::Pair;

/// What a box may collide with: groups and masks, as in most physics engines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Membership {
    /// The groups that the box is in, one bit each. Bullet has them as a group, rapier and avian as memberships, Godot as a layer.
    pub groups: u32,
    /// The groups that it collides with, one bit each; rapier and avian call it a filter. Both boxes of a pair must let the other
    /// through.
    pub mask: u32,
    /// Whether the box never moves. Two such boxes are no pair.
    pub fixed: bool,
}

impl Membership {
    /// In every group and colliding with every group: what a box is of which nothing was said.
    pub const ALL: Self = Self { groups: u32::MAX, mask: u32::MAX, fixed: false };

    /// Whether a box of this kind and one of that are wanted as a pair.
    #[inline]
    #[must_use]
    pub fn wants(&self, other: &Self) -> bool {
        // Without branches: in a scene of many groups none could be guessed.
        (self.groups & other.mask != 0) & (other.groups & self.mask != 0) & !(self.fixed & other.fixed)
    }
}

impl Default for Membership {
    fn default() -> Self {
        Self::ALL
    }
}

/// Keeps pairs out of a [`Pairs`](crate::Pairs) before they are written.
///
/// 12 bytes for each box, and a look at two memberships for each overlapping pair. In a crowded scene of which half the pairs pass
/// that adds half to the time of `grid-sap@cpu1` while the memberships fit into the caches, and one and a half times with 850 000 boxes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Filter {
    /// One for each box, at the position that the box has in the input. A box beyond the end is [`Membership::ALL`].
    pub memberships: Vec<Membership>,
}

impl Filter {
    /// A filter in which each box, by its position, has one of `memberships`.
    #[must_use]
    pub fn new(memberships: Vec<Membership>) -> Self {
        Self { memberships }
    }

    /// Whether the boxes at these two positions are wanted as a pair.
    #[inline]
    #[must_use]
    pub fn wants(&self, (a, b): Pair) -> bool {
        let of = |id: u32| self.memberships.get(id as usize).unwrap_or(&Membership::ALL);
        of(a).wants(of(b))
    }

    /// Whether the box at this position never moves.
    #[inline]
    pub(crate) fn is_fixed(&self, id: usize) -> bool {
        self.memberships.get(id).is_some_and(|m| m.fixed)
    }

    /// Brings the wanted ones of `pairs` to its head, in their order. Returns their number, and how many of the others have a member that
    /// may move.
    pub(crate) fn keep_wanted(&self, pairs: &mut [Pair]) -> (usize, usize) {
        let (mut kept, mut unwanted) = (0, 0);
        for at in 0..pairs.len() {
            // Moved in any case and kept if wanted, as where pairs are tested.
            let pair = pairs[at];
            pairs[kept] = pair;
            let wanted = self.wants(pair);
            kept += usize::from(wanted);
            unwanted += usize::from(!wanted & !self.both_fixed(pair));
        }
        (kept, unwanted)
    }

    /// Whether neither of two boxes ever moves.
    #[inline]
    pub(crate) fn both_fixed(&self, (a, b): Pair) -> bool {
        self.is_fixed(a as usize) & self.is_fixed(b as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_boxes_must_let_the_other_through_and_one_must_move() {
        let of = |groups, mask, fixed| Membership { groups, mask, fixed };
        let (player, bullet, wall) = (of(0b001, 0b111, false), of(0b010, 0b101, false), of(0b100, 0b111, true));
        for (a, b, wanted) in [
            (player, player, true),
            (player, bullet, true),
            (bullet, bullet, false),
            (bullet, wall, true),
            (wall, wall, false),
            (of(0b001, 0b010, false), of(0b010, 0b100, false), false),
            (Membership::ALL, of(0, u32::MAX, false), false),
            (Membership::ALL, of(u32::MAX, 0, false), false),
            (Membership::ALL, of(1 << 31, 1 << 31, true), true),
        ] {
            assert_eq!((a.wants(&b), b.wants(&a)), (wanted, wanted), "{a:?} and {b:?}");
        }
    }

    #[test]
    fn a_box_beyond_the_end_is_in_every_group() {
        let filter = Filter::new(vec![
            Membership { groups: 1, mask: 2, fixed: false },
            Membership { mask: 0, ..Membership::ALL },
        ]);
        assert!(filter.wants((0, 2)) && filter.wants((2, 7)) && filter.wants((u32::MAX - 1, u32::MAX)));
        assert!(!filter.wants((1, 2)) && !filter.wants((0, 1)));
    }
}
