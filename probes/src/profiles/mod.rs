//! `sapwise probe --profiles`: one report for each profile of this machine, each measured by a process of its own.

mod profile;
mod slug;

use crate::algorithms::Algorithms;
use crate::args::Probe;
use crate::child::{Ended, run_verb};
use crate::exit::{Outcome, WrongUsage};
use crate::flaw::flaw;
use crate::outputs::make_folder;
use crate::progress::{Progress, Steps as _};
use crate::{gpus, interrupt, output, shell};
use anyhow::{Context, bail};
use indicatif::HumanDuration;
use profile::{Profile, profiles};
use sapwise::Registry;
use sapwise::algorithm::{SimdLevel, usable_cores};
use sapwise_lab::data::read_report;
use sapwise_lab::text::columns;
use sapwise_tune::{GpuIdentity, measure};
pub(crate) use slug::machine as machine_stem;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A probe ends by itself long before this. One that does not hangs in a driver.
const LIMIT: Duration = Duration::from_secs(3600);

/// Measures every profile whose report is missing in the folder or no longer good.
///
/// # Errors
/// On wrong usage, when a file of the folder must not be replaced, when the folder takes no file, or on Ctrl-C.
/// A profile that fails is printed, and the next one is measured.
pub(crate) fn run(arguments: &Probe, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    if std::env::var_os("SAPWISE_SIMD").is_some_and(|value| !value.is_empty()) {
        bail!(WrongUsage("--profiles sets SAPWISE_SIMD itself; unset it and run this again".to_owned()));
    }
    let cores = usable_cores();
    let default = || Path::new("reports").join(machine_stem(&measure::machine().cpu, cores));
    let folder = Folder {
        path: arguments.out.clone().unwrap_or_else(default),
        physical_id: measure::machine().physical_id,
        registry: algorithms.registry(cores),
    };
    let all = profiles(arguments, cores, SimdLevel::detected(), &taken(arguments)?);
    let lacks: Vec<Option<String>> = all.iter().map(|p| folder.lack(p)).collect::<anyhow::Result<_>>()?;
    if arguments.dry_run {
        output::print(&listing(&all, &lacks))?;
        return Ok(Outcome::Done);
    }
    make_folder(&folder.path)?;
    interrupt::listen()?;
    let waiting: Vec<&Profile> = all.iter().zip(&lacks).filter(|(_, lack)| lack.is_some()).map(|(p, _)| p).collect();
    let progress = Progress::new(waiting.iter().map(|p| p.time.as_secs()).sum());
    let (mut before, mut failed) = (Duration::ZERO, 0);
    for (k, profile) in waiting.iter().enumerate() {
        progress.message(&format!("{} of {}: {}", k + 1, waiting.len(), profile.name));
        if let Some(why) = folder.measure(profile, before, &progress)? {
            failed += 1;
            progress.aside(|| output::complain(&format!("{}: FAILED: {why}", profile.name)));
        }
        before += profile.time;
    }
    let shown = shell::path(&folder.path);
    output::print(&format!("{} of {} profiles are complete in {shown}", all.len() - failed, all.len()))?;
    if failed > 0 {
        output::print("Next: run the same command again, which measures those that failed")?;
        return Ok(Outcome::Failed);
    }
    output::print(&shell::next(&format!("train {shown} --out model.json")))?;
    Ok(Outcome::Done)
}

/// Returns the GPUs to make profiles of.
///
/// # Errors
/// When no process can be started, or this machine lacks a GPU that `--gpu` names.
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

/// Lists each profile with the longest time that it should take and the command that measures it.
fn listing(all: &[Profile], lacks: &[Option<String>]) -> String {
    let mut rows = vec![["profile", "at most", "command"].map(str::to_owned).to_vec()];
    let mut left = Duration::ZERO;
    for (profile, lack) in all.iter().zip(lacks) {
        left += if lack.is_some() { profile.time } else { Duration::ZERO };
        let simd = profile.simd.map_or(String::new(), |level| format!("SAPWISE_SIMD={level} "));
        let time = lack.as_ref().map_or("complete".to_owned(), |_| HumanDuration(profile.time).to_string());
        rows.push(vec![profile.name.clone(), time, format!("{simd}sapwise {}", profile.command)]);
    }
    format!("{}\n{} profiles, {} at most", columns(&rows), all.len(), HumanDuration(left))
}

/// The folder of the reports, with the machine and the algorithms that they must match.
struct Folder {
    path: PathBuf,
    physical_id: String,
    registry: Registry,
}

impl Folder {
    fn report_of(&self, profile: &Profile) -> PathBuf {
        self.path.join(format!("{}.json", profile.name))
    }

