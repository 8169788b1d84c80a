//! The bodies that were not set for some updates: a tree of them, and the pairs among them.

use super::slots::Slots;
use crate::cpu::{GrownTree, Input, Members, Simd, SimdLevel, Tree, Wear, Workers};
use crate::{Aabb, Error, SceneStats};

/// Cost of sorting a box into a tree, in nodes that queries look at: 25 and 5 ns on the Zen 3 host of `datasets/`.
const SORT_IN_NODES: u64 = 5;

/// Queries of a fresh tree from which it is learned how many nodes one looks at.
const FRESH: u64 = 64;

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Resting {
    tree: GrownTree,
    /// Bodies that came since the last update.
    arrivals: Vec<u32>,
    /// Bodies that came in the last update, when the epoch rose by 1.
    pub(super) arrived: Vec<u32>,
    /// Whether the body in a slot is among those of the last update: one bit each, so that all stay in the cache.
    bits: Vec<u64>,
    /// Number of bodies without the arrivals.
    len: usize,
    /// Whether they are all in the tree.
    is_built: bool,
    /// Rises by 1 when bodies come to rest, by more when the bodies are others: what a query found before is no longer
    /// all.
    pub(super) epoch: u64,
    wear: Wear,
    members: Vec<u32>,
}

impl Resting {
    pub(super) fn new() -> Self {
        Self { tree: GrownTree::new(Simd::at_most(SimdLevel::in_use())), epoch: 1, ..Self::default() }
    }

    pub(super) fn len(&self) -> usize {
        self.len + self.arrivals.len()
    }

    /// Returns the tree, whose ids are slots; `None` without a body.
    pub(super) fn tree(&self) -> Option<&Tree> {
        self.is_built.then_some(&self.tree.tree)
    }

    /// Returns whether the body in a slot rests and did in the last update.
    #[inline]
    pub(super) fn has(&self, slot: u32) -> bool {
        self.bits[slot as usize / 64] & 1 << (slot % 64) != 0
    }

    /// Adds a body. [`update`](Self::update) follows before the next query.
    pub(super) fn add(&mut self, slot: u32) {
        self.arrivals.push(slot);
    }

    /// Removes a body that was there in the last update.
    pub(super) fn remove(&mut self, slot: u32) {
        self.len -= 1;
        self.bits[slot as usize / 64] &= !(1 << (slot % 64));
        if self.is_built {
            self.tree.remove(slot);
        }
    }

    pub(super) fn clear(&mut self) {
        self.arrivals.clear();
        self.epoch += 1;
        self.bits.clear();
        (self.len, self.is_built) = (0, false);
    }

    /// Holds the resting ones of other bodies than before, with their boxes at the last update.
    pub(super) fn begin(&mut self, slots: &mut Slots) {
        self.clear();
        self.len = slots.resting().count();
        slots.exchange_replaced();
        // Without memory for the tree, the next update reports the error.
        let _ = self.update(slots);
        slots.exchange_replaced();
    }

    /// Puts the arrivals into the tree.
    pub(super) fn update(&mut self, slots: &Slots) -> Result<(), Error> {
        let boxes = &slots.boxes[..];
        let worn = self.wear.excess > SORT_IN_NODES * self.len() as u64;
        self.arrived.clear();
        if self.arrivals.is_empty() && !worn && self.is_built || self.len() == 0 {
            return Ok(());
        }
        if !self.arrivals.is_empty() || !self.is_built {
            self.epoch += 1;
        }
        let many = self.arrivals.len() > self.len / 4;
        self.len += self.arrivals.len();
        // Ascending, so that the same bodies make the same tree.
        self.arrivals.sort_unstable();
        std::mem::swap(&mut self.arrivals, &mut self.arrived);
        let arrivals = &self.arrived;
        let is_built = std::mem::take(&mut self.is_built);
        let input = Input { workers: &Workers::one(), boxes, screen: None };
        if many || worn || !is_built || self.tree.tree.is_sparse(self.len) {
            self.members.clear();
            self.members.extend(slots.resting());
            mark(&mut self.bits, &self.members, boxes.len());
            let stats = SceneStats::of_members(boxes, &self.members);
            self.wear = Wear::default();
            self.tree.build(input, Members::Of(&self.members), &stats)?;
        } else {
            mark(&mut self.bits, arrivals, boxes.len());
            self.tree.update(input, (arrivals.iter().copied(), 0), false)?;
            self.tree.refit(input.workers, boxes, std::iter::once(&arrivals[..]))?;
        }
        self.is_built = true;
        Ok(())
    }

    /// Calls `found` for each body whose box overlaps these bounds.
    pub(super) fn overlapping(&mut self, bounds: &Aabb, found: impl FnMut(u32)) {
        self.wear.note(1, self.tree.tree.overlapping(bounds, found).into(), FRESH);
    }
}

/// Sets the bit of each of these slots. There are `slots` in all.
fn mark(bits: &mut Vec<u64>, of: &[u32], slots: usize) {
    bits.resize(slots.div_ceil(64), 0);
    of.iter().for_each(|slot| bits[*slot as usize / 64] |= 1 << (slot % 64));
}
