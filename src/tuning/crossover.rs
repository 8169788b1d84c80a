//! The load at which one algorithm overtakes another.

use crate::AlgorithmId;

/// The number of objects at which two algorithms cost the same and their fields meet.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Crossover {
    /// The cheaper algorithm with fewer objects.
    pub below: AlgorithmId,
    /// The cheaper algorithm with more objects.
    pub above: AlgorithmId,
    /// Number of objects at which both cost the same.
    pub objects: f64,
    /// Lower end of the interval, no less than the fewest objects of the loads. `None`, like `high`, without an
    /// interval: [`Tuning::interval_basis`](crate::Tuning::interval_basis) says why.
    pub low: Option<f64>,
    /// Upper end of the interval, no more than the most objects of the loads.
    pub high: Option<f64>,
}

impl Crossover {
    /// Returns both ends of the interval, if there is one.
    pub fn interval(&self) -> Option<(f64, f64)> {
        self.low.zip(self.high)
    }

    pub(super) fn is_sound(&self) -> bool {
        match (self.low, self.high) {
            (Some(low), Some(high)) => 0.0 <= low && low <= self.objects && self.objects <= high,
            (None, None) => self.objects >= 0.0,
            _ => false,
        }
    }
}
