//! The loads of the slice that a tuning shows.

use crate::load::Load;

/// The scenario of the slice.
pub(super) const SCENARIO: &str = "uniform";

