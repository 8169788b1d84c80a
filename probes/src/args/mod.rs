//! The command line.

#[cfg(test)]
mod documents;
mod fleet;
mod known;
mod part;
mod probe;
mod run;
mod study;

use crate::gpus::GpuChoice;
use clap::{Args, Parser, Subcommand};
use sapwise::AlgorithmId;
use sapwise_scenes::Scenario;
use std::path::PathBuf;

pub(crate) use fleet::Fleet;
pub(crate) use part::{Part, PartKind};
pub(crate) use probe::Probe;
pub(crate) use run::{Run, Scene};
pub(crate) use study::Study;

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
    Convert(Convert),
    Compare(Compare),
    Fleet(Fleet),
    Simulate(Simulate),
    Schema(Schema),
    #[command(hide = true)]
    Part(Part),
}

/// Lists the GPUs of this machine and the algorithms that it can run, and why it can't run the others.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  sapwise devices --json")]
pub(crate) struct Devices {
    /// Look for no GPU, and load no driver.
    #[arg(long)]
    pub(crate) no_gpus: bool,
    /// One JSON object on standard output instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Predicts which algorithm is fastest on this machine, for each number of objects, from its hardware parameters.
///
/// Measures the hardware in a few seconds, some more for each GPU, and runs no sweep. With --report it predicts for the machine
/// of that report.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise predict
  sapwise predict --scenario clustered --out tuning.json
  sapwise predict --report other-machine.json --model mine.json
  sapwise predict --report this-machine.json --measured --out tuning.json    # measured, for an engine to ship
  sapwise predict --report reports --measured --out tunings    # one for each kind of machine among the reports of a folder")]
pub(crate) struct Predict {
    /// Predict for the machine of this report instead of measuring this one; of a folder of reports, for each kind of machine.
    #[arg(long, value_name = "R.json", conflicts_with = "threads")]
    pub(crate) report: Option<PathBuf>,
    /// Correct the prediction by all timings of the report.
    #[arg(long, requires = "report")]
    pub(crate) measured: bool,
    /// Use this model instead of the built-in one.
    #[arg(long, value_name = "M.json")]
    pub(crate) model: Option<PathBuf>,
    /// Correct the prediction by timing up to this many algorithms, each at the size where a sample reduces the expected regret most, in two
    /// seconds at most. That pays on a machine unlike those of training, which the prediction tells; on others it changes little. For the machine of a
    /// report none is taken.
    #[arg(long, value_name = "K", default_value_t = 0, conflicts_with = "measured", value_parser = known::whole(0..=100), allow_negative_numbers = true)]
    pub(crate) samples: u32,
    /// Scenario of the slice that is shown; the choice itself depends on the load of each frame. Without this option uniform, with
    /// --measured the first of a report that lacks it.
    #[arg(long, value_name = "NAME", value_parser = known::scenario())]
    pub(crate) scenario: Option<Scenario>,
    /// Use this many cores at most, as if the machine had no more.
    #[arg(long, value_name = "K", value_parser = known::whole(1..=4096), allow_negative_numbers = true)]
    pub(crate) threads: Option<u32>,
    #[command(flatten)]
    pub(crate) gpus: GpuChoice,
    /// Where the tuning goes; with a folder of reports the folder for the tunings, which is made where it is missing.
    #[arg(long, value_name = "T.json")]
    pub(crate) out: Option<PathBuf>,
    /// The tuning on standard output instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Fits a model to reports and validates it on machines that are held out.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise train datasets/ --out mine.json --card mine.md")]
pub(crate) struct Train {
    /// Reports, or folders whose *.json files are reports.
    #[arg(required = true, value_name = "R.json")]
    pub(crate) reports: Vec<PathBuf>,
    /// Train on simulated reports only. Without this option simulated reports are left out, so that the two are never mixed. `predict`
    /// warns of a model that was trained on simulated reports.
    #[arg(long)]
    pub(crate) simulated: bool,
    /// Where the model goes.
    #[arg(long, value_name = "M.json")]
    pub(crate) out: PathBuf,
    /// Name of the model. Without this option that of the file.
    #[arg(long)]
    pub(crate) name: Option<String>,
    /// Where a page goes that says what the model was trained on and how well it did.
    #[arg(long, value_name = "CARD.md")]
    pub(crate) card: Option<PathBuf>,
    /// Where a picture goes: predicted against measured times of the machines that were held out, and the regret on each of them. SVG or PNG
    /// by its ending.
    #[arg(long, value_name = "P.svg")]
    pub(crate) plot: Option<PathBuf>,
    /// Where JSON goes that says which hardware parameters matter for which crossover. Needs reports of at least five physical machines, and
    /// fits every model again for each parameter.
    #[arg(long, value_name = "I.json")]
    pub(crate) importance: Option<PathBuf>,
    /// One JSON object on standard output instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Finds the overlapping pairs of your own boxes.
///
/// The file is an .npy file of 32-bit floats, of shape n x 6 or frames x n x 6; each row is a box: min x y z, max x y z. In a file of
/// several frames, rows of NaN at the end of a frame are absent boxes.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise pairs boxes.npy --algorithm grid-sap@cpu1 --repeat 10 --out pairs.npy")]
pub(crate) struct Pairs {
    /// The boxes.
    #[arg(value_name = "BOXES.npy")]
    pub(crate) boxes: PathBuf,
    /// One of the algorithms that `sapwise devices` lists, such as grid-sap@cpu1 or grid-sap@gpu0.
    #[arg(long, value_name = "ID")]
    pub(crate) algorithm: Option<AlgorithmId>,
    /// Run all frames this many times.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = known::whole(1..=1_000_000), allow_negative_numbers = true)]
    pub(crate) repeat: u32,
    /// Where the pairs of the last frame go, 32-bit unsigned integers of shape m x 2, sorted.
    #[arg(long, value_name = "PAIRS.npy")]
    pub(crate) out: Option<PathBuf>,
    /// Fail when a frame has more pairs than this; the search ends there. Without this option the free memory sets the limit.
    #[arg(long, value_name = "N")]
    pub(crate) limit: Option<usize>,
    /// One JSON object on standard output instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Says whether reports, models and tuning files are sound, current and applicable on this machine.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  sapwise check report.json models/*.json")]
pub(crate) struct Check {
    /// The files.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// One JSON object on standard output instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Writes reports, models and tuning files of older versions in the form that is read now.
///
/// No figure changes. What the current form has no place for is left out, and told.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  sapwise convert report.json model.json --out converted")]
pub(crate) struct Convert {
    /// The files.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// The folder that they go to, under their names, created if missing.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// One JSON object on standard output instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Says how well repeated reports of one machine agree: parameters, crossovers, and the regret of one report's tuning on another's timings.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise probe --quick --out first.json
  sapwise probe --quick --out second.json
  sapwise compare first.json second.json")]
pub(crate) struct Compare {
    /// Two or more reports made by the same command, or folders whose *.json files are such reports.
    #[arg(required = true, value_name = "R.json")]
    pub(crate) reports: Vec<PathBuf>,
    /// Leave out reports during which a hypervisor moved the cores, or left them elsewhere than in most reports.
    #[arg(long)]
    pub(crate) steady: bool,
    /// One JSON object on standard output instead of tables.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Makes reports of simulated machines from published specifications of CPUs and GPUs.
///
/// Their timings come from a cost model with hidden factors. They test the training; they are no evidence of how fast any machine is.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise simulate --out simulated --machines 24
  sapwise train --simulated simulated --out simulated-model.json")]
pub(crate) struct Simulate {
    /// The specifications. Without this file, those that are built in.
    #[arg(value_name = "SPECIFICATIONS.json")]
    pub(crate) specifications: Option<PathBuf>,
    /// The folder that the reports go to, created if missing. It must hold no *.json file.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// How many machines. Without this option one for each CPU.
    #[arg(long, value_name = "N", value_parser = known::whole(1..=10_000), allow_negative_numbers = true)]
    pub(crate) machines: Option<u32>,
    /// Seed of the pairing of CPUs and GPUs, of the hidden factors, of the scenes and of the noise.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// One JSON object on standard output instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Writes the JSON Schemas of reports, models and tuning files.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  sapwise schema --out schemas")]
pub(crate) struct Schema {
    /// The folder that they go to, created if missing.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// One JSON object on standard output instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn every_example_of_the_help_is_understood() {
        let command = Arguments::command();
        let mut count = 0;
        for verb in command.get_subcommands() {
            let help = verb.get_after_help().map(ToString::to_string).unwrap_or_default();
            for line in help.lines().filter_map(|line| Some(&line[line.find("sapwise ")?..])) {
                let words = line.split(['#', '>']).next().unwrap_or_default();
                let parsed = Arguments::try_parse_from(words.split_whitespace());
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
                count += 1;
            }
        }
        assert!(count >= 20, "{count}");
    }
}
