//! Where a report goes, checked before the minutes of measuring, with a way out when it fails after them.

use crate::output;
use crate::outputs::check_writable;
use anyhow::Context;
use sapwise_lab::report::Report;
use std::cell::Cell;
use std::fs;
use std::path::{Path, PathBuf};

/// Where the report goes without `--out`.
const DEFAULT: &str = "report.json";

/// What is added to the name of a report that is being measured.
pub(crate) const UNFINISHED: &str = "unfinished";

/// The file of a report.
pub(crate) struct Destination {
    path: PathBuf,
    /// Where the report is until it is finished: what stands under its name may be hours of measuring, and stays until then.
    unfinished: PathBuf,
    /// Whether this program has written that.
    wrote_unfinished: Cell<bool>,
}

impl Destination {
    /// The file that the user named, or the default, after a try whether its folder takes a file.
    ///
    /// # Errors
    /// When the folder takes none, or the path is a folder itself.
    pub(crate) fn new(path: Option<&Path>) -> anyhow::Result<Self> {
        let path = path.unwrap_or(Path::new(DEFAULT)).to_path_buf();
        check_writable(&path).context("name another file with --out")?;
        let unfinished = match path.extension() {
            Some(extension) if extension == UNFINISHED => path.clone(),
            _ => path.with_added_extension(UNFINISHED),
        };
        Ok(Self { path, unfinished, wrote_unfinished: Cell::new(false) })
    }

    /// Writes the report as it is by now beside its place, so that even a power cut costs one scenario only.
    pub(crate) fn save_unfinished(&self, report: &Report) {
        // Into a pipe or a device goes one report.
        if self.path.exists() && !self.path.is_file() {
            return;
        }
        match write(&self.unfinished, report) {
            Ok(()) => self.wrote_unfinished.set(true),
            Err(error) => output::warn(&format!("{error:#}; the measurement continues")),
        }
    }

    /// Writes the report of a measurement that was interrupted. What stands under its name already may be hours of measuring, and stays: then it goes beside it.
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

    /// Writes the finished report, in the folder for temporary files when its own path fails.
    ///
    /// # Errors
    /// When it is not where it was wanted. The message says where it is.
    pub(crate) fn save(&self, report: &Report) -> anyhow::Result<&Path> {
        let Err(error) = write(&self.path, report) else {
            if self.wrote_unfinished.get() && self.unfinished != self.path {
                // Whoever can't remove it has the whole report all the same.
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
