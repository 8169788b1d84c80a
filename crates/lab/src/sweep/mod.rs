//! The rules of a sweep: scenarios, sizes, loads, and which algorithms drop out.

mod dropout;
mod loads;
mod plan;

pub use dropout::Standing;
pub use loads::{loads, next_frame};
pub use plan::{Ascent, Plan, share};

/// Warm-up frames of an incremental algorithm: its motion estimate needs two frames, and the share of boxes that
/// leave their fat AABBs needs dozens. Fewer frames would time the cheap frames after a rebuild: 11 instead of 34 µs
/// at 3162 objects.
pub const WARM_UP: usize = 24;

/// Returns the median of samples in nanoseconds; `None` without samples.
pub fn median(samples: &[u64]) -> Option<f64> {
    let samples: Vec<f64> = samples.iter().map(|&ns| ns as f64).collect();
    sapwise_tune::stats::median(&samples)
}
