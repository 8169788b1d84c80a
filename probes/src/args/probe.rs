//! The arguments of `sapwise probe`.

use super::known;
use crate::gpus::GpuChoice;
use clap::Args;
use sapwise_lab::text::once;
use sapwise_scenes::Scenario;
use std::path::PathBuf;

/// Measures this machine: its hardware parameters, then every algorithm over scenarios and sizes.
///
/// Takes half a minute with --quick, at most three minutes without it, and some seconds more for each GPU. Ctrl-C
/// keeps what was measured.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(after_help = "\
Examples:
  sapwise probe --quick
  sapwise probe --out this-machine.json
  sapwise probe --out reports/                     # a folder that exists, also one that many nodes share
  sapwise probe --threads 1 --out one-core.json    # as if the machine had one core
  sapwise probe --profiles --out datasets/my-host  # every profile of this machine, for train")]
pub(crate) struct Probe {
    /// Measure every profile of this machine, one after the other: the whole machine, lower SIMD levels, fewer
    /// threads, the same with each GPU, and a repetition. The same command continues where it was stopped.
    #[arg(long, conflicts_with_all = ["hardware_only", "threads", "json"])]
    pub(crate) profiles: bool,
    /// List the profiles with their times and commands, and measure nothing.
    #[arg(long, requires = "profiles")]
    pub(crate) dry_run: bool,
    /// Measure the hardware parameters only, in seconds.
    #[arg(long, conflicts_with_all = ["quick", "scenarios", "max_objects"])]
    pub(crate) hardware_only: bool,
    /// Three scenarios up to 300 000 objects, half a minute in all. Profiles with GPUs always are.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Use this many cores at most, as if the machine had no more.
    #[arg(long, value_name = "K", value_parser = known::whole(1..=4096), allow_negative_numbers = true)]
    pub(crate) threads: Option<u32>,
    /// Seed of the scenes and of the order in which algorithms run.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) gpus: GpuChoice,
    /// The largest size in the sweep.
    #[arg(long, value_name = "N", value_parser = known::whole(10..=10_000_000), allow_negative_numbers = true)]
    pub(crate) max_objects: Option<u32>,
    /// Sweep this scenario instead of the usual ones; may be given several times.
    #[arg(long = "scenario", value_name = "NAME", value_parser = known::scenario())]
    pub(crate) scenarios: Vec<Scenario>,
    /// Stop as at Ctrl-C when standard input ends. For a process that starts this one.
    #[arg(long, hide = true, conflicts_with = "profiles")]
    pub(crate) leashed: bool,
    /// Where the report goes [default: report.json; no file with --json; a folder below reports/ with --profiles]. In
    /// a folder that exists, the report is named after CPU, cores and node, and a good one of this node by the same
    /// command is kept. SAPWISE_NODE tells nodes with the same host name apart.
    #[arg(long, value_name = "R.json")]
    pub(crate) out: Option<PathBuf>,
    /// Print the report instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Probe {
    /// Returns the scenarios that are asked for, each once.
    pub(crate) fn scenarios(&self) -> Vec<Scenario> {
        once(self.scenarios.iter().copied())
    }

    /// Parses the words after `sapwise probe`, with blanks between.
    #[cfg(test)]
    pub(crate) fn of(words: &str) -> Self {
        let all = ["sapwise", "probe"].into_iter().chain(words.split_whitespace());
        match <super::Arguments as clap::Parser>::try_parse_from(all).unwrap().verb {
            super::Verb::Probe(probe) => probe,
            other => panic!("{other:?}"),
        }
    }
}
