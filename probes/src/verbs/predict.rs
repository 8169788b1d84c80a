//! `sapwise predict`: the fields of a machine without a sweep.

use crate::args::Predict;
use crate::document::read_document;
use crate::exit::Outcome;
use crate::hardware::measure_hardware;
use crate::{files, interrupt, output, prediction, summary};
use anyhow::{Context, bail};
use sapwise::json::{self, Document};
use sapwise::{Hardware, Model};
use std::path::Path;

pub(crate) fn run(arguments: &Predict) -> anyhow::Result<Outcome> {
    interrupt::listen()?;
    let model = model(arguments.model.as_deref())?;
    let hardware = match &arguments.report {
        Some(path) => hardware_of(path)?,
        None => measure_hardware(arguments.threads)?,
    };
    interrupt::check()?;
    let fields = prediction::predict(&model, &hardware, arguments.scenario)?;
    if let Some(path) = &arguments.out {
        let text = json::write(&fields)?;
        files::write_atomically(path, |w| Ok(w.write_all(text.as_bytes())?))?;
    }
    if arguments.json {
        output::print_json(&fields)?;
        return Ok(Outcome::Done);
    }
    let mut text = String::new();
    if arguments.report.is_none() {
        text += &summary::hardware(&hardware);
        text.push('\n');
    }
    text += &summary::fields(&fields);
    text += "\nThis version has no GPU backend, so only algorithms on the CPU are predicted.\n";
    text += &match &arguments.out {
        Some(path) => format!("Written to {}. Next: sapwise run fragmentation --fields {}", path.display(), path.display()),
        None => "Next: sapwise predict --out fields.json, then sapwise run fragmentation --fields fields.json".to_owned(),
    };
    output::print(&text)?;
    Ok(Outcome::Done)
}

/// The model in a file, or the one that is built in.
///
/// # Errors
/// When the file is no sound model.
pub(super) fn model(path: Option<&Path>) -> anyhow::Result<Model> {
    let Some(path) = path else { return Ok(Model::built_in()?) };
    match read_document(path)? {
        Document::Model(model) => Ok(*model),
        _ => bail!("{} is no model; make one with `sapwise train`", path.display()),
    }
}

fn hardware_of(path: &Path) -> anyhow::Result<Hardware> {
    match read_document(path).context("the report can't be used")? {
        Document::Report(report) => Ok(report.hardware),
        _ => bail!("{} is no report; make one with `sapwise probe --hardware-only --out R.json`", path.display()),
    }
}
