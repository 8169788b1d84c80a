//! The bodies that were set lately, without gaps, as the algorithms want them.

use super::IDLE;
use super::body::Body;
use crate::{Aabb, Filter, Membership, Pairs};

/// How long a body stays active if nobody sets it.
///
/// One that just woke may rest again in the next update. Each time it is set before, it waits twice as long. So a body
/// that is set now and then is active for one update at a time, and one that is set in most updates never rests.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patience {
    /// The update from which on it may rest.
    pub(super) until: u64,
    /// The updates that it waited for when it was set last, up to [`IDLE`].
    pub(super) wait: u64,
}

impl Patience {
    /// Returns the patience of a body that was set in this update.
    pub(super) fn after(update: u64, wait: u64) -> Self {
        let wait = wait.min(IDLE);
        Self { until: update + wait, wait }
    }
}

/// See the module. Body `k` is element `k` of each list.
#[derive(Debug, Clone, Default)]
pub(super) struct Active {
    pub(super) slots: Vec<u32>,
    pub(super) boxes: Vec<Aabb>,
    pub(super) patience: Vec<Patience>,
    /// Pairs of positions. The filter has the memberships, if there ever was one that is not the default.
    pub(super) pairs: Pairs,
}

impl Active {
    pub(super) fn len(&self) -> usize {
        self.slots.len()
    }

    /// Puts a body in the place of another, or behind all others.
    pub(super) fn put(&mut self, at: usize, slot: u32, aabb: Aabb, body: &Body, patience: Patience) {
        if at == self.len() {
            self.slots.push(slot);
            self.boxes.push(aabb);
            self.patience.push(patience);
        }
        (self.slots[at], self.boxes[at], self.patience[at]) = (slot, aabb, patience);
        self.set_body(at, body);
    }

    pub(super) fn set(&mut self, at: usize, aabb: Aabb, update: u64) {
        self.boxes[at] = aabb;
        self.patience[at] = Patience::after(update, (2 * self.patience[at].wait).max(1));
    }

    /// Lets no body rest before this update.
    pub(super) fn stay_until(&mut self, update: u64) {
        self.patience.iter_mut().for_each(|patience| patience.until = patience.until.max(update));
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
        self.patience.swap_remove(at);
        if let Some(filter) = self.pairs.filter_mut() {
            filter.memberships.swap_remove(at);
        }
        self.slots.get(at).copied()
    }
}
