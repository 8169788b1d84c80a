//! What is known of the algorithms on GPUs without any: which there are, and what a frame asks of a GPU. The feature `gpu` runs them.

mod methods;
mod sizes;
mod traffic;

pub use methods::algorithms;
pub use traffic::{Card, Traffic};
