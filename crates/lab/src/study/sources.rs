//! The files of a study: read, reduced and told apart.

use super::entry::{Entry, names};
use crate::data::{Profile, Selection, read_report, report_files};
use crate::progress::Progress;
use anyhow::{Result, bail};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Reports that are in memory at the same time: a full one has a megabyte.
const AT_A_TIME: usize = 64;

/// Which files are studied, and which of them are drawn.
#[derive(Debug, Clone)]
pub struct Sources {
    pub(super) files: Vec<PathBuf>,
    /// What the page calls them: no paths of the machine that reads them.
    pub(super) names: Vec<String>,
    /// The report that others are compared with; `None` takes the first of a whole machine.
    pub(super) reference: Option<PathBuf>,
    /// The reports to draw; empty takes of each machine the one that has most of it.
    pub(super) machines: Vec<PathBuf>,
}

/// A report was named that is not among the reports to study.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{} is not among the reports", path.display())]
#[non_exhaustive]
pub struct NotAmongReports {
    /// The report.
    pub path: PathBuf,
}

/// What was read of the reports.
pub(super) struct Read {
    pub(super) entries: Vec<Entry>,
    pub(super) selection: Selection,
    /// Names of the others, and why.
    pub(super) unreadable: Vec<(String, String)>,
}

impl Sources {
    /// The reports of files and folders, each once, with the one that others are compared with and those to draw, where they are named.
    ///
    /// # Errors
    /// When a folder can't be read or holds no report; [`NotAmongReports`] when the reference or a report to draw is not among them.
    pub fn new(reports: &[PathBuf], reference: Option<&Path>, machines: &[PathBuf]) -> Result<Self> {
        let mut seen = BTreeSet::new();
        let mut files = report_files(reports)?;
        files.retain(|f| seen.insert(canonical(f)));
        let found = |path: &Path| match files.iter().find(|f| *f == path || canonical(f) == canonical(path)) {
            Some(file) => Ok(file.clone()),
            None => Err(NotAmongReports { path: path.to_owned() }),
        };
        let reference = reference.map(found).transpose()?;
        let machines = machines.iter().map(|path| found(path)).collect::<Result<_, _>>()?;
        Ok(Self { names: names(&files), files, reference, machines })
    }

    /// Reads all reports on all cores, some at a time.
    ///
    /// # Errors
    /// When none of them can be read; when the user asked to stop.
    pub(super) fn read(&self, progress: &dyn Progress) -> Result<Read> {
        let Self { files, names, .. } = self;
        progress.start(files.len() as u64);
        progress.message("reading");
        let mut found = Read { entries: Vec::new(), selection: Selection::default(), unreadable: Vec::new() };
        let placed: Vec<(usize, &PathBuf)> = files.iter().enumerate().collect();
        for some in placed.chunks(AT_A_TIME) {
            progress.check()?;
            let read = |&(place, file): &(usize, &PathBuf)| match read_report(file, &|text| progress.warn(text)) {
                // By the name that the page has, which is no path of this machine.
                Err(why) => {
                    (place, Err(why.root_cause().to_string().replace(&file.display().to_string(), &names[place])))
                }
                Ok((_, report)) => {
                    let reduced = Selection::reduce(&names[place], &report);
                    let studied = reduced.as_ref().map(|_| ()).map_err(ToString::to_string);
                    (place, Ok((Entry::new(file, &names[place], report, studied), reduced)))
                }
            };
            let all: Vec<_> = some.par_iter().map(read).collect();
            for (place, read) in all {
                match read {
                    Err(why) => found.unreadable.push((names[place].clone(), why)),
                    Ok((entry, reduced)) => {
                        found.entries.push(entry);
                        found.selection.add(reduced);
                    }
                }
            }
            progress.advance(some.len() as u64);
        }
        if found.entries.is_empty() {
            let (name, why) = &found.unreadable[0];
            bail!("none of {} files is a report that can be read; {name}: {why}", files.len());
        }
        Ok(found)
    }
}

fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// Marks the entries whose timings are left out, with the reason that the selection gave.
pub(super) fn mark_studied(entries: &mut [Entry], profiles: &[Profile], notes: &[String]) {
    let kept: BTreeSet<&str> = profiles.iter().map(|p| p.file.as_str()).collect();
    for profile in profiles {
        // Without timings of stale revisions: another algorithm under the same name is no other machine.
        entries.iter_mut().filter(|e| e.file == profile.file).for_each(|e| e.profile = profile.clone());
    }
    for entry in entries.iter_mut().filter(|e| !kept.contains(e.file.as_str())) {
        let beginning = format!("{} is left out: ", entry.file);
        let why = notes.iter().find_map(|n| n.strip_prefix(&beginning));
        entry.studied = Err(why.unwrap_or("none of its timings can be used").to_owned());
    }
}
