//! An algorithm as a registry lists it.

use crate::algorithm::AlgorithmId;
use crate::error::Unavailable;

/// One algorithm of a registry.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Entry {
    /// The algorithm.
    pub id: AlgorithmId,
    /// Counts up when its speed changes; timings of other revisions are stale.
    pub revision: u32,
    /// Why it can't run here, if it can't.
    pub unavailable: Option<Unavailable>,
}

impl Entry {
    /// An algorithm that can run.
    #[must_use]
    pub fn new(id: AlgorithmId, revision: u32) -> Self {
        Self { id, revision, unavailable: None }
    }
}
