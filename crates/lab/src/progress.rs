//! How far long work has come, and whether the user wants it to end.

/// The user asked to stop before the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted before the end; there is no result")]
pub struct Interrupted;

/// Where long work tells how far it has come. A program draws a bar of it; [`Silent`] draws nothing.
///
/// Work that consists of several parts starts each with its own number of steps.
pub trait Progress: Sync {
    /// Begins a part of `steps` steps.
    fn start(&self, steps: u64);

    /// `steps` more steps of the part are done. Called from several threads.
    fn advance(&self, steps: u64);

    /// Says what is being done.
    fn message(&self, text: &str);

    /// Tells what the user should know and what stops nothing. Called from several threads.
    fn warn(&self, text: &str);

    /// Asked between steps whether to go on.
    ///
    /// # Errors
    /// When the user asked to stop.
    fn check(&self) -> Result<(), Interrupted>;
}

/// Tells nobody, and is never interrupted.
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
