//! The command line.

#[cfg(test)]
mod documents;
mod known;
mod part;
mod probe;
mod run;

use crate::gpus::GpuChoice;
use clap::{Args, Parser, Subcommand};
use sapwise::AlgorithmId;
use sapwise_scenes::Scenario;
use std::path::PathBuf;

pub(crate) use part::Part;
pub(crate) use probe::Probe;
pub(crate) use run::{Run, Scene};

/// Measures this machine, predicts which broad-phase algorithm is fastest on it, and runs it.
#[derive(Debug, Parser)]
#[command(name = "sapwise", version, max_term_width = 100, propagate_version = true)]
#[command(after_help = "\
Exit status: 0 done, 1 failed, 2 wrong usage, 128 plus its number after a signal.
SAPWISE_SIMD=portable|avx2|avx512 makes every algorithm use a lower level of vector instructions than the CPU has.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) verb: Verb,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    Predict(Predict),
    Devices(Devices),
    Probe(Probe),
    Run(Run),
    Train(Train),
    Study(Study),
    Pairs(Pairs),
    Check(Check),
    Schema(Schema),
    #[command(subcommand, hide = true)]
    Part(Part),
}

/// Lists the GPUs of this machine, and for each algorithm whether it runs here or why not.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  sapwise devices --json")]
pub(crate) struct Devices {
    /// Do not look for GPUs, and load no driver.
    #[arg(long)]
    pub(crate) no_gpus: bool,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Predicts which algorithm is fastest on this machine for each number of objects, from its hardware parameters.
///
/// Measures the hardware in about five seconds, longer on a busy machine and for each GPU, without a sweep. With
/// --report it predicts for the machine of that report.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise predict
  sapwise predict --scenario clustered --out tuning.json
  sapwise predict --report other-machine.json --model mine.json
  sapwise predict --report this-machine.json --measured --out tuning.json    # measured, for a known machine
  sapwise predict --report reports --measured --out tunings                  # one for each kind of machine")]
pub(crate) struct Predict {
    /// Predict for the machine of this report, or for each kind of machine in a folder of reports [default: this
    /// machine].
    #[arg(long, value_name = "R.json", conflicts_with = "threads")]
    pub(crate) report: Option<PathBuf>,
    /// Correct the prediction with all timings of the report.
    #[arg(long, requires = "report")]
    pub(crate) measured: bool,
    /// The model [default: the built-in one].
    #[arg(long, value_name = "M.json")]
    pub(crate) model: Option<PathBuf>,
    /// Scenario of the crossovers that are shown [default: uniform, or the first of a measured report without it]. A
    /// program chooses by the load of each frame, not by this scenario.
    #[arg(long, value_name = "NAME", value_parser = known::scenario())]
    pub(crate) scenario: Option<Scenario>,
    /// Use at most this many cores, 1 to all of the machine [default: all].
    #[arg(long, value_name = "K", value_parser = known::whole(1..=4096), allow_negative_numbers = true)]
    pub(crate) threads: Option<u32>,
    #[command(flatten)]
    pub(crate) gpus: GpuChoice,
    /// Where the tuning goes. With a folder of reports: the folder for the tunings, created if missing.
    #[arg(long, value_name = "T.json")]
    pub(crate) out: Option<PathBuf>,
    /// Also print every hardware parameter and every warning.
    #[arg(long, conflicts_with = "json")]
    pub(crate) verbose: bool,
    /// Print the tuning instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Fits a model to reports and validates it on machines that are held out.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise train datasets/ --out mine.json --card mine.md")]
pub(crate) struct Train {
    /// Reports, or folders: all *.json files in them are reports. The machines in published/machines.csv of a folder
    /// show how unusual others are.
    #[arg(required = true, value_name = "R.json")]
    pub(crate) reports: Vec<PathBuf>,
    /// Where the model goes.
    #[arg(long, value_name = "M.json")]
    pub(crate) out: PathBuf,
    /// Name of the model [default: that of the file].
    #[arg(long)]
    pub(crate) name: Option<String>,
    /// Where the model card goes: what the model was trained on, and how well it predicts held-out machines.
    #[arg(long, value_name = "CARD.md")]
    pub(crate) card: Option<PathBuf>,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

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

/// Finds the overlapping pairs of your own boxes.
///
/// The file is an .npy file of 32-bit floats, of shape n × 6 or frames × n × 6; each row is a box: min x y z, max x y
/// z. In a file of several frames, rows of NaN at the end of a frame are absent boxes.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise pairs boxes.npy --algorithm grid-sap@cpu1 --repeat 10 --out pairs.npy")]
pub(crate) struct Pairs {
    /// The boxes.
    #[arg(value_name = "BOXES.npy")]
    pub(crate) boxes: PathBuf,
    /// One of the algorithms of `sapwise devices`, such as grid-sap@gpu0.
    #[arg(long, value_name = "ID", default_value = "grid-sap@cpu1")]
    pub(crate) algorithm: AlgorithmId,
    /// How often all frames are run, 1 to 1 000 000.
    #[arg(
        long, value_name = "K", default_value_t = 1, value_parser = known::whole(1..=1_000_000),
        allow_negative_numbers = true
    )]
    pub(crate) repeat: u32,
    /// Where the pairs of the last frame go: sorted 32-bit unsigned integers of shape m × 2.
    #[arg(long, value_name = "PAIRS.npy")]
    pub(crate) out: Option<PathBuf>,
    /// Stop and fail when a frame has more pairs than this [default: as many as fit into half of the free memory].
    #[arg(long, value_name = "N")]
    pub(crate) limit: Option<usize>,
    /// Print one JSON object instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Checks reports, models and tunings: whether each is sound, current and usable on this machine.
///
/// Of several reports a table says which can be believed, which are of one kind (the same host under the same profile),
/// and how far the times of such repeats agree. The exit status is 1 if a file has a problem.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise check report.json models/*.json
  sapwise check reports/                     # a folder that many nodes have written into")]
pub(crate) struct Check {
    /// Files, or folders whose *.json files are checked.
    #[arg(required = true, value_name = "PATH")]
    pub(crate) files: Vec<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Writes the JSON Schemas of reports, models and tunings.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  sapwise schema --out schemas")]
pub(crate) struct Schema {
    /// The folder for them, created if missing.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}
