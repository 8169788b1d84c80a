//! The filter on overlapping pairs.

mod screen;

use crate::Pair;

pub(crate) use screen::Screen;

/// The groups and the mask of a box, as in most physics engines.
///
/// ```
/// use sapwise::Membership;
///
/// let wall = Membership { fixed: true, ..Membership::ALL };
/// let player = Membership { groups: 0b10, owner: 7, ..Membership::ALL };
/// assert!(player.wants(&wall) && !wall.wants(&wall) && !player.wants(&player));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Membership {
    /// The groups of the box, one bit each. Bullet calls them a group, rapier and avian memberships, Godot a layer.
    pub groups: u32,
    /// The groups that the box collides with, one bit each. Rapier and avian call it a filter. The masks of both boxes
    /// of a pair must allow the other.
    pub mask: u32,
    /// Whether the box never moves. Two fixed boxes are no pair.
    pub fixed: bool,
    /// What the box is a part of, such as a body or a ragdoll. Two boxes with the same owner are no pair. 0: nothing.
    pub owner: u32,
}

impl Membership {
    /// In every group, and collides with every group: the default.
    pub const ALL: Self = Self { groups: u32::MAX, mask: u32::MAX, fixed: false, owner: 0 };

    /// Returns whether two boxes with these memberships are wanted as a pair.
    #[inline]
    pub fn wants(&self, other: &Self) -> bool {
        // Without branches: with many groups no CPU could predict them.
        (self.groups & other.mask != 0)
            & (other.groups & self.mask != 0)
            & !(self.fixed & other.fixed)
            & ((self.owner != other.owner) | (self.owner == 0))
    }

    /// Returns whether a box with this membership is wanted by no box that does not want one with `other`.
    #[inline]
    pub(crate) fn is_within(&self, other: &Self) -> bool {
        (self.groups & !other.groups == 0)
            & (self.mask & !other.mask == 0)
            & (self.fixed | !other.fixed)
            & ((self.owner == other.owner) | (other.owner == 0))
    }
}

impl Default for Membership {
    fn default() -> Self {
        Self::ALL
    }
}

/// Drops unwanted pairs before they are written to a [`Pairs`](crate::Pairs), most of them before they are found.
///
/// - `bvh` and `pair-cache` test memberships in the nodes of their tree: they find no unwanted pair.
/// - `brute` and `grid-sap` compare no two boxes of one set of which no two are wanted as a pair: all fixed boxes, or a
///   crowd that collides only with sensors. They drop other unwanted pairs as they find them.
/// - `sap` and GPUs drop every unwanted pair as they find it. A GPU gets a changed filter once, 16 bytes for each
///   membership.
///
/// A filter takes 17 bytes for each box, and 16 more in `pair-cache`, which keeps the memberships of the previous
/// frame. `bvh` and `pair-cache` take another 17 if that set alone does not rule out all unwanted pairs. The first
/// frame after a change of the filter finds that set in one pass over the memberships.
///
/// ```
/// use sapwise::{Filter, Membership};
///
/// let arm = Membership { owner: 1, ..Membership::ALL };
/// let filter = Filter::new(vec![arm, arm, Membership::ALL]);
/// assert!(!filter.wants((0, 1)) && filter.wants((0, 2)));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Filter {
    /// The membership of each box, by its position in the input. A box beyond the end is [`Membership::ALL`].
    pub memberships: Vec<Membership>,
}

impl Filter {
    /// Makes a filter from the membership of each box.
    pub fn new(memberships: Vec<Membership>) -> Self {
        Self { memberships }
    }

    /// Returns the membership of a box.
    #[inline]
    pub(crate) fn of(&self, id: u32) -> &Membership {
        self.memberships.get(id as usize).unwrap_or(&Membership::ALL)
    }

    /// Returns whether the boxes at these two positions are wanted as a pair.
    #[inline]
    pub fn wants(&self, (a, b): Pair) -> bool {
        self.of(a).wants(self.of(b))
    }

    /// Moves the wanted ones of `pairs` to its head, in their order. Returns their number.
    pub(crate) fn keep_wanted(&self, pairs: &mut [Pair]) -> usize {
        let mut kept = 0;
        for at in 0..pairs.len() {
            // Moved in any case and kept if wanted: no branch.
            let pair = pairs[at];
            pairs[kept] = pair;
            kept += usize::from(self.wants(pair));
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_motion_and_owners_decide() {
        let of = |groups, mask, fixed| Membership { groups, mask, fixed, owner: 0 };
        let part = |owner| Membership { owner, ..Membership::ALL };
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
            (part(7), part(7), false),
            (part(7), part(8), true),
            (part(u32::MAX), part(0), true),
        ] {
            assert_eq!((a.wants(&b), b.wants(&a)), (wanted, wanted), "{a:?} and {b:?}");
        }
    }
}
