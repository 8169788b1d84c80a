//! How much worse a tree has become since its boxes were sorted.

/// Counts the nodes that queries look at.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Wear {
    /// Nodes and queries right after the boxes were sorted.
    fresh: [u64; 2],
    /// Nodes since then in excess of those that the same number of queries looked at in the fresh tree.
    pub(crate) excess: u64,
}

impl Wear {
    /// Notes queries that looked at this many nodes together. The first `enough` queries count as those of a fresh
    /// tree.
    pub(crate) fn note(&mut self, queries: u64, nodes: u64, enough: u64) {
        let [looked, known] = self.fresh;
        if known < enough {
            self.fresh = [looked + nodes, known + queries];
        } else {
            // Saturating: they may have looked at fewer.
            self.excess = (self.excess + nodes).saturating_sub((looked * queries).div_ceil(known));
        }
    }
}
