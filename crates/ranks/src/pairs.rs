//! The pairs of a rank.

use crate::error::Outcome;
use sapwise::PairOrder;

/// The overlapping pairs of a rank's own boxes in one frame: the id of an own box, then that of the other.
///
/// A pair of two own boxes is listed once, with the lower id first. A pair with a box of another rank is listed on
/// the rank of the lower id (for equal ids on the lower rank), and with [mirroring](Self::set_mirrored) also on the
/// other rank, own id first.
///
/// Reuse it from frame to frame: its memory grows to the largest frame.
#[derive(Debug, Clone, Default)]
pub struct RankPairs {
    pairs: Vec<(u64, u64)>,
    order: PairOrder,
    mirrored: bool,
    limit: Option<usize>,
}

impl RankPairs {
    /// An empty list, in any order, not mirrored, without a limit.
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty list with an order. [`PairOrder::Canonical`] is ascending by own id, then by the other id: the same
    /// list for any cuts, as long as each rank owns the same boxes.
    pub fn with_order(order: PairOrder) -> Self {
        Self { order, ..Self::default() }
    }

    /// Sets whether this rank gets every pair of its boxes, also those that another rank lists. May differ between
    /// ranks.
    pub fn set_mirrored(&mut self, mirrored: bool) {
        self.mirrored = mirrored;
    }

    /// Whether this rank gets every pair of its boxes.
    pub fn is_mirrored(&self) -> bool {
        self.mirrored
    }

    /// Limits the stored pairs, 16 bytes each. More pairs on a rank are an error on all ranks. A limit on any rank
    /// costs one more exchange a frame. Pairs that a rank finds for others are not counted.
    pub fn set_limit(&mut self, limit: Option<usize>) {
        self.limit = limit;
    }

    /// The limit set by [`set_limit`](Self::set_limit).
    pub fn limit(&self) -> Option<usize> {
        self.limit
    }

    /// The order of the pairs.
    pub fn order(&self) -> PairOrder {
        self.order
    }

    /// The pairs of the last frame.
    pub fn as_slice(&self) -> &[(u64, u64)] {
        &self.pairs
    }

    /// The number of pairs of the last frame.
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Whether the last frame has no pair.
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

    /// Adds pairs, with a single reservation.
    pub(crate) fn extend(&mut self, pairs: impl ExactSizeIterator<Item = (u64, u64)>) {
        self.pairs.extend(pairs);
    }

    /// The outcome of adding `more` pairs.
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
