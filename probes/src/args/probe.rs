//! The arguments of `sapwise probe`.

use super::known;
use crate::contention::Contended;
use crate::gpus::GpuChoice;
use clap::Args;
use sapwise_lab::report::Restricted;
use sapwise_scenes::Scenario;
use std::path::PathBuf;
use std::str::FromStr;

/// Measures this machine: its hardware parameters, then every algorithm over scenarios and sizes.
///
/// Takes half a minute with --quick and at most three minutes without it, and some seconds more for each GPU. Ctrl-C keeps what was
/// measured.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise probe --quick
  sapwise probe --out this-machine.json
  sapwise probe --out reports/                     # a folder that exists, also one that many nodes share
  sapwise probe --threads 1 --out one-core.json    # as if the machine had one core
  sapwise probe --profiles --out reports           # every profile of this machine, for train and for datasets/")]
pub(crate) struct Probe {
    /// Measure every profile of this machine, one after the other: fewer threads, lower SIMD levels, contended memory and cache, each
    /// GPU. The same command resumes where it was stopped.
    #[arg(long, conflicts_with_all = ["hardware_only", "threads", "contended", "json"])]
    pub(crate) profiles: bool,
    /// List the profiles and the time that they take, and measure nothing.
    #[arg(long, requires = "profiles")]
    pub(crate) dry_run: bool,
    /// Only the hardware parameters, in seconds.
    #[arg(long, conflicts_with_all = ["quick", "scenarios", "max_objects"])]
    pub(crate) hardware_only: bool,
    /// Three scenarios up to 300 000 objects, half a minute in all. With --profiles it applies to all profiles; without it only those
    /// with contention or GPUs are quick.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Use this many cores at most, as if the machine had no more.
    #[arg(long, value_name = "K", value_parser = known::whole(1..=4096), allow_negative_numbers = true)]
    pub(crate) threads: Option<u32>,
    /// Run threads on half of the cores that take memory bandwidth or cache while everything is measured.
    #[arg(long, value_name = "KIND", num_args = 0..=1, require_equals = true, default_missing_value = "memory")]
    pub(crate) contended: Option<Contended>,
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
    /// A report from which one thing less was taken, to prove this restriction by.
    #[arg(long, hide = true, value_name = "KIND=R.json", conflicts_with = "profiles")]
    pub(crate) unrestricted: Vec<Lifted>,
    /// Stop as at Ctrl-C when standard input ends. For a process that starts this one.
    #[arg(long, hide = true, conflicts_with = "profiles")]
    pub(crate) leashed: bool,
    /// Where the report goes [default: report.json; with --profiles reports/; with --json nowhere]. In a folder that exists its name is
    /// made of CPU, cores and node, and a good report of this node by the same command is kept: `sapwise check` reads what many nodes
    /// have put there. SAPWISE_NODE names a node, if several have one host name. With --profiles a folder.
    #[arg(long, value_name = "R.json")]
    pub(crate) out: Option<PathBuf>,
    /// The report on standard output instead of a summary.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Probe {
    /// The scenarios that are asked for, each once.
    pub(crate) fn scenarios(&self) -> Vec<Scenario> {
        let mut seen = Vec::new();
        self.scenarios.iter().copied().filter(|s| !seen.contains(s) && (seen.push(*s), true).1).collect()
    }
}

/// A report of the machine from which one thing less was taken, as `KIND=R.json`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Lifted {
    pub(crate) kind: Restricted,
    pub(crate) report: PathBuf,
}

impl FromStr for Lifted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, path) = text.split_once('=').ok_or("give it as KIND=R.json")?;
        let kind = serde_json::from_value(kind.into()).map_err(|e| e.to_string())?;
        Ok(Self { kind, report: path.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_and_a_file_are_read_from_one_word() {
        let lifted: Lifted = "contended_cache=a=b.json".parse().unwrap();
        assert_eq!(lifted, Lifted { kind: Restricted::ContendedCache, report: "a=b.json".into() });
        assert!("threads".parse::<Lifted>().is_err() && "cores=a.json".parse::<Lifted>().is_err());
    }
}
