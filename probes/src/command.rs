//! The command as a value that a user's `main` makes and runs.

use crate::algorithms::Algorithms;
use crate::args::Arguments;
use crate::exit::{self, Outcome};
use crate::{output, verbs};
use clap::Parser;
use std::process::ExitCode;

pub use crate::algorithms::UserAlgorithm;

/// The command `sapwise`, with the user's own algorithms beside the library's.
///
/// Every verb times, verifies, fits, predicts and runs them like the library's. Verbs start parts of a measurement as
/// processes of the same program with other arguments: the program must reach [`run`](Self::run) with the same
/// algorithms however it is started, and print nothing before.
#[derive(Default)]
pub struct Command {
    algorithms: Algorithms,
    /// Why an algorithm was refused, if one was.
    refused: Option<String>,
}

impl Command {
    /// Creates the command with the library's algorithms.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an algorithm. [`run`](Self::run) fails if its name is no method name, belongs to the library, or was added
    /// before.
    #[must_use]
    pub fn with(mut self, algorithm: UserAlgorithm) -> Self {
        let refused = self.algorithms.add(algorithm).err();
        self.refused = self.refused.or(refused);
        self
    }

    /// Runs the arguments of this process and returns the exit status for `main`: 0 done, 1 failed, 2 wrong usage, 128
    /// plus the number of a signal that asked to stop. Ends the process itself if the arguments can't be read.
    #[must_use]
    pub fn run(self) -> ExitCode {
        // Before the arguments are read, so that the author of the program sees it in any case.
        if let Some(why) = self.refused {
            return exit::report(Err(anyhow::anyhow!("{why}")));
        }
        match Arguments::try_parse() {
            Ok(arguments) => exit::report(verbs::run(arguments.verb, &self.algorithms)),
            // Help or the version, which fail if standard output takes nothing.
            Err(help) if !help.use_stderr() => {
                exit::report(help.print().map_err(output::refused).map(|()| Outcome::Done))
            }
            Err(wrong_usage) => wrong_usage.exit(),
        }
    }
}
