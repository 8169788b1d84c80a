//! Progress of long work, and whether the user wants it to stop.

/// The user asked to stop before the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted before the end; there is no result")]
pub struct Interrupted;

/// Receives the progress of long work. Work of several parts starts each with its own number of steps. [`Silent`]
/// ignores all of it.
pub trait Progress: Sync {
    /// Begins a part of `steps` steps.
    fn start(&self, steps: u64);

    /// Adds `steps` finished steps of the part. Called from several threads.
    fn advance(&self, steps: u64);

    /// Says what the work is doing.
    fn message(&self, text: &str);

    /// Warns the user; the work goes on. Called from several threads.
    fn warn(&self, text: &str);

    /// Asks between steps whether to go on.
    ///
    /// # Errors
    /// When the user asked to stop.
    fn check(&self) -> Result<(), Interrupted>;
}

/// Ignores all progress and is never interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Silent;

impl Progress for Silent {
    fn start(&self, _: u64) {}

    fn advance(&self, _: u64) {}

    fn message(&self, _: &str) {}

    fn warn(&self, _: &str) {}

    fn check(&self) -> Result<(), Interrupted> {
        Ok(())
    }
}
