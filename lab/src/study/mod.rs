//! The study of Section 6 of the paper, from any set of reports: hardware against performance.

mod accuracy;
mod answer;
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
mod speed;

use crate::page::{self, Page, Section, Source};
use crate::train::{Importance, Profile, Trained};
use accuracy::Measured;
use anyhow::Result;
use folder::Folder;
use influence::Influence;
use sapwise::Report;
use std::path::Path;

pub(crate) use answer::{Answer, Read};
pub(crate) use curves::{Compared, keep};
pub(crate) use entry::{Entry, names, representatives};
pub(crate) use folder::{PAGE, prepare};

/// What was read and fitted.
pub(crate) struct Study {
    pub(crate) entries: Vec<Entry>,
    /// Those that are set beside the reference, by position.
    pub(crate) wanted: Vec<usize>,
    /// The machine that others are held against.
    pub(crate) reference: Option<usize>,
    /// The profiles that were trained on.
    pub(crate) profiles: Vec<Profile>,
    /// Notes of the selection, the training and the importance.
    pub(crate) notes: Vec<String>,
    /// None where no report can be trained on, with the reason.
    pub(crate) trained: Result<Trained, String>,
    pub(crate) importance: Result<Importance, String>,
    /// The whole reports of the entries that are drawn.
    pub(crate) drawn: Vec<(Compared, Vec<(usize, Report)>)>,
    /// The measured borders of reports that were left out in turn, with their intervals.
    pub(crate) borders: Measured,
    /// The command, for captions.
    pub(crate) command: String,
}

impl Study {
    /// Writes the page and everything beside it; gives what it says.
    ///
    /// # Errors
    /// When a figure can't be drawn or a file not be written.
    pub(crate) fn write(&self, to: &Path) -> Result<Answer> {
        let labels: Vec<String> = (1..=self.entries.len()).map(|k| format!("R{k}")).collect();
        let mut folder = Folder::new(labels.clone(), self.command.clone());
        let influence = Influence::new(&self.entries, self.importance.as_ref().ok());
        let claims = claims::claims(&self.entries, &influence);
        let mut missing = Vec::new();
        let sections: Vec<Section> = sections::all(self, &influence, &claims, &mut folder, &mut missing)?;
        let source = |(label, entry): (&String, &Entry)| Source {
            label: label.clone(),
            file: entry.file.clone(),
            note: sections::note(entry),
        };
        let validation = self.trained.as_ref().ok().map(|t| &t.model.validation);
        let answer = Answer {
            command: self.command.clone(),
            reports: labels.iter().zip(&self.entries).map(|(label, entry)| read(label, entry)).collect(),
            physical_machines: influence.machines,
            claims: claims.iter().map(answer::Decided::new).collect(),
            mean_regret: validation.and_then(|v| v.methods.first()).map(|m| m.mean_regret),
            held_out: validation.map(|v| v.held_out.clone()).unwrap_or_default(),
            missing,
            ..Answer::default()
        };
        let page = Page {
            title: "Hardware against broad-phase performance".to_owned(),
            lead: sections::lead(self, &influence),
            command: self.command.clone(),
            reports: labels.iter().zip(&self.entries).map(source).collect(),
            sections,
        };
        folder.write(to, &page::html(&page), answer)
    }

    /// Positions of the reports whose timings are studied.
    fn studied(&self) -> Vec<usize> {
        (0..self.entries.len()).filter(|&k| self.entries[k].studied.is_ok()).collect()
    }
}

fn read(label: &str, entry: &Entry) -> Read {
    Read {
        label: label.to_owned(),
        file: entry.file.clone(),
        kind: crate::label_text::kind(entry.kind).to_owned(),
        left_out: entry.studied.clone().err(),
    }
}
