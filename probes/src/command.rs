//! The command as a value that a user's `main` makes and runs.

use crate::algorithms::Algorithms;
use crate::args::Arguments;
use crate::exit::{self, Outcome};
use crate::{output, verbs};
use clap::Parser;
use std::process::ExitCode;

pub use crate::algorithms::UserAlgorithm;

/// The command `sapwise`, with algorithms of the user's own beside ours.
///
/// Each of them is timed, verified, fitted, predicted and run like ours, by every verb. Verbs run parts of a measurement in
/// processes of their own, which are the same program with other arguments: the program must reach [`run`](Self::run) with the same
/// algorithms however it is started, and print nothing before.
#[derive(Default)]
pub struct Command {
    algorithms: Algorithms,
    /// Why the first algorithm that can't be added was refused.
    refused: Option<String>,
}

impl Command {
    /// The command with our algorithms.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an algorithm. Where its name is no method name, is that of a method of ours, or was added before, [`run`](Self::run) says so and
    /// fails.
    #[must_use]
    pub fn with(mut self, algorithm: UserAlgorithm) -> Self {
        let refused = self.algorithms.add(algorithm).err();
        self.refused = self.refused.or(refused);
        self
    }

    /// Reads the arguments of this process, does what they ask, and returns the exit status for `main` to return: 0 done, 1 failed,
    /// 2 wrong usage, 128 plus its number where a signal asked to stop. Ends the process itself where the arguments can't be read.
    #[must_use]
    pub fn run(self) -> ExitCode {
        // Before the arguments are looked at: whoever wrote the program should see it, whatever they ask for.
        if let Some(why) = self.refused {
            return exit::report(Err(anyhow::anyhow!("{why}")));
        }
        match Arguments::try_parse() {
            Ok(arguments) => exit::report(verbs::run(arguments.verb, &self.algorithms)),
            // Help and the version were asked for, and are lost where standard output takes nothing.
            Err(help) if !help.use_stderr() => {
                exit::report(help.print().map_err(output::refused).map(|()| Outcome::Done))
            }
            Err(wrong_usage) => wrong_usage.exit(),
        }
    }
}
