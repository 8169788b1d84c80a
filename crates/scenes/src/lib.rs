//! Scenes of moving boxes to test and measure broad phases with: the same bits on every platform.
//!
//! A [`Scenario`] is a kind of scene; with a number of objects and a seed it starts a [`Scene`], which evolves frame
//! by frame:
//!
//! ```
//! use sapwise_scenes::Scenario;
//!
//! let mut scene = Scenario::Clustered.start(1000, 1);
//! scene.advance();
//! assert_eq!((scene.boxes().len(), scene.frame()), (1000, 1));
//! ```
//!
//! | scenario | content | pairs per object |
//! |---|---|---|
//! | `uniform` | unit cubes spread evenly, moving a little | 0.4 to 0.55 |
//! | `fast` | `uniform`, so fast that no frame helps with the next | 0.4 to 0.55 |
//! | `clustered` | dense Gaussian blobs of about a thousand cubes | 2.9 to 4.2 |
//! | `slab` | a flat world, like the ground of a game | 0.4 to 0.55 |
//! | `mixed` | edges from 0.1 to 10, and up to four cubes as large as the world | 0.8 to 1.3, and 1 for each of those |
//! | `resting` | `uniform` with one object in twenty awake | 0.4 to 0.55 |
//! | `brownian` | cubes that fly straight on and now and then turn | 0.38 to 0.55 |
//! | `free-fall` | cubes that fall onto a pile, rest, and are dropped again | 0.05 to 1.3 |
//! | `gravity` | a dense swarm about a point that moves | 5 to 7 |
//! | `fragmentation` | cubes that shatter and are cleared away, ten to the peak and back | 0.15 to 2.6 |
//! | `parked` | one object in fifty pooled ten thousand worlds away | 0.06 to 0.13 |
//! | `stations` | two worlds far apart | 0.07 to 0.12 |
//! | `layers` | thin floors that do not touch | none |
//! | `plates` | packs of plates as wide as the world, between storeys of cubes | 0.07 to 0.13 |
//! | `rods` | long thin boxes among cubes | 0.06 to 0.12 |
//! | `static-world` | overlapping boxes that never move, and a few that do | 10 to 11, 0.01 to 0.12 of them moving |
//! | `asleep` | one object in fifty far below the floor | 0.06 to 0.13 |
//! | `tower` | everything on one line | 1 |
//! | `aliased` | far objects wherever an evenly spaced sample looks | 0.06 to 0.13 |
//! | `teleport` | every 30th frame everything jumps | 0.06 to 0.13 |
//! | `churn` | `uniform`, one object in 100 replaced in each frame | 0.4 to 0.55 |
//! | `sheets` | sheets as wide as the world | 0.07 to 0.14 |
//! | `long-rods` | rods as long as the world along three axes | 0.65 to 0.85 |
//! | `beams` | bounds of oblique beams of 1 to 100 edges among cubes | 0.1 to 0.4 |
//! | `city` | fixed buildings and up to 2000 objects that move | 0.75 to 1.15, at most 0.08 of them moving |
//!
//! `fragmentation` follows Figure 1 of Avril, Gouranton and Arnaldi (ISVRI 2011); `brownian`, `free-fall` and
//! `gravity` follow the scenes of those names in the benchmark Broadmark. [`Scenario`] describes each in full.
//!
//! A [`Course`] changes the load of a scene from one frame to the next, as a game does.
//!
//! [`Frames`] and [`FrameWriter`] read and write recorded boxes as `.npy` files of numpy. [`Random`] is the generator
//! of every other random number of Sapwise's measurements and statistics, so that a seed repeats them.

mod course;
mod frames;
mod random;
mod scenario;

pub use course::Course;
pub use frames::{FrameWriter, Frames, FramesError, InvalidFrame, NpyError, write_pairs};
pub use random::Random;
pub use scenario::{Scenario, Scene};
