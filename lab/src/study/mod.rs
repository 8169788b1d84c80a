//! The study of Section 6 of Avril, Gouranton and Arnaldi (ISVRI 2011), from any set of reports: hardware against performance.

mod accuracy;
mod claims;
mod curves;
mod entry;
mod folder;
mod hardware;
mod influence;
mod map;
mod rank;
mod ratios;
mod restrictions;
mod sections;
mod side_crossovers;
mod sources;
mod speed;
mod summary;
mod timings;

use crate::Report;
use crate::data::{Evidence, Profile, read_report};
use crate::evaluate::{HeldOut, Importance, importance};
use crate::fit::measured_tuning;
use crate::page::{self, Page, Section, Source};
use crate::progress::Progress;
use crate::train::{Trained, train};
use accuracy::Measured;
use anyhow::Result;
use curves::Compared;
use entry::{Entry, representatives};
use folder::Folder;
use influence::Influence;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;

pub use folder::{PAGE, prepare};
pub use sources::{NotAmongReports, Sources};
pub use summary::{StudiedReport, StudyClaim, StudyFile, Summary};

/// What was read and fitted.
#[derive(Debug)]
pub struct Study {
    entries: Vec<Entry>,
    /// Those that are compared with the reference, by position.
    wanted: Vec<usize>,
    /// The report that others are compared with.
    reference: Option<usize>,
    /// The profiles that were trained on.
    profiles: Vec<Profile>,
    /// Notes of the selection, the training and the importance.
    notes: Vec<String>,
    /// None where no report can be trained on, with the reason.
    trained: Result<Trained, String>,
    importance: Result<Importance, String>,
    /// The whole reports of the entries that are drawn.
    drawn: Vec<(Compared, Vec<(usize, Report)>)>,
    /// The measured borders of reports that were held out in turn, with their intervals.
    borders: Measured,
    /// Names of the files that can't be read, and why.
    unreadable: Vec<(String, String)>,
    /// The command, for captions.
    command: String,
}

impl Study {
    /// Reads reports, trains and validates a model of them. `command` makes the study again; captions and the page tell it.
    ///
    /// # Errors
    /// When none of the reports can be read; when the user asked to stop.
    pub fn of(sources: &Sources, evidence: Evidence, command: String, progress: &dyn Progress) -> Result<Self> {
        let sources::Read { mut entries, selection, unreadable } = sources.read(evidence, progress)?;
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
            let drawn = drawn.into_iter().map(|k| Ok((k, read_report(&entries[k].path, &|_| ())?.1))).collect::<Result<_>>();
            progress.advance(1);
            Ok((compared, drawn?))
        };
        let drawn = Compared::ALL.into_iter().map(draw).collect::<Result<_>>()?;
        progress.message("borders of what was held out");
        let borders = trained.as_ref().map(|t| measured_borders(&t.held_out, &entries)).unwrap_or_default();
        progress.advance(1);
        let wanted = if asked.is_empty() { representatives(&entries) } else { asked };
        Ok(Self { entries, wanted, reference, profiles, notes, trained, importance, drawn, borders, unreadable, command })
    }

    /// Names of the files that can't be read, and why.
    #[must_use]
    pub fn unreadable(&self) -> &[(String, String)] {
        &self.unreadable
    }

    /// Writes the page and everything beside it into a folder that [`prepare`] has seen, and returns what `study.json` says.
    ///
    /// # Errors
    /// When a figure can't be drawn or a file not be written.
    pub fn write(&self, to: &Path) -> Result<Summary> {
        let labels: Vec<String> = (1..=self.entries.len()).map(|k| format!("R{k}")).collect();
        let mut folder = Folder::new(labels.clone(), self.command.clone());
        let influence = Influence::new(&self.entries, self.importance.as_ref().ok());
        let claims = claims::claims(&self.entries, &influence);
        let mut missing = Vec::new();
        let sections: Vec<Section> = sections::all(self, &influence, &claims, &mut folder, &mut missing)?;
        timings::write(&self.entries, &mut folder)?;
        let source = |(label, entry): (&String, &Entry)| Source {
            label: label.clone(),
            file: entry.file.clone(),
            note: sections::note(entry),
        };
        let validation = self.trained.as_ref().ok().map(|t| &t.training.validation);
        let summary = Summary {
            command: self.command.clone(),
            reports: labels.iter().zip(&self.entries).map(|(label, entry)| StudiedReport::new(label, entry)).collect(),
            physical_machines: influence.machines,
            can_say: sections::can_say(self, &influence),
            claims: claims.iter().map(StudyClaim::new).collect(),
            held_out: validation.map(|v| v.held_out.clone()).unwrap_or_default(),
            strategies: validation.map(|v| v.methods.clone()).unwrap_or_default(),
            missing,
            ..Summary::default()
        };
        let page = Page {
            title: "Hardware against broad-phase performance".to_owned(),
            lead: sections::lead(self, &influence),
            command: self.command.clone(),
            reports: labels.iter().zip(&self.entries).map(source).collect(),
            sections,
        };
        folder.write(to, &page::html(&page), summary)
    }

    /// Positions of the reports whose timings are studied.
    fn studied(&self) -> Vec<usize> {
        (0..self.entries.len()).filter(|&k| self.entries[k].studied.is_ok()).collect()
    }
}

/// The measured borders, with intervals, of every report that was held out in turn.
fn measured_borders(held_out: &HeldOut, entries: &[Entry]) -> Measured {
    let files: BTreeSet<&str> = held_out.crossovers.iter().map(|b| b.file.as_str()).collect();
    let own: Vec<&Entry> = entries.iter().filter(|e| files.contains(e.file.as_str())).collect();
    let borders = |entry: &&Entry| {
        let mut report = read_report(&entry.path, &|_| ()).ok()?.1;
        curves::keep(&mut report, |id| entry.profile.position(id).is_some());
        let tuning = measured_tuning(&report, crate::data::usual_scenario(&report)).ok()?;
        Some((entry.file.clone(), tuning.crossovers))
    };
    own.par_iter().filter_map(borders).collect()
}
