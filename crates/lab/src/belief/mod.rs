//! Samples: which algorithm to time at which size, where a few frames are to correct a prediction.

mod effort;
mod knowledge_gradient;
mod replay;
mod sampling;

pub use effort::{Effort, FEWEST_FRAMES, IncrementalMethods, TIMED};
pub use knowledge_gradient::KnowledgeGradient;
pub use replay::{Replay, ReplayPoint};
pub use sampling::{Answer, Learned, SECONDS, Sample, Source, Taken, learn};
