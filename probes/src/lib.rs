//! The command `sapwise` as a library, so that a program of a few lines is the whole command with algorithms of its
//! own.
//!
//! ```no_run
//! use sapwise::{Aabb, BroadPhase, Error, Pairs};
//!
//! struct DoubleLoop;
//!
//! impl BroadPhase for DoubleLoop {
//!     fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
//!         pairs.clear();
//!         for (j, b) in boxes.iter().enumerate() {
//!             if let Some(defect) = b.defect() {
//!                 return Err(Error::InvalidBox { index: j, defect });
//!             }
//!             for (i, _) in boxes[..j].iter().enumerate().filter(|(_, a)| a.overlaps(b)) {
//!                 pairs.push(i as u32, j as u32);
//!             }
//!         }
//!         pairs.finish()
//!     }
//! }
//!
//! // The last step of `main`.
//! let double_loop = sapwise_cli::UserAlgorithm::on_one_thread("double-loop", 1, || Ok(Box::new(DoubleLoop)));
//! let status = sapwise_cli::Command::new().with(double_loop).run();
//! ```
//!
//! `probes/examples/own_algorithm.rs` is such a program with a sweep.

mod algorithms;
mod args;
mod check;
mod child;
mod command;
mod date;
mod destination;
mod exit;
mod flaw;
mod gpus;
mod hardware;
mod interrupt;
mod node;
mod output;
mod outputs;
mod prediction;
mod profiles;
mod progress;
mod provenance;
mod replay;
mod revisions;
mod shell;
mod summary;
mod sweep;
mod terminal;
mod verbs;

pub use command::{Command, UserAlgorithm};

/// The examples of the guide as tests: here are all features of the library that they need.
#[cfg(doctest)]
#[doc = include_str!("../../docs/guide.md")]
struct Guide;

/// The example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
