//! The pairs of a rank.

use crate::error::Outcome;
use sapwise::PairOrder;

/// The overlapping pairs of a rank's own boxes in one frame: the id of an own box, then that of the other.
///
/// Of two boxes of this rank the lower id stands first, and their pair is there once. A pair with a box of another rank is on the rank that has the box
/// with the lower id (with equal ids on the lower rank), and [mirrored](Self::set_mirrored) on the other one too, with its own id first.
///
/// Owned by the caller and reused from frame to frame: its memory grows to the largest frame seen and stays.
#[derive(Debug, Clone, Default)]
pub struct RankPairs {
    pairs: Vec<(u64, u64)>,
    order: PairOrder,
    mirrored: bool,
    limit: Option<usize>,
}

impl RankPairs {
    /// An empty list in any order, not mirrored and without a limit.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty list that wants its pairs in an order. In [`PairOrder::Canonical`] they are ascending by own id, then by the other's: the same list
    /// whatever the cuts, the machines and their number, as far as each rank owns the same boxes.
    #[must_use]
    pub fn with_order(order: PairOrder) -> Self {
        Self { order, ..Self::default() }
    }

    /// Whether this rank gets every pair of its boxes, also those that the rank of the other box has. It may be so on some ranks only.
    pub fn set_mirrored(&mut self, mirrored: bool) {
        self.mirrored = mirrored;
    }

    /// Whether pairs of two ranks are here too where the other rank has them.
    #[must_use]
    pub fn is_mirrored(&self) -> bool {
        self.mirrored
    }

    /// Sets the most pairs that may be stored, 16 bytes each, or lifts that limit. A frame in which a rank has more is an error on all ranks. A limit
    /// on any rank costs one more exchange a frame. What a rank finds for other ranks, and boxes of others, are not counted.
    pub fn set_limit(&mut self, limit: Option<usize>) {
        self.limit = limit;
    }

    /// The limit set by [`set_limit`](Self::set_limit).
    #[must_use]
    pub fn limit(&self) -> Option<usize> {
        self.limit
    }

    /// The order that the caller wants.
    #[must_use]
    pub fn order(&self) -> PairOrder {
        self.order
    }

    /// The pairs of the last frame.
    #[must_use]
    pub fn as_slice(&self) -> &[(u64, u64)] {
        &self.pairs
    }

    /// How many pairs the last frame has here.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Whether the last frame has no pair here.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    pub(crate) fn clear(&mut self) {
        self.pairs.clear();
    }

    #[inline]
    pub(crate) fn push(&mut self, own: u64, other: u64) {
        self.pairs.push((own, other));
    }

    /// Adds many, whose number is known: without a look at the room for each.
    pub(crate) fn extend(&mut self, pairs: impl ExactSizeIterator<Item = (u64, u64)>) {
        self.pairs.extend(pairs);
    }

    /// Whether so many pairs and those that are there fit.
    pub(crate) fn outcome_with(&self, more: usize) -> Outcome {
        match self.limit {
            Some(limit) if self.pairs.len() + more > limit => [1, limit as u64],
            _ => crate::error::DONE,
        }
    }

    pub(crate) fn finish(&mut self) {
        if self.order == PairOrder::Canonical {
            self.pairs.sort_unstable();
        }
    }
}
