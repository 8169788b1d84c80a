//! Bodies that break into pieces, as in Figure 1 of Avril, Gouranton and Arnaldi (ISVRI 2011), with the dynamics of
//! rapier3d; and the boxes of their colliders in Sapwise's adaptive broad phase, compared with rapier's own in every
//! step.
//!
//! [`World`] is the simulation, [`Comparison`] runs Sapwise beside it and holds the pairs of one against those of the
//! other, and [`Recording`] keeps the boxes for a file that `sapwise run` and `sapwise pairs` read.

mod comparison;
mod random;
mod recording;
mod world;

pub use comparison::{Comparison, Counts, Mismatch};
pub use recording::Recording;
pub use world::{Settings, World};
