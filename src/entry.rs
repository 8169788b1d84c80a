//! An algorithm in a registry.

use crate::{AlgorithmId, Unavailable};

/// An algorithm in a registry.
///
/// ```
/// let registry = sapwise::Registry::with_cores(2);
/// let brute = &registry.entries()[0];
/// assert_eq!(brute.id.to_string(), "brute@cpu1");
/// assert!(brute.unavailable.is_none());
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Entry {
    /// The algorithm.
    pub id: AlgorithmId,
    /// Rises when its speed changes: timings of other revisions are stale.
    pub revision: u32,
    /// Why it can't run here; `None` if it can.
    pub unavailable: Option<Unavailable>,
}

impl Entry {
    /// Makes the entry of an algorithm that can run.
    pub fn new(id: AlgorithmId, revision: u32) -> Self {
        Self { id, revision, unavailable: None }
    }
}
