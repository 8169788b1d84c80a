//! What a study reads, and the model that it fits to it.

use super::accuracy::Measured;
use super::curves::{self, Compared};
use super::entry::{Entry, representatives};
use super::sources::{self, Sources};
use crate::Report;
use crate::data::{Profile, read_report, usual_scenario};
use crate::evaluate::{HeldOut, Importance, importance};
use crate::fit::measured_tuning;
use crate::progress::Progress;
use crate::train::{Trained, train};
use anyhow::Result;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// What was read and fitted.
#[derive(Debug)]
pub struct Study {
    pub(super) entries: Vec<Entry>,
    /// Those that are compared with the reference, by position.
    pub(super) wanted: Vec<usize>,
    /// The report that others are compared with.
    pub(super) reference: Option<usize>,
    /// The profiles that were trained on.
    pub(super) profiles: Vec<Profile>,
    /// Notes of the selection, the training and the importance.
    pub(super) notes: Vec<String>,
    /// None where no report can be trained on, with the reason.
    pub(super) trained: Result<Trained, String>,
    pub(super) importance: Result<Importance, String>,
    /// The whole reports of the entries that are drawn.
    pub(super) drawn: Vec<(Compared, Vec<(usize, Report)>)>,
    /// The measured crossovers of reports that were held out in turn, with their intervals.
    pub(super) crossovers: Measured,
    /// Names of the files that can't be read, and why.
    unreadable: Vec<(String, String)>,
    /// The command, for captions.
    pub(super) command: String,
}

impl Study {
    /// Reads reports, trains and validates a model of them. `command` makes the study again; captions and the page tell it.
    ///
    /// # Errors
    /// When none of the reports can be read; when the user asked to stop.
    pub fn of(sources: &Sources, command: String, progress: &dyn Progress) -> Result<Self> {
        let sources::Read { mut entries, selection, unreadable } = sources.read(progress)?;
        let (profiles, mut notes) = selection.clone().finish();
        sources::mark_studied(&mut entries, &profiles, &notes);
        let importance = match profiles.is_empty() {
            true => Err("no report can be studied".to_owned()),
            false => importance(&profiles, progress).map_err(|why| format!("{why:#}")),
        };
        let trained = train(selection, "study", progress).map_err(|why| format!("{why:#}"));
        progress.check()?;
        if let Ok(trained) = &trained {
            notes.clone_from(&trained.notes);
        }
        notes.extend(unreadable.iter().map(|(name, why)| format!("{name} could not be read: {why}")));
        // By the file, since what could not be read is no entry.
        let at = |file: &std::path::PathBuf| entries.iter().position(|e| e.path == *file);
        let asked: Vec<usize> = sources.machines.iter().filter_map(at).collect();
        let studied = || (0..entries.len()).filter(|&k| entries[k].studied.is_ok());
        let wanted: Vec<usize> = if asked.is_empty() { studied().collect() } else { asked.clone() };
        let reference = match &sources.reference {
            Some(file) => at(file),
            None => wanted.iter().copied().find(|&k| entries[k].is_whole()).or(wanted.first().copied()),
        };
        progress.start(Compared::ALL.len() as u64 + 1);
        progress.message("reading what is drawn");
        let draw = |compared: Compared| {
            let drawn = compared.drawn(&entries, &wanted);
            let drawn =
                drawn.into_iter().map(|k| Ok((k, read_report(&entries[k].path, &|_| ())?.1))).collect::<Result<_>>();
            progress.advance(1);
            Ok((compared, drawn?))
        };
        let drawn = Compared::ALL.into_iter().map(draw).collect::<Result<_>>()?;
        progress.message("crossovers of what was held out");
        let crossovers = trained.as_ref().map(|t| measured_crossovers(&t.held_out, &entries)).unwrap_or_default();
        progress.advance(1);
        let wanted = if asked.is_empty() { representatives(&entries) } else { asked };
        Ok(Self {
            entries,
            wanted,
            reference,
            profiles,
            notes,
            trained,
            importance,
            drawn,
            crossovers,
            unreadable,
            command,
        })
    }

    /// Names of the files that can't be read, and why.
    #[must_use]
    pub fn unreadable(&self) -> &[(String, String)] {
        &self.unreadable
    }

    /// Positions of the reports whose timings are studied.
    pub(super) fn studied(&self) -> Vec<usize> {
        (0..self.entries.len()).filter(|&k| self.entries[k].studied.is_ok()).collect()
    }
}

/// The measured crossovers, with intervals, of every report that was held out in turn.
fn measured_crossovers(held_out: &HeldOut, entries: &[Entry]) -> Measured {
    let files: BTreeSet<&str> = held_out.crossovers.iter().map(|b| b.file.as_str()).collect();
    let own: Vec<&Entry> = entries.iter().filter(|e| files.contains(e.file.as_str())).collect();
    let crossovers = |entry: &&Entry| {
        let mut report = read_report(&entry.path, &|_| ()).ok()?.1;
        curves::keep(&mut report, |id| entry.profile.position(id).is_some());
        let tuning = measured_tuning(&report, usual_scenario(&report), None).ok()?;
        Some((entry.file.clone(), tuning.crossovers))
    };
    own.par_iter().filter_map(crossovers).collect()
}
