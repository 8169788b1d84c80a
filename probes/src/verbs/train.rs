//! `sapwise train`: a model from reports, validated by leaving machines out.

use crate::args::Train;
use sapwise_lab::data::files::{read_report, report_files};
use crate::exit::{Outcome, WrongUsage};
use sapwise_lab::figures::{self, Figure, Picture};
use crate::progress::Progress;
use crate::terminal::{Axis, Chart, Series, Terminal};
use crate::train::{self, Evidence, Held, OURS, Selection, Trained};
use crate::{card, files, interrupt, output};
use rayon::prelude::*;
use sapwise::Model;
use sapwise::model::{Learning, Validation};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Reports that are in memory at the same time: a full one has a megabyte, ten thousand have ten gigabytes.
const AT_A_TIME: usize = 64;

/// The answer for machines.
#[derive(Serialize)]
struct Answer<'a> {
    validation: &'a Validation,
    /// Name of the model.
    model: &'a str,
    notes: &'a [String],
}

pub(crate) fn run(arguments: &Train) -> anyhow::Result<Outcome> {
    let name = name(arguments)?;
    let picture = arguments.plot.as_deref().map(|path| Ok::<_, WrongUsage>((path, Picture::of(path)?))).transpose()?;
    let evidence = if arguments.simulated { Evidence::Simulated } else { Evidence::Real };
    let reports = report_files(&arguments.reports)?;
    let outputs = [Some(&arguments.out), arguments.card.as_ref(), arguments.plot.as_ref(), arguments.importance.as_ref()];
    files::refuse_overwriting(&reports, &outputs.into_iter().flatten().collect::<Vec<_>>())?;
    let selection = select(&reports, evidence)?;
    let importance = arguments.importance.as_ref().map(|_| train::importance(&selection.clone().finish().0)).transpose()?;
    let Trained { model, notes, held } = train::train(selection, &name)?;
    let text = sapwise::json::write_model(&model)?;
    files::write_text(&arguments.out, &text)?;
    if let Some(path) = &arguments.card {
        let mut page = card::page(&model, &notes);
        if let Some(importance) = &importance {
            page.push_str(&format!("\n## Importance\n\n{}", importance.page(card::markdown)));
        }
        files::write_text(path, &page)?;
    }
    if let Some((path, picture)) = picture {
        let picture = plot::Training::new(&held, &model.validation.learning)
            .draw(picture, &caption(&model, &command(arguments, path)))?;
        files::write_atomically(path, |out| Ok(out.write_all(&picture)?))?;
    }
    if let Some((path, importance)) = arguments.importance.as_ref().zip(importance.as_ref()) {
        files::write_text(path, &sapwise::json::write(importance)?)?;
    }
    if arguments.json {
        let Model { validation, name, .. } = &model;
        output::print_json(&Answer { validation, model: name, notes: &notes })?;
    } else {
        let terminal = Terminal::of_standard_output();
        let importance = importance.map_or_else(String::new, |i| format!("{}\n", i.page(|rows| terminal.table(rows))));
        let drawn = arguments.plot.as_ref().map_or(String::new(), |path| format!("\nDrawn in {}.", path.display()));
        output::print(&format!("{importance}{}{drawn}", summary(&model, &held, &notes, &arguments.out, terminal)))?;
    }
    Ok(Outcome::Done)
}

/// Reads the reports on all cores, some at a time, and keeps of each what is trained on.
fn select(files: &[PathBuf], evidence: Evidence) -> anyhow::Result<Selection> {
    let progress = Progress::new(files.len() as u64);
    progress.message("reading");
    let mut selection = Selection::new(evidence, files.len());
    let placed: Vec<(usize, &PathBuf)> = files.iter().enumerate().collect();
    for some in placed.chunks(AT_A_TIME) {
        interrupt::check()?;
        let read = |&(place, file): &(usize, &PathBuf)| {
            let (name, report) = read_report(file)?;
            Ok(selection.reduce(place, &name, &report))
        };
        let reduced: Vec<_> = some.par_iter().map(read).collect::<anyhow::Result<_>>()?;
        reduced.into_iter().for_each(|r| selection.add(r));
        progress.advance(some.len() as u64);
    }
    Ok(selection)
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

/// What stands below the picture.
fn caption(model: &Model, command: &str) -> Vec<String> {
    let simulated = if model.is_simulated() { "Simulated machines, no evidence of accuracy. " } else { "" };
    let machines = model.validation.physical_machines;
    let plural = if machines == 1 { "" } else { "s" };
    vec![format!("{simulated}{machines} physical machine{plural}."), format!("Made by: {command}")]
}

/// The command that makes the picture again, without folders, which are of this machine alone.
fn command(arguments: &Train, plot: &Path) -> String {
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let reports = match &arguments.reports[..] {
        [one] => name(one),
        many => format!("({} reports or folders)", many.len()),
    };
    let simulated = if arguments.simulated { " --simulated" } else { "" };
    format!("sapwise train{simulated} {reports} --out {} --plot {}", name(&arguments.out), name(plot))
}

/// What the columns in the summary mean, in few words.
const COLUMNS: &str = "Regret is time over the best time, less one. In games: each number of objects as often as games are assumed to \
have it (log-normal around\n800). Borders off by: octaves between measured and predicted borders, the median. --card explains all.\n";

fn summary(model: &Model, held: &Held, notes: &[String], path: &Path, terminal: Terminal) -> String {
    let table = |rows: &[Vec<String>]| terminal.table(rows);
    let mut text = card::scores(&model.validation, table);
    if !model.validation.methods.is_empty() {
        text.push_str(&format!("\n{COLUMNS}"));
    }
    if !model.validation.learning.is_empty() {
        text.push_str(&format!("\n{}", card::course(&model.validation.learning, model.is_simulated(), table)));
    }
    for note in notes {
        text.push_str(&format!("{} {note}\n", terminal.warning("note:")));
    }
    let shown = path.display();
    text.push_str(&format!("\nThe model {} is in {shown}. Next: sapwise predict --model {shown}", model.name));
    text
}
