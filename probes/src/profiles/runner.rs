//! The measurement of one profile after the other.

use super::profile::Profile;
use super::resume::{Existing, numbers};
use crate::child::{Ended, run_verb};
use crate::destination::UNFINISHED;
use crate::progress::Progress;
use crate::{gpus, interrupt, output, shell};
use anyhow::bail;
use indicatif::HumanDuration;
use sapwise_lab::Report;
use sapwise_lab::data::Document;
use sapwise_lab::data::read_document;
use sapwise_lab::text::columns;
use sapwise_scenes::Scenario;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A probe ends by itself long before this; a process that does not hangs in a driver.
const LIMIT: Duration = Duration::from_secs(3600);

/// The state of a profile.
#[derive(Debug, Clone, PartialEq)]
enum State {
    /// Its turn has not come.
    Waiting,
    /// Its report was there.
    Found(PathBuf),
    /// It was measured, in this time.
    Measured { path: PathBuf, time: Duration },
    /// It went wrong. A report that proves too little or was disturbed is there all the same.
    Failed(String, Option<PathBuf>),
}

/// How it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    Complete,
    Interrupted,
}

/// Measures a family.
pub(super) struct ProfileRunner<'a> {
    family: &'a [Profile],
    states: Vec<State>,
    existing: &'a Existing<'a>,
    /// The most that each should take.
    times: Vec<Duration>,
}

impl<'a> ProfileRunner<'a> {
    /// `done` holds the reports that are there, in the order of the family.
    pub(super) fn new(
        family: &'a [Profile],
        done: Vec<Option<PathBuf>>,
        existing: &'a Existing<'a>,
        scenarios: &[Scenario],
    ) -> Self {
        let states = done.into_iter().map(|path| path.map_or(State::Waiting, State::Found)).collect();
        let times = family.iter().map(|p| p.time(scenarios, existing.family.max_objects)).collect();
        Self { family, states, existing, times }
    }

    /// Measures every profile that waits.
    ///
    /// # Errors
    /// When no process can be started.
    pub(super) fn run(&mut self) -> anyhow::Result<End> {
        // Those that are there take no time: counted as done, they would make the others seem fast.
        let waiting = (0..self.family.len()).filter(|&k| self.states[k] == State::Waiting);
        let progress = Progress::new(waiting.map(|k| self.times[k].as_secs()).sum());
        let mut before = Duration::ZERO;
        for k in 0..self.family.len() {
            if self.states[k] == State::Waiting {
                if interrupt::requested() {
                    return Ok(End::Interrupted);
                }
                let Some(state) = self.measure(k, before, &progress)? else { return Ok(End::Interrupted) };
                before += self.times[k];
                progress.position(before.as_secs());
                if let State::Failed(why, _) = &state {
                    progress.aside(|| output::complain(&format!("{}: FAILED: {why}", self.family[k].name)));
                }
                self.states[k] = state;
            }
        }
        Ok(End::Complete)
    }

    /// Measures a profile, where those before it should have taken so long. `None` when the user interrupted it.
    fn measure(&self, k: usize, before: Duration, progress: &Progress) -> anyhow::Result<Option<State>> {
        let profile = &self.family[k];
        let failed = |why: String| Ok(Some(State::Failed(why, None)));
        let path = self.existing.path(profile);
        if let Some(why) = self.existing.obstacle(&path, profile) {
            return failed(why);
        }
        let now = if profile.gpus.is_empty() { Vec::new() } else { gpus::look()?.identities };
        let numbers = match numbers(&profile.gpus, &now) {
            Ok(numbers) => numbers,
            Err(why) => return failed(why),
        };
        // Under its own name it is not there before it is complete.
        let unfinished = path.with_added_extension(UNFINISHED);
        let mut arguments = profile.arguments(self.existing.family, &numbers);
        arguments.push("--leashed".to_owned());
        for kind in profile.kinds() {
            if let Some(reference) = self.report_of(&profile.lifted(kind)) {
                arguments.push(format!("--unrestricted={kind}={}", text(reference)?));
            }
        }
        arguments.push(format!("--out={}", text(&unfinished)?));
        let began = Instant::now();
        let count = self.family.len();
        let ended = run_verb(&arguments, &profile.variables(), LIMIT, &mut || {
            progress.message(format!("{} of {count}: {}", k + 1, profile.name));
            progress.position((before + began.elapsed().min(self.times[k])).as_secs());
        })?;
        match ended {
            Ended::Interrupted => return Ok(None),
            Ended::Badly(how) => {
                let kept = if unfinished.exists() {
                    format!("; {} is what it left", unfinished.display())
                } else {
                    String::new()
                };
                return failed(format!("its process {how}{kept}"));
            }
            // It ends well where Ctrl-C came too late for it.
            Ended::Well => {}
        }
        let report = match read(&unfinished) {
            Ok(report) => report,
            Err(error) => return failed(format!("{error:#}")),
        };
        if let Err(error) = std::fs::rename(&unfinished, &path) {
            return failed(format!("{} can't be renamed: {error}", unfinished.display()));
        }
        Ok(Some(match self.existing.lack(&report, profile) {
            Some(lack) => State::Failed(lack, Some(path)),
            None => State::Measured { path, time: began.elapsed() },
        }))
    }

    /// The report of whichever profile takes the same from the machine, where there is one.
    fn report_of(&self, profile: &Profile) -> Option<&Path> {
        let k = self.family.iter().position(|p| p.is_alike(profile))?;
        match &self.states[k] {
            State::Found(path) | State::Measured { path, .. } | State::Failed(_, Some(path)) => Some(path),
            State::Waiting | State::Failed(_, None) => None,
        }
    }

    /// Whether any profile has failed.
    pub(super) fn failed(&self) -> bool {
        self.states.iter().any(|s| matches!(s, State::Failed(..)))
    }

    /// The state of each profile.
    pub(super) fn summary(&self) -> String {
        let mut rows = vec![["profile", "report", ""].map(str::to_owned).to_vec()];
        for (profile, state) in self.family.iter().zip(&self.states) {
            let shown = |path: &Path| path.display().to_string();
            let (report, remark) = match state {
                State::Waiting => ("-".to_owned(), "not measured yet".to_owned()),
                State::Found(path) => (shown(path), "was complete".to_owned()),
                State::Measured { path, time } => (shown(path), format!("measured in {}", HumanDuration(*time))),
                State::Failed(why, path) => (path.as_deref().map_or("-".to_owned(), shown), format!("FAILED: {why}")),
            };
            rows.push(vec![profile.name.clone(), report, remark]);
        }
        let failed = self.states.iter().filter(|s| matches!(s, State::Failed(..))).count();
        let waiting = self.states.iter().filter(|s| **s == State::Waiting).count();
        let good = self.states.len() - failed - waiting;
        let mut text = format!("{}\n{good} of {} profiles are complete", columns(&rows), self.states.len());
        if failed > 0 {
            text += &format!(", {failed} failed; the same command measures those again");
        }
        if good == self.states.len() {
            text += &format!(".\nNext: sapwise train {} --out model.json", shell::path(self.existing.folder));
        }
        text
    }
}

fn read(path: &Path) -> anyhow::Result<Report> {
    match read_document(path, &output::warn)? {
        Document::Report(report) => Ok(*report),
        _ => bail!("{} is no report", path.display()),
    }
}

/// A path as an argument.
fn text(path: &Path) -> anyhow::Result<&str> {
    let shown =
        || format!("{} holds characters that can't be handed on; name another folder with --out", path.display());
    path.to_str().ok_or_else(|| anyhow::anyhow!(shown()))
}
