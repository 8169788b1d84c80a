//! What makes the description of a machine unusable.

use std::fmt;

/// What makes the description of a machine unusable, in a sentence that names the parameter or the GPU.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HardwareError(pub(super) String);

impl HardwareError {
    /// Returns the problem without what to do about it.
    pub fn problem(&self) -> &str {
        self.0.split_once("; ").map_or(&self.0, |(problem, _)| problem)
    }
}

impl fmt::Display for HardwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for HardwareError {}
