//! What is believed of the costs on a machine: a prediction, corrected by timings of some algorithms that tell about all of them.

mod effort;
mod knowledge_gradient;
mod posterior;
mod prior;
mod replay;
mod sampling;

pub use effort::{Effort, FEWEST_FRAMES, IncrementalMethods, TIMED};
pub use knowledge_gradient::KnowledgeGradient;
pub use posterior::{Joint, Posterior};
pub use prior::{Deviations, Part, Prior, TERMS_SHARED, width_correlation};
pub use replay::{Replay, ReplayPoint};
pub use sampling::{Answer, Learned, SECONDS, Sample, Source, Taken, learn};
