//! Samples on this machine by which a prediction is corrected: `sapwise predict --samples K`.
//!
//! Which algorithm is timed at which size is decided by [`sapwise_lab::belief`]; here the timing is done, in a process of its own.

mod live;
mod request;
mod sampler;

pub(crate) use live::Live;
pub(crate) use request::Session;
pub(crate) use sampler::sample;
