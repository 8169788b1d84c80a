//! The replay: frames of a seeded scene or a recorded stream, run by the adaptive choice and by every fixed algorithm side by side.

mod co_runner;
mod contestant;
mod frame;
mod frame_source;
mod oracle;
mod other_work;
mod outcome;
mod picture;
mod race;
mod samples;
mod settings;
mod trace;

pub(crate) use co_runner::{CoRunner, SHARE};
pub(crate) use frame_source::{FrameSource, Swing};
pub(crate) use oracle::WINDOW;
pub(crate) use outcome::{Outcome, Segment};
pub(crate) use picture::picture;
pub(crate) use race::{replay, too_wide};
pub(crate) use settings::ReplaySettings;
pub(crate) use trace::{check_trace, write_trace};

#[cfg(test)]
pub(crate) use outcome::tests as examples;
#[cfg(test)]
mod tests;
