//! The bodies that were set lately, without gaps, as the algorithms want them.

use super::body::Body;
use crate::aabb::Aabb;
use crate::filter::{Filter, Membership};
use crate::pairs::Pairs;

/// See the module. Body `k` is element `k` of each list.
#[derive(Debug, Clone, Default)]
pub(super) struct Active {
    pub(super) slots: Vec<u32>,
    pub(super) boxes: Vec<Aabb>,
    /// The update that set the body last.
    pub(super) set_in: Vec<u64>,
    /// Pairs of positions. The filter has the memberships, if there ever was one that is not the default.
    pub(super) pairs: Pairs,
}

impl Active {
    pub(super) fn len(&self) -> usize {
        self.slots.len()
    }

    pub(super) fn push(&mut self, slot: u32, aabb: Aabb, body: &Body, update: u64) {
        self.set_body(self.slots.len(), body);
        self.slots.push(slot);
        self.boxes.push(aabb);
        self.set_in.push(update);
    }

    /// Puts another body in the place of one.
    pub(super) fn replace(&mut self, at: usize, slot: u32, aabb: Aabb, body: &Body, update: u64) {
        self.slots[at] = slot;
        self.set_body(at, body);
        self.set(at, aabb, update);
    }

    pub(super) fn set(&mut self, at: usize, aabb: Aabb, update: u64) {
        self.boxes[at] = aabb;
        self.set_in[at] = update;
    }

    /// Writes the membership of a body to the filter.
    pub(super) fn set_body(&mut self, at: usize, body: &Body) {
        let membership = body.membership;
        if self.pairs.filter().is_none() {
            if membership == Membership::ALL {
                return;
            }
            self.pairs.set_filter(Some(Filter::new(vec![Membership::ALL; self.slots.len()])));
        }
        let Some(known) = self.pairs.filter() else { return };
        if known.memberships.get(at) != Some(&membership)
            && let Some(filter) = self.pairs.filter_mut()
        {
            filter.memberships.resize(filter.memberships.len().max(at + 1), Membership::ALL);
            filter.memberships[at] = membership;
        }
    }

    /// Removes a body. Returns the slot of the one that takes its place.
    pub(super) fn swap_remove(&mut self, at: usize) -> Option<u32> {
        self.slots.swap_remove(at);
        self.boxes.swap_remove(at);
        self.set_in.swap_remove(at);
        if let Some(filter) = self.pairs.filter_mut() {
            filter.memberships.swap_remove(at);
        }
        self.slots.get(at).copied()
    }
}
