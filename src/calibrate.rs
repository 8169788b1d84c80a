//! From nothing to a tuning of this machine: [`Adaptive::for_this_machine`](crate::Adaptive::for_this_machine).

mod cache;
mod for_this_machine;
mod options;
mod slice;
mod tunings;

#[cfg(feature = "schema")]
pub use cache::cache_schema;
#[cfg(fuzzing)]
pub use cache::is_readable_cache;
pub use options::{Cache, StartOptions};
