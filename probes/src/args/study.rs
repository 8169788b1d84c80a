//! The arguments of `sapwise study`.

use clap::Args;
use std::path::PathBuf;

/// Studies how hardware shapes performance: one page with figures, and tables as CSV, about any set of reports.
///
/// DIR/index.html shows time over objects on the CPU and GPUs, the fields of the fastest algorithm, the regret of
/// what is chosen on held-out hosts, the machines, and the influence of their parameters on the crossovers. Beside it
/// are the figures as SVG, and timings.csv, crossovers.csv, regrets.csv, parameters.csv and influence.csv.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise study datasets --out study")]
pub(crate) struct Study {
    /// Reports, or folders whose *.json files are reports.
    #[arg(required = true, value_name = "REPORT")]
    pub(crate) reports: Vec<PathBuf>,
    /// The folder that the study goes to: new, empty, or that of an earlier study, whose files are replaced.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// One JSON object on standard output instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}
