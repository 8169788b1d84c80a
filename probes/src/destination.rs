//! The file of a report: checked before the minutes of measuring, with a second place if writing fails after them.

use crate::output;
use crate::outputs::check_writable;
use anyhow::Context;
use sapwise_lab::report::Report;
use std::cell::Cell;
use std::fs;
use std::path::{Path, PathBuf};

/// The file of the report without `--out`.
const DEFAULT: &str = "report.json";

/// The extension of a report that is being measured.
pub(crate) const UNFINISHED: &str = "unfinished";

/// The file of a report.
pub(crate) struct Destination {
    path: PathBuf,
    /// The file of the unfinished report: the one at `path` may hold hours of measuring, and stays until the end.
    unfinished: PathBuf,
    /// Whether this program wrote the unfinished report.
    wrote_unfinished: Cell<bool>,
}

impl Destination {
    /// Takes the file that the user named, or the default, and tries whether its folder takes a file.
    ///
    /// # Errors
    /// When the folder takes none, or the path is a folder itself.
    pub(crate) fn new(path: Option<&Path>) -> anyhow::Result<Self> {
        let named = path.is_some();
        let path = path.unwrap_or(Path::new(DEFAULT)).to_path_buf();
        let writable = check_writable(&path);
        // Who named no file has to hear of the option.
        if named { writable } else { writable.context("name a file with --out") }?;
        let unfinished = match path.extension() {
            Some(extension) if extension == UNFINISHED => path.clone(),
            _ => path.with_added_extension(UNFINISHED),
        };
        Ok(Self { path, unfinished, wrote_unfinished: Cell::new(false) })
    }

    /// Writes the report as it is now to the unfinished file, so that a power cut costs one scenario.
    pub(crate) fn save_unfinished(&self, report: &Report) {
        // A pipe or a device takes one report, the last.
        if self.path.exists() && !self.path.is_file() {
            return;
        }
        match write(&self.unfinished, report) {
            Ok(()) => self.wrote_unfinished.set(true),
            Err(error) => output::warn(&format!("{error:#}; the measurement continues")),
        }
    }

    /// Writes the report of an interrupted measurement: to the unfinished file if there is a report already, which
    /// stays.
    ///
    /// # Errors
    /// As [`save`](Self::save).
    pub(crate) fn save_interrupted(&self, report: &Report) -> anyhow::Result<&Path> {
        if !self.path.is_file() || self.unfinished == self.path {
            return self.save(report);
        }
        write(&self.unfinished, report)?;
        Ok(&self.unfinished)
    }

    /// Writes the finished report, to the folder for temporary files if its own path fails.
    ///
    /// # Errors
    /// When its own path fails. The message says where the report is.
    pub(crate) fn save(&self, report: &Report) -> anyhow::Result<&Path> {
        let Err(error) = write(&self.path, report) else {
            if self.wrote_unfinished.get() && self.unfinished != self.path {
                // If this fails the whole report is written all the same.
                let _ = fs::remove_file(&self.unfinished);
            }
            return Ok(&self.path);
        };
        let other = std::env::temp_dir().join(format!("sapwise-report-{}.json", std::process::id()));
        match write(&other, report) {
            Ok(()) => Err(error.context(format!("the report is in {} instead", other.display()))),
            Err(second) => Err(error.context(format!("the report is lost; {second:#}"))),
        }
    }
}

fn write(path: &Path, report: &Report) -> anyhow::Result<()> {
    let text = sapwise_lab::report::write(report)?;
    sapwise_lab::write::write_text(path, &text)
}
