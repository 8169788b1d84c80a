//! Exit statuses: 0 done, 1 failed, 2 wrong usage, 128 plus the number of a signal that asked the program to stop.

use std::process::ExitCode;

/// How a verb ended that has printed its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Exit status 0.
    Done,
    /// Exit status 1, or that of a signal. The output shows the failure.
    Failed,
}

/// A command line or an environment that can't be followed. Exit status 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct WrongUsage(pub(crate) String);

/// Prints the error, if there is one, and returns the exit status.
pub(crate) fn report(result: anyhow::Result<Outcome>) -> ExitCode {
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Failed) => failed(),
        Err(error) if crate::output::is_closed(&error) => ExitCode::SUCCESS,
        Err(error) => {
            let wrong_usage = error.downcast_ref::<WrongUsage>().is_some();
            crate::output::complain(&format!("error: {error:#}"));
            if wrong_usage { ExitCode::from(2) } else { failed() }
        }
    }
}

fn failed() -> ExitCode {
    ExitCode::from(crate::interrupt::exit_status().unwrap_or(1))
}