    /// Returns why a profile has to be measured; `None` when the folder holds a good report of it.
    ///
    /// # Errors
    /// When its file is no report, or one of another machine or another command: that is never replaced.
    fn lack(&self, profile: &Profile) -> anyhow::Result<Option<String>> {
        let path = self.report_of(profile);
        if !path.exists() {
            return Ok(Some("it was not measured yet".to_owned()));
        }
        let elsewhere = "move it, or name another folder with --out";
        let (_, report) = read_report(&path, &output::warn).context(elsewhere)?;
        let (provenance, hardware) = (&report.provenance, &report.hardware);
        if hardware.machine.physical_id != self.physical_id {
            bail!("{} is of another machine; {elsewhere}", path.display());
        }
        let gpus_differ = !hardware.gpus.iter().map(|g| &g.gpu).eq(&profile.gpus);
        if provenance.command != profile.command || provenance.simd != profile.simd_text() || gpus_differ {
            bail!("{} was measured by another command or with other GPUs; {elsewhere}", path.display());
        }
        Ok(flaw(&report, &self.registry))
    }

    /// Measures a profile and returns the flaw of its report, if any. `before` is the time of the finished profiles.
    ///
    /// # Errors
    /// When no process can be started, and on Ctrl-C.
    fn measure(&self, profile: &Profile, before: Duration, progress: &Progress) -> anyhow::Result<Option<String>> {
        let mut arguments: Vec<OsString> = profile.command.split(' ').map(OsString::from).collect();
        arguments.extend(["--leashed".into(), "--out".into(), self.report_of(profile).into()]);
        let variables = profile.simd_text().map(|level| ("SAPWISE_SIMD", level));
        let began = Instant::now();
        let ended = run_verb(&arguments, variables.as_slice(), LIMIT, &mut || {
            progress.position((before + began.elapsed().min(profile.time)).as_secs());
        })?;
        match ended {
            // It ends well when Ctrl-C came too late for it.
            Ended::Well => Ok(self.lack(profile).unwrap_or_else(|error| Some(format!("{error:#}")))),
            Ended::Badly(how) => Ok(Some(format!("its process {how}"))),
            Ended::Interrupted => bail!(
                "interrupted: the complete profiles are in {}; the same command continues with the others",
                self.path.display()
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_lab::report::{Label, Report};

    fn full(words: &str) -> Profile {
        let probe = Probe::of(&format!("--profiles --no-gpus {words}"));
        profiles(&probe, 1, SimdLevel::Portable, &[]).swap_remove(0)
    }

    #[test]
    fn a_report_with_a_flaw_is_measured_again_and_one_of_another_command_stays() {
        let text = include_str!("../../../crates/lab/tests/fixtures/report-3-gpu.json");
        let mut report: Report = sapwise_lab::report::read(text).unwrap().value;
        // Revisions change with the algorithms.
        report.algorithms.clear();
        report.points.iter_mut().for_each(|p| p.timings.clear());
        report.hardware.gpus.clear();
        report.hardware.gpu_groups.clear();
        report.label = Label::RealFull;
        report.remarks.clear();
        report.provenance.simd = None;
        report.provenance.optimised = true;
        report.provenance.command = full("").command;
        let folder = tempfile::tempdir().unwrap();
        let folder = Folder {
            path: folder.path().to_owned(),
            physical_id: report.hardware.machine.physical_id.clone(),
            registry: Registry::with_cores(1),
        };
        std::fs::create_dir_all(&folder.path).unwrap();
        let lack = |words: &str, change: &dyn Fn(&mut Report)| {
            let mut report = report.clone();
            change(&mut report);
            std::fs::write(folder.path.join("full.json"), sapwise_lab::report::write(&report).unwrap()).unwrap();
            folder.lack(&full(words)).map_err(|e| format!("{e:#}"))
        };
        assert_eq!(lack("", &|_| ()), Ok(None));
        let disturbed = lack("", &|r| r.label = Label::RealContended);
        assert_eq!(disturbed, Ok(Some("other programs disturbed it".to_owned())));
        for remark in ["interrupted", "clustered is incomplete: its process crashed", "WRONG ANSWER: sap@cpu1"] {
            assert!(lack("", &|r| r.remarks.push(remark.to_owned())).unwrap().is_some(), "{remark}");
        }
        assert!(lack("--seed=2", &|_| ()).unwrap_err().contains("another command"));
        let elsewhere = lack("", &|r| r.hardware.machine.physical_id = "1".repeat(16));
        assert!(elsewhere.unwrap_err().contains("another machine"));
    }
}
