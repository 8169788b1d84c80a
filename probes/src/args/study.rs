//! The arguments of `sapwise study`.

use clap::Args;
use std::path::PathBuf;

/// Studies how hardware shapes performance: a page with figures and tables of any set of reports.
///
/// The page shows the hardware of all machines, their parameters beside their speed, which parameter matters for which algorithm and
/// crossover, the paper's claims, time over objects, tuning over objects and density, and how well all of it is predicted. DIR/index.html
/// is the page; every figure is beside it as SVG, PNG and CSV, every table as CSV, and study.json is a summary for programs.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise study datasets --out study
  sapwise study reports/ --out pair --reference reports/a.json --machine reports/b.json")]
pub(crate) struct Study {
    /// Reports, or folders whose *.json files are reports. Files that can't be read are named on the page.
    #[arg(required = true, value_name = "REPORT")]
    pub(crate) reports: Vec<PathBuf>,
    /// The folder that the study goes to: new, empty, or that of an earlier study, whose files it replaces.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The report that others are compared with. Without this option the first one of a whole machine.
    #[arg(long, value_name = "REPORT")]
    pub(crate) reference: Option<PathBuf>,
    /// A report to draw; may be given several times. Without this option each machine is drawn by the report that has most of it, and of
    /// one machine alone some of its reports.
    #[arg(long = "machine", value_name = "REPORT")]
    pub(crate) machines: Vec<PathBuf>,
    /// One JSON object on standard output instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}
