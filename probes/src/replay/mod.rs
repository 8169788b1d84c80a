//! The replay: the adaptive choice and every fixed algorithm run the frames of a scene or of a recorded stream in
//! turns.

mod frame_source;
mod other_work;
mod outcome;
mod race;
mod samples;
mod trace;

pub(crate) use frame_source::{FrameSource, Swing};
pub(crate) use outcome::{Outcome, Part, Times};
pub(crate) use race::{ReplaySettings, replay, too_wide};
pub(crate) use samples::WINDOW;
pub(crate) use trace::write_trace;

#[cfg(test)]
mod tests;
