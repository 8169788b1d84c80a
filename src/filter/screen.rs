//! The sets of boxes that methods derive from a filter.

use super::{Filter, Membership};

/// Most different memberships, owners aside, that are classified.
const MOST_CLASSES: usize = 32;

/// Slots of the table of classes.
const SLOTS: usize = 2 * MOST_CLASSES;

/// A filter and its passive boxes: a set of boxes no two of which are wanted as a pair. No method compares two of
/// them.
#[derive(Debug, Clone)]
pub(crate) struct Screen {
    pub(crate) filter: Filter,
    /// 1 for each passive box. May be shorter than the input.
    passive: Vec<u8>,
    /// Whether two boxes that are not both passive may be unwanted as a pair.
    pub(crate) is_partial: bool,
    /// Whether the filter may have changed since the rest was derived.
    pub(crate) is_stale: bool,
}

/// The different memberships, owners aside, and the number of boxes of each.
#[derive(Debug)]
struct Classes {
    of: [(Membership, usize); MOST_CLASSES],
    len: usize,
    /// One more than the position in `of`; 0 in a free slot.
    slots: [u8; SLOTS],
}

impl Screen {
    pub(crate) fn new(filter: Filter) -> Self {
        let mut screen = Self { filter, passive: Vec::new(), is_partial: true, is_stale: true };
        screen.derive();
        screen
    }

    /// Returns the filter for changes. No box is passive until the next [`derive`](Self::derive).
    pub(crate) fn filter_mut(&mut self) -> &mut Filter {
        self.is_stale = true;
        self.passive.clear();
        self.is_partial = true;
        &mut self.filter
    }

    /// Returns whether a box is passive.
    #[inline]
    pub(crate) fn is_passive(&self, id: usize) -> bool {
        self.passive.get(id) == Some(&1)
    }

    /// Finds the passive boxes: of the memberships of which no two boxes are wanted, the most frequent one, then each
    /// next one of which no box is wanted with a passive one. If memberships are many, the fixed boxes are passive.
    pub(crate) fn derive(&mut self) {
        let Self { filter: Filter { memberships }, passive, is_partial, is_stale } = self;
        *is_stale = false;
        *is_partial = true;
        passive.clear();
        // Without memory no box is passive.
        if passive.try_reserve(memberships.len()).is_err() {
            return;
        }
        let mut classes = Classes { of: [(Membership::ALL, 0); MOST_CLASSES], len: 0, slots: [0; SLOTS] };
        let owned = memberships.iter().any(|m| m.owner != 0);
        // Holds the class of each box at first.
        passive.extend(memberships.iter().map_while(|m| classes.add(m)));
        if passive.len() < memberships.len() {
            passive.clear();
            passive.extend(memberships.iter().map(|m| u8::from(m.fixed)));
            return;
        }
        let chosen = classes.independent();
        let of = &classes.of[..classes.len];
        let both = |a: usize, b: usize| chosen >> a & chosen >> b & 1 == 1;
        let wanted = |a: usize, b: usize| of[a].0.wants(&of[b].0) || a == b && of[a].1 < 2 || both(a, b);
        *is_partial = owned || !(0..of.len()).all(|b| (0..=b).all(|a| wanted(a, b)));
        if chosen == 0 {
            passive.clear();
        } else {
            passive.iter_mut().for_each(|class| *class = (chosen >> *class & 1) as u8);
        }
    }
}

