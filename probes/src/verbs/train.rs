//! `sapwise train`: a model from reports, validated by leaving machines out.

use crate::args::Train;
use crate::document::read_document;
use crate::exit::{Outcome, WrongUsage};
use crate::table::columns;
use crate::train::{self, Evidence, Learning, Trained};
use crate::{card, files, output};
use anyhow::{Context, bail};
use sapwise::json::Document;
use sapwise::model::Validation;
use sapwise::{Model, Report};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The answer for machines.
#[derive(Serialize)]
struct Answer<'a> {
    validation: &'a Validation,
    /// Name of the model.
    model: &'a str,
    notes: &'a [String],
    /// Mean regrets by the number of machines; of simulated ones only.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    simulated_learning: &'a [Learning],
}

pub(crate) fn run(arguments: &Train) -> anyhow::Result<Outcome> {
    let name = name(arguments)?;
    let reports = reports(&arguments.reports)?;
    let evidence = if arguments.simulated { Evidence::Simulated } else { Evidence::Real };
    let Trained { model, notes, learning } = train::train(&reports, &name, evidence)?;
    let text = sapwise::json::write(&model)?;
    files::write_text(&arguments.out, &text)?;
    if let Some(path) = &arguments.card {
        let page = card::page(&model, &notes, &learning);
        files::write_text(path, &page)?;
    }
    if arguments.json {
        let Model { validation, name, .. } = &model;
        output::print_json(&Answer { validation, model: name, notes: &notes, simulated_learning: &learning })?;
    } else {
        output::print(&summary(&model, &notes, &learning, &arguments.out))?;
    }
    Ok(Outcome::Done)
}

/// The name that the user gave, or that of the file.
fn name(arguments: &Train) -> anyhow::Result<String> {
    let stem = || arguments.out.file_stem().map(|s| s.to_string_lossy().into_owned());
    let name = arguments.name.clone().or_else(stem).unwrap_or_default();
    if name.trim().is_empty() {
        return Err(WrongUsage(format!("{} names no file", arguments.out.display())).into());
    }
    Ok(name)
}

/// The reports with their file names. The files of a folder come in the order of their names.
fn reports(paths: &[PathBuf]) -> anyhow::Result<Vec<(String, Report)>> {
    let mut files: Vec<PathBuf> = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(json_files(path)?);
        } else {
            files.push(path.clone());
        }
    }
    let mut reports = Vec::new();
    for file in &files {
        match read_document(file)? {
            Document::Report(report) => reports.push((file_name(file), *report)),
            _ => bail!("{} is no report; `train` takes what `sapwise probe` wrote", file.display()),
        }
    }
    Ok(reports)
}

fn json_files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let unreadable = || format!("the folder {} can't be read", folder.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(unreadable)? {
        let path = entry.with_context(unreadable)?.path();
        if path.extension().is_some_and(|e| e == "json") && path.is_file() {
            files.push(path);
        }
    }
    if files.is_empty() {
        bail!("the folder {} holds no *.json file; make one with `sapwise probe --out R.json`", folder.display());
    }
    files.sort_unstable();
    Ok(files)
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

fn summary(model: &Model, notes: &[String], learning: &[Learning], path: &Path) -> String {
    let mut text = card::scores(&model.validation, columns);
    if !learning.is_empty() {
        text.push_str(&format!("\n{}", card::course(learning, columns)));
    }
    for note in notes {
        text.push_str(&format!("note: {note}\n"));
    }
    let shown = path.display();
    text.push_str(&format!("\nThe model {} is in {shown}. Next: sapwise predict --model {shown}", model.name));
    text
}
