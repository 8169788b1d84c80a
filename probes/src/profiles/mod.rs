//! `sapwise probe --profiles`: the profiles of one machine, each measured by a process of its own.

mod family;
mod profile;
mod resume;
mod runner;
mod slug;

use crate::algorithms::Algorithms;
use crate::args::Probe;
use crate::exit::{Outcome, WrongUsage};
use crate::restriction::LAVAPIPE_THREADS;
use crate::{gpus, interrupt, output};
use anyhow::Context;
use family::{Whole, family};
use indicatif::HumanDuration;
use profile::Profile;
pub(crate) use profile::machine_stem;
use resume::Existing;
use runner::{End, ProfileRunner};
use sapwise::{GpuIdentity, SimdLevel, measure, usable_cores};
use sapwise_lab::text::columns;
use sapwise_scenes::Scenario;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Where the reports go without `--out`.
const DEFAULT: &str = "reports";

/// Measures every profile that the folder does not hold yet.
///
/// # Errors
/// On wrong usage, when the folder takes no file or no process can be started. A profile that fails is told at the end.
pub(crate) fn run(arguments: &Probe, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    // The family sets both; what comes from outside would restrict every profile, also the one that is called full.
    for name in ["SAPWISE_SIMD", LAVAPIPE_THREADS] {
        if std::env::var_os(name).is_some_and(|value| !value.is_empty()) {
            return Err(WrongUsage(format!("--profiles sets {name} itself; unset it and run this again")).into());
        }
    }
    let scenarios = arguments.scenarios();
    let folder = arguments.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT));
    let machine = measure::machine();
    let (cores, level) = (usable_cores(), SimdLevel::detected());
    let family = family(&Whole { cores, level, gpus: taken(arguments)? }, arguments.quick);
    let stem = machine_stem(&machine.cpu, cores);
    let registry = algorithms.registry(cores);
    let (folder, stem, physical_id) = (folder.as_path(), stem.as_str(), machine.physical_id.as_str());
    let existing = Existing { folder, stem, physical_id, registry: &registry, family: arguments };
    let done: Vec<Option<PathBuf>> = family.iter().map(|p| existing.find(p)).collect();
    if arguments.dry_run {
        output::print(&listing(&family, &done, arguments, &scenarios, stem))?;
        return Ok(Outcome::Done);
    }
    take_files(folder)?;
    interrupt::listen()?;
    let mut runner = ProfileRunner::new(&family, done, &existing, &scenarios);
    let end = runner.run()?;
    let failed = runner.failed();
    output::print(&runner.summary())?;
    if end == End::Interrupted {
        anyhow::bail!(
            "interrupted: the complete profiles are in {}; the same command resumes there, and measures the interrupted profile again",
            folder.display()
        );
    }
    Ok(if failed { Outcome::Failed } else { Outcome::Done })
}

/// The GPUs to make profiles of.
///
/// # Errors
/// When no process can be started, or a GPU that was asked for by its number is not there.
fn taken(arguments: &Probe) -> anyhow::Result<Vec<GpuIdentity>> {
    if arguments.gpus.no_gpus {
        return Ok(Vec::new());
    }
    let seen = gpus::look()?;
    arguments.gpus.check(&seen)?;
    seen.remark.iter().for_each(|remark| output::warn(remark));
    let (taken, left_out): (Vec<_>, Vec<_>) = seen.identities.into_iter().partition(|g| arguments.gpus.takes(g));
    arguments.gpus.tell(&left_out).iter().for_each(|told| output::complain(told));
    Ok(taken)
}

/// Makes the folder, and tries whether it takes a file, before hours of measuring.
fn take_files(folder: &Path) -> anyhow::Result<()> {
    let taken = std::fs::create_dir_all(folder).and_then(|()| tempfile::tempfile_in(folder));
    taken.with_context(|| format!("no file can be written in {}; name another folder with --out", folder.display()))?;
    Ok(())
}

/// The profiles, what each of them is and how long it takes.
fn listing(
    family: &[Profile],
    done: &[Option<PathBuf>],
    arguments: &Probe,
    scenarios: &[Scenario],
    stem: &str,
) -> String {
    let mut rows = vec![["profile", "at most", "command"].map(str::to_owned).to_vec()];
    let mut left = Duration::ZERO;
    for (profile, done) in family.iter().zip(done) {
        let time = profile.time(scenarios, arguments.max_objects);
        left += if done.is_some() { Duration::ZERO } else { time };
        let numbers: Vec<u32> = profile.gpus.iter().map(|g| g.index).collect();
        let variables =
            profile.variables().into_iter().map(|(name, value)| format!("{name}={value} ")).collect::<String>();
        let command = format!("{variables}sapwise {}", profile.arguments(arguments, &numbers).join(" "));
        let time = if done.is_some() { "complete".to_owned() } else { HumanDuration(time).to_string() };
        rows.push(vec![format!("{stem}-{}", profile.name), time, command]);
    }
    format!("{}\n{} profiles, about {} at most.", columns(&rows), family.len(), HumanDuration(left))
}
