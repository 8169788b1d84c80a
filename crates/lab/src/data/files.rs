//! Reading the files of Sapwise.

use crate::progress::Progress;
use crate::report::{self, Report};
use crate::training::{StoredModel, read_model_and_skipped};
use anyhow::{Context, bail};
use rayon::prelude::*;
use sapwise::Tuning;
use sapwise_tune::json::{Format, Schema};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Larger files are refused before they fill the memory. A full report of a machine with 64 threads takes 2 MB.
const LARGEST_BYTES: u64 = 64 << 20;

/// A file of Sapwise, whatever its schema.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Document {
    /// `report/3`.
    Report(Box<Report>),
    /// `model/5`.
    Model(Box<StoredModel>),
    /// `tuning/3`.
    Tuning(Box<Tuning>),
}

/// Reads a report, model or tuning file. `warn` gets a sentence when a newer version wrote keys that this one does
/// not know.
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
        _ => bail!("{} has the schema {schema}, which is none of report/3, model/5 and tuning/3", path.display()),
    };
    if !skipped.is_empty() {
        warn(&ignored(path, &schema, &skipped));
    }
    Ok(document)
}

/// Says which keys of a newer version are ignored. A key of each of many points is named once.
fn ignored(path: &Path, schema: &Schema, skipped: &[String]) -> String {
    let keys: BTreeSet<String> = skipped.iter().map(|place| without_indices(place)).collect();
    let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
    format!(
        "{} is of {schema}, which a newer version of sapwise wrote; ignored, because this version does not know it: {}",
        path.display(),
        keys.join(", ")
    )
}

/// Turns a place in a file into that of all elements of its lists: `points[3].load.depth` into `points[].load.depth`.
fn without_indices(place: &str) -> String {
    let mut parts = place.split('[');
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text.push('[');
        text.push_str(part.trim_start_matches(|c: char| c.is_ascii_digit()));
    }
    text
}

/// Reads the reports in files and folders on all cores, with the name of each as [`read_report`] gives it.
///
/// # Errors
/// As [`report_files`] and [`read_report`]; when the user asked to stop.
pub fn read_reports(paths: &[PathBuf], progress: &dyn Progress) -> anyhow::Result<Vec<(String, Report)>> {
    let files = report_files(paths)?;
    progress.start(files.len() as u64);
    progress.message("reading");
    let read = |file: &PathBuf| {
        progress.check()?;
        let report = read_report(file, &|text| progress.warn(text));
        progress.advance(1);
        report
    };
    files.par_iter().map(read).collect()
}

/// Lists files, and the `*.json` files of folders and of the folders within them, in the order of their paths: each
/// once, because two would count as two measurements. A file that is missing stays in the list.
///
/// # Errors
/// When a folder can't be read or holds no such file.
pub fn report_files(paths: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files: Vec<PathBuf> = Vec::new();
    for path in paths {
        if path.is_dir() {
            let mut found = Vec::new();
            json_files(path, &mut found)?;
            if found.is_empty() {
                bail!("the folder {} holds no *.json file; make one with `sapwise probe --out R.json`", path.display());
            }
            found.sort_unstable();
            files.extend(found);
        } else {
            files.push(path.clone());
        }
    }
    let mut seen = BTreeSet::new();
    files.retain(|file| seen.insert(file.canonicalize().unwrap_or_else(|_| file.clone())));
    Ok(files)
}

/// Adds the `*.json` files of a folder and of the folders within it. Links to folders are not followed: they may lead
/// back.
fn json_files(folder: &Path, files: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let unreadable = || format!("the folder {} can't be read", folder.display());
    for entry in std::fs::read_dir(folder).with_context(unreadable)? {
        let entry = entry.with_context(unreadable)?;
        let path = entry.path();
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            json_files(&path, files)?;
        } else if path.extension().is_some_and(|e| e == "json") && path.is_file() {
            files.push(path);
        }
    }
    Ok(())
}

/// Reads a report, with its name: that of its folder, which names the host, and of its file, as in
/// `amd-epyc-zen3-2c/full.json`. `warn` is that of [`read_document`].
///
/// # Errors
/// As [`read_document`]; when the file is no report.
pub fn read_report(file: &Path, warn: &dyn Fn(&str)) -> anyhow::Result<(String, Report)> {
    match read_document(file, warn)? {
        Document::Report(report) => Ok((name(file), *report)),
        _ => bail!("{} is no report; only what `sapwise probe` wrote is taken here", file.display()),
    }
}

fn name(path: &Path) -> String {
    let last = |path: Option<&Path>| path.and_then(Path::file_name).map(|n| n.to_string_lossy().into_owned());
    let file = last(Some(path)).unwrap_or_default();
    last(path.parent()).map_or(file.clone(), |folder| format!("{folder}/{file}"))
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
    // One byte beyond the limit shows that a file is too large. The length in the metadata is wrong for pipes and
    // devices.
    file.take(LARGEST_BYTES + 1).read_to_end(&mut bytes).with_context(|| format!("{shown} can't be read"))?;
    if bytes.len() as u64 > LARGEST_BYTES {
        bail!("{shown} is larger than {} MiB, which no file of ours is", LARGEST_BYTES >> 20);
    }
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        let line = e.as_bytes()[..at].iter().filter(|&&b| b == b'\n').count() + 1;
        anyhow::anyhow!("{shown} is no text; name a JSON file: line {line} is not UTF-8 from byte {at} of the file on")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_searched_for_json_files_only() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(folder.path().join("b/deep")).unwrap();
        for file in ["b/full.json", "b/host.md", "b/deep/1t.json", "a.json", "z.csv"] {
            std::fs::write(folder.path().join(file), "{}").unwrap();
        }
        let found = report_files(&[folder.path().to_owned()]).unwrap();
        let expected = ["a.json", "b/deep/1t.json", "b/full.json"].map(|file| folder.path().join(file));
        assert_eq!(found, expected);
        assert_eq!(report_files(&[folder.path().to_owned(), expected[0].clone()]).unwrap(), expected);
        assert!(report_files(&[folder.path().join("b/none")]).is_ok_and(|files| files.len() == 1));
        std::fs::remove_dir_all(folder.path().join("b/deep")).unwrap();
        std::fs::remove_file(folder.path().join("b/full.json")).unwrap();
        assert!(report_files(&[folder.path().join("b")]).unwrap_err().to_string().contains("no *.json file"));
    }

    #[test]
    fn a_report_is_named_by_its_folder_and_file() {
        let names =
            ["datasets/a/full.json", "full.json", "./full.json", "../full.json"].map(|path| name(path.as_ref()));
        assert_eq!(names, ["a/full.json", "full.json", "full.json", "full.json"]);
    }
}