impl Classes {
    /// Counts a box. Returns its class, or `None` if there are too many.
    #[inline]
    fn add(&mut self, of: &Membership) -> Option<u8> {
        let class = Membership { owner: 0, ..*of };
        let mixed = (u64::from(of.groups) << 32 | u64::from(of.mask)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut slot = (mixed >> 32) as usize ^ usize::from(of.fixed);
        loop {
            slot %= SLOTS;
            let found = match self.slots[slot] {
                0 if self.len == MOST_CLASSES => return None,
                0 => {
                    self.of[self.len].0 = class;
                    self.len += 1;
                    self.slots[slot] = self.len as u8;
                    self.len - 1
                }
                found => usize::from(found - 1),
            };
            if self.of[found].0 == class {
                self.of[found].1 += 1;
                return Some(found as u8);
            }
            slot += 1;
        }
    }

    /// Returns the classes whose boxes are passive, one bit each: see [`Screen::derive`].
    fn independent(&self) -> u32 {
        let of = &self.of[..self.len];
        let mut order: [usize; MOST_CLASSES] = std::array::from_fn(|k| k);
        // Ties are decided by the membership, so that the order of the boxes does not matter.
        order[..self.len].sort_unstable_by_key(|&k| {
            let (m, boxes) = of[k];
            (usize::MAX - boxes, m.groups, m.mask, m.fixed)
        });
        order[..self.len].iter().fold(0, |chosen: u32, &k| {
            let free = (0..of.len()).all(|c| (chosen | 1 << k) >> c & 1 == 0 || !of[c].0.wants(&of[k].0));
            chosen | u32::from(free) << k
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passive(memberships: &[Membership]) -> (Vec<bool>, bool) {
        let mut screen = Screen::new(Filter::default());
        *screen.filter_mut() = Filter::new(memberships.to_vec());
        assert!(screen.is_stale && (0..memberships.len()).all(|k| !screen.is_passive(k)));
        screen.derive();
        ((0..memberships.len() + 2).map(|k| screen.is_passive(k)).collect(), screen.is_partial)
    }

    #[test]
    fn largest_independent_memberships_are_passive() {
        let of = |groups, mask, fixed| Membership { groups, mask, fixed, owner: 0 };
        let (sensor, crowd, all) = (of(1, 2, false), of(2, 1, false), Membership::ALL);
        let (ground, part) = (of(!0, !0, true), Membership { owner: 7, ..all });
        let (free, still) = ([false, false], true);
        let with = |flags: &[bool]| [flags, &free[..]].concat();
        for (memberships, expected, partial) in [
            (vec![], with(&[]), false),
            (vec![all, all], with(&[false, false]), false),
            (vec![sensor; 3], with(&[true; 3]), false),
            (vec![crowd, sensor, crowd, crowd], with(&[true, false, true, true]), false),
            (vec![crowd, sensor, crowd, crowd, sensor], with(&[still, false, still, still, false]), true),
            (vec![all, ground, all, ground], with(&[false, true, false, true]), false),
            // Fixed boxes of the crowd's kind and the crowd are one set.
            (vec![crowd, of(2, 1, true), crowd, all], with(&[true, true, true, false]), false),
            // The crowd is larger than the ground that it collides with.
            (vec![crowd, crowd, crowd, ground, ground], with(&[true, true, true, false, false]), true),
            (vec![part, part, all], with(&[false; 3]), true),
        ] {
            assert_eq!(passive(&memberships), (expected, partial), "{memberships:?}");
        }
    }

    #[test]
    fn fixed_boxes_are_passive_among_many_memberships() {
        let of = |k: u32| Membership { groups: k, mask: 0, fixed: k.is_multiple_of(3), owner: 0 };
        let some: Vec<Membership> = (0..MOST_CLASSES as u32).map(of).collect();
        assert!(passive(&some).0[..some.len()].iter().all(|&passive| passive));
        let many: Vec<Membership> = (0..=MOST_CLASSES as u32).map(of).collect();
        let (found, partial) = passive(&many);
        assert!(partial && found[..many.len()].iter().zip(&many).all(|(&passive, m)| passive == m.fixed));
    }

    #[test]
    fn passive_boxes_are_never_a_wanted_pair() {
        let mut random = 0;
        let mut below = |n: u64| {
            random += 1;
            (crate::splitmix::mix(random) >> 20) % n
        };
        for _ in 0..300 {
            let kinds = 1 + below(5);
            let memberships: Vec<Membership> = (0..60)
                .map(|_| {
                    let [groups, mask] = [0; 2].map(|_| 1 << below(kinds) | 1 << below(kinds));
                    Membership { groups, mask, fixed: below(4) == 0, owner: below(3) as u32 }
                })
                .collect();
            let (passive, partial) = passive(&memberships);
            let pairs = (0..60).flat_map(|j| (0..j).map(move |i| (i, j)));
            for (i, j) in pairs {
                let wanted = memberships[i].wants(&memberships[j]);
                let both = passive[i] && passive[j];
                assert!(!(both && wanted) && (wanted || both || partial), "{i} and {j} of {memberships:?}");
            }
        }
    }
}
