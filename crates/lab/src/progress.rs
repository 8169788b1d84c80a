//! Progress of long work, and whether the user wants it to stop.

/// The user asked to stop before the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted before the end; there is no result")]
pub struct Interrupted;

/// Receives the progress of long work. Methods that are not defined do nothing. Work of several parts starts each part
/// with its own number of steps.
pub trait Progress: Sync {
    /// Begins a part of this number of steps.
    fn start(&self, _steps: u64) {}

    /// Adds finished steps of the part. Called from several threads.
    fn advance(&self, _steps: u64) {}

    /// Shows a description of the current work.
    fn message(&self, _text: &str) {}

    /// Warns the user; the work goes on. Called from several threads.
    fn warn(&self, _text: &str) {}

    /// Asks between steps whether to go on.
    ///
    /// # Errors
    /// When the user asked to stop.
    fn check(&self) -> Result<(), Interrupted> {
        Ok(())
    }
}

/// Ignores all progress and is never interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Silent;

impl Progress for Silent {}
