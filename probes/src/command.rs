//! The command as a value that a user's `main` makes and runs.

use crate::algorithms::Algorithms;
use crate::args::Arguments;
use crate::{exit, verbs};
use clap::Parser;
use sapwise::{BroadPhase, Error};
use std::process::ExitCode;

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

    /// Adds an algorithm that runs on the calling thread alone, as `method@cpu1`.
    ///
    /// `method` is 1 to 32 of `a-z`, `0-9`, `-` and `_`, beginning with a letter, and no name of ours; else [`run`](Self::run) says so and
    /// fails. Count `revision` up whenever its speed changes: reports and models of other revisions are stale then. `make` is called in
    /// each process that runs the algorithm, and its error leaves the algorithm out with a remark. One with kernels of several vector
    /// widths asks [`SimdLevel::in_use`](sapwise::SimdLevel::in_use), so that a probe with `SAPWISE_SIMD` restricts it as well.
    #[must_use]
    pub fn with(
        self,
        method: &str,
        revision: u32,
        make: impl Fn() -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static,
    ) -> Self {
        self.add(method, revision, false, move |_| make())
    }

    /// The same of an algorithm that runs on several threads: `make` gets their number, the calling one included. It is listed, as
    /// ours are, on 1, 2, 4, ... threads and on all that the machine has or `--threads` allows. The command pins our threads to cores;
    /// those of a user's algorithm it leaves alone.
    #[must_use]
    pub fn with_threads(
        self,
        method: &str,
        revision: u32,
        make: impl Fn(u32) -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static,
    ) -> Self {
        self.add(method, revision, true, make)
    }

    fn add(
        mut self,
        method: &str,
        revision: u32,
        parallel: bool,
        make: impl Fn(u32) -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static,
    ) -> Self {
        let refused = self.algorithms.add(method, revision, parallel, make).err();
        self.refused = self.refused.or(refused);
        self
    }

    /// Reads the arguments of this process, does what they ask, and gives the exit status for `main` to return: 0 done, 1 failed,
    /// 2 wrong usage. Ends the process itself where the arguments can't be read or ask for help.
    #[must_use]
    pub fn run(self) -> ExitCode {
        // Before the arguments are looked at: whoever wrote the program should see it, whatever they ask for.
        if let Some(why) = self.refused {
            return exit::report(Err(anyhow::anyhow!("{why}")));
        }
        exit::report(verbs::run(Arguments::parse().verb, &self.algorithms))
    }
}
