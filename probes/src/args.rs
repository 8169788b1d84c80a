//! The command line.

mod known;
mod run;
mod study;

use crate::contention::Contended;
use crate::exit::WrongUsage;
use crate::gpus::GpuChoice;
use crate::restriction::Lifted;
use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use sapwise::AlgorithmId;
use sapwise_scenes::Scenario;
use std::path::PathBuf;

pub(crate) use run::{Run, Scene};
pub(crate) use study::Study;

/// Measures this machine, predicts which broad-phase algorithm is fastest on it, and runs it.
#[derive(Debug, Parser)]
#[command(name = "sapwise", version, max_term_width = 100, propagate_version = true)]
#[command(after_help = "\
Exit status: 0 done, 1 failed, 2 wrong usage.
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
    Compare(Compare),
    Simulate(Simulate),
    Schema(Schema),
    Completions(Completions),
    Man(Man),
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

/// Measures this machine: its hardware parameters, then every algorithm over scenarios and sizes.
///
/// Takes half a minute with --quick and at most three minutes without it, and some seconds more for each GPU. Ctrl-C keeps what
/// was measured.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise probe --quick
  sapwise probe --out this-machine.json
  sapwise probe --threads 1 --out one-core.json    (as if the machine had one core)
  sapwise probe --profiles --out reports           (every profile of this machine, for train and for datasets/)")]
pub(crate) struct Probe {
    /// Measure the whole family of reports of this machine, one after the other: fewer threads, lower SIMD levels, memory and
    /// cache contended, each GPU. The same command goes on where it was stopped.
    #[arg(long, conflicts_with_all = ["hardware_only", "threads", "contended", "json"])]
    pub(crate) profiles: bool,
    /// List the profiles and the time that they take, and measure nothing.
    #[arg(long, requires = "profiles")]
    pub(crate) dry_run: bool,
    /// Only the hardware parameters, in seconds.
    #[arg(long, conflicts_with_all = ["quick", "scenarios", "max_objects"])]
    pub(crate) hardware_only: bool,
    /// Three scenarios up to 300 000 objects, half a minute in all. With --profiles this goes for all of them, else for those
    /// with contention or GPUs.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Use this many cores at most, as if the machine had no more.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) threads: Option<u32>,
    /// Load half of the cores with threads that take memory bandwidth or cache while everything is measured.
    #[arg(long, value_name = "KIND", num_args = 0..=1, require_equals = true, default_missing_value = "memory")]
    pub(crate) contended: Option<Contended>,
    /// Seed of the scenarios and of the order in which algorithms take turns.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) gpus: GpuChoice,
    /// The largest size in the sweep.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(10..=10_000_000))]
    pub(crate) max_objects: Option<u32>,
    /// Sweep this scenario instead of the usual ones; may be given several times.
    #[arg(long = "scenario", value_name = "NAME", value_parser = known::scenario_name())]
    pub(crate) scenarios: Vec<String>,
    /// A report from which one thing less was taken, to prove this restriction by.
    // What is hidden says itself what it conflicts with: completions leave it out, and what they hold may name nothing that they lack.
    #[arg(long, hide = true, value_name = "KIND=R.json", conflicts_with = "profiles")]
    pub(crate) unrestricted: Vec<Lifted>,
    /// Stop as at Ctrl-C when standard input ends. For a process that starts this one.
    #[arg(long, hide = true, conflicts_with = "profiles")]
    pub(crate) leashed: bool,
    /// Where the report goes. Without this option it goes to report.json, or with --json nowhere else. With --profiles a folder,
    /// without this option reports/.
    #[arg(long, value_name = "R.json")]
    pub(crate) out: Option<PathBuf>,
    /// The report on standard output instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Probe {
    /// The scenarios that are asked for, each once.
    ///
    /// # Errors
    /// When one is unknown.
    pub(crate) fn scenarios(&self) -> Result<Vec<Scenario>, WrongUsage> {
        let scenarios: Result<Vec<Scenario>, _> = self.scenarios.iter().map(|s| s.parse()).collect();
        let mut scenarios = scenarios.map_err(|e: sapwise_scenes::UnknownScenario| WrongUsage(format!("--scenario: {e}")))?;
        let mut seen = Vec::new();
        scenarios.retain(|s| !seen.contains(s) && (seen.push(*s), true).1);
        Ok(scenarios)
    }
}

