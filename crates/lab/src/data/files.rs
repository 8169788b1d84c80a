//! Reading the files of Sapwise.

use crate::progress::Progress;
use crate::report::{self, Report};
use crate::training::{StoredModel, read_model_and_skipped};
use anyhow::{Context, bail};
use sapwise::Tuning;
use sapwise::json::{Format, Schema};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Files larger than this are refused before they fill the memory. A full report of a machine with 64 threads has 2 MB.
const LARGEST_BYTES: u64 = 64 << 20;

/// A file of Sapwise, whatever its schema.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Document {
    /// `report/2`.
    Report(Box<Report>),
    /// `model/3`.
    Model(Box<StoredModel>),
    /// `tuning/2`.
    Tuning(Box<Tuning>),
}

/// Reads a report, model or tuning file. `warn` gets a sentence where a newer version wrote keys that this one does not know.
///
/// # Errors
/// Names the file, and the line and column or the figure that is wrong.
pub fn read_document(path: &Path, warn: &dyn Fn(&str)) -> anyhow::Result<Document> {
    let text = read_text(path)?;
    let unsound = || format!("{} is no sound file", path.display());
    let schema = Schema::of(&text).with_context(unsound)?;
    let (document, skipped) = match schema.name() {
        "report" => {
            let read = report::read(&text).with_context(unsound)?;
            (Document::Report(Box::new(read.value)), read.skipped)
        }
        "model" => {
            let (model, skipped) = read_model_and_skipped(&text).with_context(unsound)?;
            (Document::Model(Box::new(model)), skipped)
        }
        // Under the older name the error says how to make it again.
        "tuning" | "fields" => {
            let read = Format::TUNING.read(&text).with_context(unsound)?;
            (Document::Tuning(Box::new(read.value)), read.skipped)
        }
        _ => bail!("{} has the schema {schema}, which is none of report/2, model/3 and tuning/2", path.display()),
    };
    if !skipped.is_empty() {
        warn(&ignored(path, &schema, &skipped));
    }
    Ok(document)
}

/// Which keys of a newer version are ignored. A key that stands in each of many points is told once.
fn ignored(path: &Path, schema: &Schema, skipped: &[String]) -> String {
    let keys: BTreeSet<String> = skipped.iter().map(|place| without_indices(place)).collect();
    let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
    format!(
        "{} is of {schema}, which a newer version of sapwise wrote; ignored, because this version does not know it: {}",
        path.display(),
        keys.join(", ")
    )
}

/// A place in a file for all elements of its lists: `points[].load.depth` for `points[3].load.depth`.
fn without_indices(place: &str) -> String {
    let mut parts = place.split('[');
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text.push('[');
        text.push_str(part.trim_start_matches(|c: char| c.is_ascii_digit()));
    }
    text
}

/// The reports with their file names, of files and of the `*.json` files of folders, in the order of their names.
///
/// # Errors
/// As [`report_files`], [`refuse_twice`] and [`read_report`]; when the user asked to stop.
pub fn read_reports(paths: &[PathBuf], progress: &dyn Progress) -> anyhow::Result<Vec<(String, Report)>> {
    let files = report_files(paths)?;
    refuse_twice(&files)?;
    progress.start(files.len() as u64);
    progress.message("reading");
    let read = |file: &PathBuf| {
        progress.check()?;
        let report = read_report(file, &|text| progress.warn(text));
        progress.advance(1);
        report
    };
    files.iter().map(read).collect()
}

/// Files, and the `*.json` files of folders, in the order of their names.
///
/// # Errors
/// When a folder can't be read or holds no such file.
pub fn report_files(paths: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files: Vec<PathBuf> = Vec::new();
    for path in paths {
        if path.is_dir() {
            let found = json_files(path)?;
            if found.is_empty() {
                bail!("the folder {} holds no *.json file; make one with `sapwise probe --out R.json`", path.display());
            }
            files.extend(found);
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
}

/// Refuses a file that is given twice, under whatever name: it agrees with itself, and would count for two measurements.
///
/// # Errors
/// Names the file.
pub fn refuse_twice(files: &[PathBuf]) -> anyhow::Result<()> {
    let mut seen = BTreeSet::new();
    // What can't be found is told where it is read.
    let twice = files.iter().find(|file| file.canonicalize().is_ok_and(|place| !seen.insert(place)));
    twice.map_or(Ok(()), |file| bail!("{} is given twice; name each file once", file.display()))
}

/// A report with the name of its file. `warn` is that of [`read_document`].
///
/// # Errors
/// As [`read_document`]; when the file is no report.
pub fn read_report(file: &Path, warn: &dyn Fn(&str)) -> anyhow::Result<(String, Report)> {
    match read_document(file, warn)? {
        Document::Report(report) => Ok((file_name(file), *report)),
        _ => bail!("{} is no report; only what `sapwise probe` wrote is taken here", file.display()),
    }
}

/// The `*.json` files of a folder, in the order of their names.
///
/// # Errors
/// When the folder can't be read.
pub fn json_files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let unreadable = || format!("the folder {} can't be read", folder.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(unreadable)? {
        let path = entry.with_context(unreadable)?.path();
        if path.extension().is_some_and(|e| e == "json") && path.is_file() {
            files.push(path);
        }
    }
    files.sort_unstable();
    Ok(files)
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// Reads a text file of ours.
///
/// # Errors
/// Names the file, and why it can't be read.
pub fn read_text(path: &Path) -> anyhow::Result<String> {
    let shown = path.display();
    let file = File::open(path).with_context(|| format!("{shown} can't be opened"))?;
    if file.metadata().with_context(|| format!("{shown} can't be read"))?.is_dir() {
        bail!("{shown} is a folder; name the files in it");
    }
    let mut bytes = Vec::new();
    // One byte beyond the limit tells a file that is too large from one that just fits; the length in the metadata can't
    // be trusted for pipes and devices.
    file.take(LARGEST_BYTES + 1).read_to_end(&mut bytes).with_context(|| format!("{shown} can't be read"))?;
    if bytes.len() as u64 > LARGEST_BYTES {
        bail!("{shown} is larger than {} MiB, which no file of ours is", LARGEST_BYTES >> 20);
    }
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        let line = e.as_bytes()[..at].iter().filter(|&&b| b == b'\n').count() + 1;
        anyhow::anyhow!("{shown} is no text: line {line} is not UTF-8 from byte {at} of the file on")
    })
}
