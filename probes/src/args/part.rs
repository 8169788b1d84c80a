//! The arguments of the hidden verb `part`.

use clap::Subcommand;

/// Runs one part of a measurement in its own process, so that a crash costs that part only.
#[derive(Debug, Subcommand)]
pub(crate) enum Part {
    /// Prints the GPUs, one as JSON a line.
    Gpus,
    /// Prints the algorithms on all GPUs, one as JSON a line.
    GpuAlgorithms,
    /// Prints a GPU with its parameters, as JSON.
    Gpu {
        index: u32,
        #[arg(long)]
        threads: Option<u32>,
    },
    /// Prints the parameters of several GPUs that work together, as JSON.
    GpuGroup {
        /// As in `gpu0+1`.
        gpus: sapwise::algorithm::Backend,
        #[arg(long)]
        threads: Option<u32>,
    },
    /// Sweeps one scenario and prints its events, one as JSON a line.
    Sweep {
        /// The request, as JSON.
        request: String,
    },
}
