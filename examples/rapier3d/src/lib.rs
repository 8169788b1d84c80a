//! Bodies that break into pieces, as in Figure 1 of Avril, Gouranton and Arnaldi (ISVRI 2011), with the dynamics of
//! rapier3d; and the boxes of their colliders in a [`Space`](sapwise::Space), whose pairs are compared with those of
//! rapier's own broad phase in every step.
//!
//! [`World`] is the simulation; [`Comparison`] runs Sapwise beside it and compares the pairs of both.

mod comparison;
mod world;

pub use comparison::{Comparison, Counts, Mismatch};
pub use world::{Settings, World};
