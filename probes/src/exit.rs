//! Exit statuses: 0 done, 1 failed, 2 wrong usage, 128 plus the number of a signal where that asked the program to stop.

use std::fmt;
use std::process::ExitCode;

/// How a verb ended that printed all it had to say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Exit status 0.
    Done,
    /// Exit status 1, or that of a signal. What failed stands in the output already.
    Failed,
}

/// The command line or the environment asks for something that can't be. Exit status 2.
#[derive(Debug)]
pub(crate) struct WrongUsage(pub(crate) String);

impl fmt::Display for WrongUsage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for WrongUsage {}

/// Prints the error, if there is one, and turns the result into an exit status.
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
