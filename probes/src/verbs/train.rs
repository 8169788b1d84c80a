//! `sapwise train`: a model from reports, validated on machines that are held out.

use crate::args::Train;
use crate::check::doubts;
use crate::exit::{Outcome, WrongUsage};
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{interrupt, output, outputs, shell};
use rayon::prelude::*;
use sapwise_lab::data::{Selection, read_report, report_files};
use sapwise_lab::write::write_text;
use sapwise_lab::{Trained, Training, Validation, model_card, train, write_model};
use sapwise_tune::Model;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Reports in memory at the same time. A full one takes some megabytes.
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
    let reports = report_files(&arguments.reports)?;
    let outputs: Vec<_> = [Some(&arguments.out), arguments.card.as_ref()].into_iter().flatten().collect();
    outputs::check(&reports, &outputs)?;
    interrupt::listen()?;
    let progress = Progress::new(reports.len() as u64);
    let (selection, doubtful) = select(&reports, &progress)?;
    let Trained { model, training, mut notes, .. } = train(selection, &name, &progress)?;
    drop(progress);
    notes.extend(doubtful.notes(&arguments.reports));
    write_text(&arguments.out, &write_model(&model, &training)?)?;
    if let Some(path) = &arguments.card {
        write_text(path, &model_card::page(&model, &training, &notes))?;
    }
    if arguments.json {
        output::print_json(&Answer { validation: &training.validation, model: &model.name, notes: &notes })?;
    } else {
        let terminal = Terminal::of_standard_output();
        output::print(&summary(&model, &training, &notes, &arguments.out, terminal))?;
    }
    Ok(Outcome::Done)
}

/// Doubtful reports.
#[derive(Default)]
struct Doubtful(Vec<(PathBuf, Vec<String>)>);

impl Doubtful {
    /// Returns all doubts about reports that the user named, and the number of doubtful reports in folders.
    fn notes(&self, named: &[PathBuf]) -> Vec<String> {
        let (own, in_folders): (Vec<_>, Vec<_>) = self.0.iter().partition(|(path, _)| named.contains(path));
        let of = |(path, doubts): &(PathBuf, Vec<String>)| {
            let path = path.display().to_string();
            doubts.iter().map(move |doubt| format!("{path} is doubtful: {doubt}")).collect::<Vec<_>>()
        };
        let mut notes: Vec<String> = own.into_iter().flat_map(of).collect();
        if !in_folders.is_empty() {
            let (number, what) = (in_folders.len(), if in_folders.len() == 1 { "report is" } else { "reports are" });
            notes.push(format!("{number} {what} doubtful among those in folders; `sapwise check` says why"));
        }
        notes
    }
}

/// Reads the reports on all cores, some at a time, and keeps what is trained on.
fn select(files: &[PathBuf], progress: &Progress) -> anyhow::Result<(Selection, Doubtful)> {
    progress.message("reading");
    let mut selection = Selection::default();
    let mut doubtful = Doubtful::default();
    for some in files.chunks(AT_A_TIME) {
        interrupt::check()?;
        let read = |file: &PathBuf| {
            let (name, report) = read_report(file, &|text| progress.warn(text))?;
            Ok((doubts(&report), Selection::reduce(&name, &report)))
        };
        let reduced: Vec<_> = some.par_iter().map(read).collect::<anyhow::Result<_>>()?;
        for (file, (doubts, reduced)) in some.iter().zip(reduced) {
            if reduced.is_ok() && !doubts.is_empty() {
                doubtful.0.push((file.clone(), doubts));
            }
            selection.add(reduced);
        }
        progress.advance(some.len() as u64);
    }
    Ok((selection, doubtful))
}

/// Returns the name that the user gave, or that of the file.
fn name(arguments: &Train) -> anyhow::Result<String> {
    let stem = || arguments.out.file_stem().map(|s| s.to_string_lossy().into_owned());
    let name = arguments.name.clone().or_else(stem).unwrap_or_default();
    if name.trim().is_empty() {
        return Err(WrongUsage(format!("{} names no file", arguments.out.display())).into());
    }
    Ok(name)
}

/// What the columns of the summary mean.
const COLUMNS: &str = "Regret is time over the best time, less one; in parentheses weighted by how often games are \
    assumed to have that many \
objects (log-normal\naround 800). Crossovers off by: median distance between measured and predicted crossovers. \
--card explains every column.\n";

fn summary(model: &Model, training: &Training, notes: &[String], path: &Path, terminal: Terminal) -> String {
    let table = |rows: &[Vec<String>]| terminal.table(rows);
    let mut text = model_card::scores(&training.validation, table);
    if !training.validation.methods.is_empty() {
        text.push_str(&format!("\n{COLUMNS}"));
    }
    for note in notes {
        text.push_str(&format!("{} {note}\n", terminal.warning("note:")));
    }
    text + &format!(
        "\nThe model, named {:?}, is in {}.\nNext: sapwise predict --model {}",
        model.name,
        path.display(),
        shell::path(path)
    )
}