/// Predicts which algorithm is fastest on this machine, for each number of objects, from its hardware parameters and a handful of
/// samples.
///
/// Measures the hardware in a few seconds, some more for each GPU, and runs no sweep. With --report it predicts for the machine
/// of that report.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise predict
  sapwise predict --scenario clustered --out tuning.json
  sapwise predict --report other-machine.json --model mine.json
  sapwise predict --report this-machine.json --measured --out tuning.json    (measured, for an engine to ship)")]
pub(crate) struct Predict {
    /// Predict for the machine of this report instead of measuring this one.
    #[arg(long, value_name = "R.json", conflicts_with = "threads")]
    pub(crate) report: Option<PathBuf>,
    /// Take the tuning from the report's own timings instead of a model: slower to get than a prediction, and surer.
    #[arg(long, requires = "report", conflicts_with = "model")]
    pub(crate) measured: bool,
    /// Use this model instead of the built-in one.
    #[arg(long, value_name = "M.json")]
    pub(crate) model: Option<PathBuf>,
    /// Correct the prediction by timing up to this many algorithms, each at the size where that tells most, in two seconds at most.
    /// 0 is the pure prediction, and so is the prediction for the machine of a report.
    #[arg(long, value_name = "K", default_value_t = 8, conflicts_with = "measured", value_parser = clap::value_parser!(u32).range(0..=100))]
    pub(crate) samples: u32,
    /// Scenario of the slice that is shown: the choice itself depends on the load of each frame. Without this option uniform,
    /// with --measured the first of a report that lacks it.
    #[arg(long, value_name = "NAME", value_parser = known::scenario())]
    pub(crate) scenario: Option<Scenario>,
    /// Use this many cores at most, as if the machine had no more.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) threads: Option<u32>,
    #[command(flatten)]
    pub(crate) gpus: GpuChoice,
    /// Where the tuning go.
    #[arg(long, value_name = "T.json")]
    pub(crate) out: Option<PathBuf>,
    /// The tuning on standard output instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Fits a model to reports and validates it by leaving machines out.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise train datasets/ --out models/mine.json --card models/mine.md")]
pub(crate) struct Train {
    /// Reports, or folders whose *.json files are reports.
    #[arg(required = true, value_name = "R.json")]
    pub(crate) reports: Vec<PathBuf>,
    /// Train on simulated reports only. Real ones are left out, as simulated ones are without this option, so that the two are never
    /// mixed. `predict` warns of a model that was made so.
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
    /// Where a picture goes: predicted against measured times on what was left out, the regret on each machine, and how the regret
    /// falls with the number of machines. SVG or PNG by its ending.
    #[arg(long, value_name = "P.svg")]
    pub(crate) plot: Option<PathBuf>,
    /// Where JSON goes that says which hardware parameters matter for which crossover. That takes a fit of everything for each
    /// parameter, and reports of at least five physical machines to say anything.
    #[arg(long, value_name = "I.json")]
    pub(crate) importance: Option<PathBuf>,
    /// One JSON object on standard output instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Finds the overlapping pairs of your own boxes.
///
/// The file is NumPy's format, 32-bit floats of shape n x 6 or frames x n x 6, each box min x y z, max x y z. With several frames, rows
/// of NaN at the end of a frame are absent boxes.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise pairs boxes.npy --algorithm grid-sap@cpu1 --repeat 10 --out pairs.npy")]
pub(crate) struct Pairs {
    /// The boxes.
    #[arg(value_name = "BOXES.npy")]
    pub(crate) boxes: PathBuf,
    /// One of the algorithms that `sapwise devices` lists, such as grid-sap@cpu1 or grid-sap@gpu0.
    #[arg(long, value_name = "ID", value_parser = known::algorithm(), hide_possible_values = true)]
    pub(crate) algorithm: Option<AlgorithmId>,
    /// Go through all frames that many times.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) repeat: u32,
    /// Where the pairs of the last frame go, 32-bit unsigned integers of shape m x 2, sorted.
    #[arg(long, value_name = "PAIRS.npy")]
    pub(crate) out: Option<PathBuf>,
    /// Fail when a frame has more pairs than this, and say how many. Without this option the free memory sets the limit.
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

/// Says how well repeated reports of one machine agree: parameters, borders, and what the tuning of one lose on another.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  for k in 1 2 3 4 5; do sapwise probe --quick --out again/$k.json; done; sapwise compare again/")]
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
/// Their timings come from a cost model with factors that no report holds. They serve to test the training and to see how accuracy
/// grows with the number of machines; they are no evidence of how fast any machine is.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise simulate --out simulated --machines 24
  sapwise train --simulated simulated --out simulated-model.json")]
pub(crate) struct Simulate {
    /// The specifications. Without this file those that come with the command.
    #[arg(value_name = "SPECIFICATIONS.json")]
    pub(crate) specifications: Option<PathBuf>,
    /// The folder that the reports go to; made when it is not there. It must hold no *.json file.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// How many machines. Without this option one for each CPU.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) machines: Option<u32>,
    /// Seed of the pairing, of the hidden factors, of the scenes and of the noise.
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
    /// The folder that they go to; made when it is not there.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// One JSON object on standard output instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Prints what a shell completes this command by.
#[derive(Debug, Args)]
#[command(after_help = "\
Where it goes:
  bash        sapwise completions bash > ~/.local/share/bash-completion/completions/sapwise
  zsh         sapwise completions zsh > ~/.zfunc/_sapwise            (with fpath+=~/.zfunc before compinit in ~/.zshrc)
  fish        sapwise completions fish > ~/.config/fish/completions/sapwise.fish
  powershell  sapwise completions powershell >> $PROFILE
  elvish      sapwise completions elvish >> ~/.config/elvish/rc.elv")]
pub(crate) struct Completions {
    /// The shell.
    #[arg(value_name = "SHELL")]
    pub(crate) shell: Shell,
}

/// Prints the manual, or writes a page for each verb.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise man | man -l -
  sapwise man --out ~/.local/share/man/man1    (then man sapwise, man sapwise-probe, ...)")]
pub(crate) struct Man {
    /// The folder that the pages go to, sapwise.1, sapwise-probe.1 and so on; made when it is not there. Without this option the page of
    /// the command goes to standard output.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// One JSON object on standard output that names the files, instead of text.
    #[arg(long, requires = "out")]
    pub(crate) json: bool,
}

/// One part of a measurement in a process of its own, so that a crash costs that part and not the run.
#[derive(Debug, Args)]
pub(crate) struct Part {
    #[command(subcommand)]
    pub(crate) part: PartKind,
}

#[derive(Debug, Subcommand)]
pub(crate) enum PartKind {
    /// Prints the parameters of one family as JSON.
    Hardware {
        family: String,
        #[arg(long)]
        threads: Option<u32>,
    },
    /// Prints the GPUs, one as JSON a line.
    Gpus,
    /// Prints the algorithms on all GPUs, one as JSON a line.
    GpuAlgorithms,
    /// Opens a GPU and prints its limits as JSON.
    GpuLimits { index: u32 },
    /// Prints a GPU with its parameters as JSON.
    Gpu {
        index: u32,
        #[arg(long)]
        threads: Option<u32>,
    },
    /// Prints the parameters of several GPUs together as JSON.
    GpuGroup {
        /// As in `gpu0+1`.
        gpus: sapwise::Backend,
        #[arg(long)]
        threads: Option<u32>,
    },
    /// Takes the samples that standard input asks for, and prints an answer as JSON a line.
    Samples {
        /// What holds for all of them, as JSON.
        order: String,
    },
    /// Sweeps one scenario and prints one event as JSON a line.
    Sweep {
        /// The order, as JSON.
        order: String,
    },
}
