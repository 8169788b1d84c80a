//! What a sweep is: which scenarios and sizes, under which loads, and which algorithms drop out.

mod dropout;
mod loads;
mod plan;

pub use dropout::Standing;
pub use loads::{loads, next_frame};
pub use plan::{Ascent, Plan, share};

/// Frames before the samples of an incremental algorithm: how far boxes move is known in the second, and the shares of them that leave their
/// grown boxes follow over some tens. Fewer would time the cheap frames after a rebuild: at 3162 objects 11 us where the others take 34.
pub const WARM_UP: usize = 24;

/// The median of samples in nanoseconds. `None` without samples.
#[must_use]
pub fn median(samples: &[u64]) -> Option<f64> {
    let samples: Vec<f64> = samples.iter().map(|&ns| ns as f64).collect();
    sapwise::stats::median(&samples)
}
