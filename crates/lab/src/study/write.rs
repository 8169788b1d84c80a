//! A study as a folder: the page and everything beside it.

use super::claims;
use super::entry::Entry;
use super::folder::Folder;
use super::influence::Influence;
use super::material::Study;
use super::sections;
use super::summary::{StudiedReport, StudyClaim, Summary};
use super::timings;
use crate::page::{self, Page, Section, Source};
use crate::progress::Progress;
use anyhow::Result;
use std::path::Path;

impl Study {
    /// Writes the page and everything beside it into a folder that [`prepare`](super::prepare) has seen, and returns what `study.json` says.
    ///
    /// # Errors
    /// When a figure can't be drawn or a file not be written, and when the user asked to stop. An earlier study is as it was then.
    pub fn write(&self, to: &Path, progress: &dyn Progress) -> Result<Summary> {
        let labels: Vec<String> = (1..=self.entries.len()).map(|k| format!("R{k}")).collect();
        let mut folder = Folder::new(labels.clone(), self.command.clone(), progress);
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
}
