//! Where one field of optimal performance gives way to the next.

use crate::AlgorithmId;

/// The number of objects at which two algorithms cost the same, where the fields of both meet.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Crossover {
    /// The cheaper algorithm with fewer objects.
    pub below: AlgorithmId,
    /// The cheaper algorithm with more objects.
    pub above: AlgorithmId,
    /// Number of objects at which both cost the same.
    pub objects: f64,
    /// Lower end of the interval; where it may lie lower still, the least objects of the slice. `None`, like `high`, where no
    /// interval can be claimed: [`Tuning::interval_basis`](crate::Tuning::interval_basis) says why.
    pub low: Option<f64>,
    /// Upper end of the interval; where it may lie higher still, the most objects of the slice.
    pub high: Option<f64>,
}

impl Crossover {
    /// A crossover without an interval.
    #[must_use]
    pub fn new(below: AlgorithmId, above: AlgorithmId, objects: f64) -> Self {
        Self { below, above, objects, low: None, high: None }
    }

    /// The same with an interval, whose ends hold `objects` between them.
    #[must_use]
    pub fn with_interval(self, low: f64, high: f64) -> Self {
        Self { low: Some(low), high: Some(high), ..self }
    }

    /// Both ends of the interval, where one is claimed.
    #[must_use]
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
