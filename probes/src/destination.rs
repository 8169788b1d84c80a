//! Where a report goes, checked before the minutes of measuring, with a way out when it fails after them.

use crate::output;
use crate::outputs::check_writable;
use anyhow::Context;
use sapwise_lab::report::Report;
use std::path::{Path, PathBuf};

/// Where the report goes without `--out`.
const DEFAULT: &str = "report.json";

/// The file of a report.
pub(crate) struct Destination(PathBuf);

impl Destination {
    /// The file that the user named, or the default, after a try whether its folder takes a file.
    ///
    /// # Errors
    /// When the folder takes none, or the path is a folder itself.
    pub(crate) fn new(path: Option<&Path>) -> anyhow::Result<Self> {
        let path = path.unwrap_or(Path::new(DEFAULT)).to_path_buf();
        check_writable(&path).context("name another file with --out")?;
        Ok(Self(path))
    }

    /// Writes the report as it is by now, so that even a power cut costs one scenario only.
    pub(crate) fn save_unfinished(&self, report: &Report) {
        if let Err(error) = write(&self.0, report) {
            output::warn(&format!("{error:#}; the measurement continues"));
        }
    }

    /// Writes the finished report, in the folder for temporary files when its own path fails.
    ///
    /// # Errors
    /// When it is not where it was wanted. The message says where it is.
    pub(crate) fn save(&self, report: &Report) -> anyhow::Result<&Path> {
        let Err(error) = write(&self.0, report) else { return Ok(&self.0) };
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
