//! `sapwise train`: a model from reports, validated on machines that are held out.

use crate::args::Train;
use crate::check::doubts;
use crate::exit::{Outcome, WrongUsage};
use crate::outputs::picture_format;
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{interrupt, output, outputs, shell};
use rayon::prelude::*;
use sapwise::Model;
use sapwise_lab::data::{Selection, read_report, report_files};
use sapwise_lab::evaluate::importance;
use sapwise_lab::figures::{Figure, TrainingPicture};
use sapwise_lab::write::{write_atomically, write_text};
use sapwise_lab::{Trained, Training, Validation, model_card, train, write_model};
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
    let plot = arguments.plot.as_deref().map(|path| Ok::<_, WrongUsage>((path, picture_format(path)?))).transpose()?;
    let reports = report_files(&arguments.reports)?;
    let outputs =
        [Some(&arguments.out), arguments.card.as_ref(), arguments.plot.as_ref(), arguments.importance.as_ref()];
    let outputs: Vec<_> = outputs.into_iter().flatten().collect();
    outputs::check(&reports, &outputs)?;
    interrupt::listen()?;
    let progress = Progress::new(reports.len() as u64);
    let (selection, doubtful) = select(&reports, &progress)?;
    let importance =
        arguments.importance.as_ref().map(|_| importance(&selection.clone().finish().0, &progress)).transpose()?;
    let Trained { model, training, mut notes, held_out } = train(selection, &name, &progress)?;
    drop(progress);
    notes.extend(doubtful.notes(&arguments.reports));
    write_text(&arguments.out, &write_model(&model, &training)?)?;
    if let Some(path) = &arguments.card {
        let mut page = model_card::page(&model, &training, &notes);
        if let Some(importance) = &importance {
            page.push_str(&format!("\n## Importance\n\n{}", importance.page(model_card::markdown)));
        }
        write_text(path, &page)?;
    }
    if let Some((path, format)) = plot {
        let caption = caption(&training, &command(arguments, path));
        let picture = TrainingPicture::new(&held_out).draw(format, &caption)?;
        write_atomically(path, |out| Ok(out.write_all(&picture)?))?;
    }
    if let Some((path, importance)) = arguments.importance.as_ref().zip(importance.as_ref()) {
        write_text(path, &sapwise::json::write(importance)?)?;
    }
    if arguments.json {
        output::print_json(&Answer { validation: &training.validation, model: &model.name, notes: &notes })?;
    } else {
        let terminal = Terminal::of_standard_output();
        let importance = importance.map_or_else(String::new, |i| format!("{}\n", i.page(|rows| terminal.table(rows))));
        let drawn = arguments.plot.as_ref().map_or(String::new(), |path| format!("\nDrawn in {}.", path.display()));
        output::print(&format!(
            "{importance}{}",
            summary(&model, &training, &notes, &arguments.out, &drawn, terminal)
        ))?;
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

/// What stands below the picture.
fn caption(training: &Training, command: &str) -> Vec<String> {
    let machines = training.validation.physical_machines;
    let plural = if machines == 1 { "" } else { "s" };
    vec![format!("{machines} physical machine{plural}."), format!("Made by: {command}")]
}

/// The command that makes the picture again, without folders, which are of this machine alone.
fn command(arguments: &Train, plot: &Path) -> String {
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let reports = match &arguments.reports[..] {
        [one] => name(one),
        many => format!("({} reports or folders)", many.len()),
    };
    format!("sapwise train {reports} --out {} --plot {}", name(&arguments.out), name(plot))
}

/// What the columns of the summary mean.
const COLUMNS: &str = "Regret is time over the best time, less one; in parentheses weighted by how often games are assumed to have that many \
objects (log-normal\naround 800). Crossovers off by: median distance between measured and predicted crossovers. --card explains every column.\n";

fn summary(
    model: &Model,
    training: &Training,
    notes: &[String],
    path: &Path,
    drawn: &str,
    terminal: Terminal,
) -> String {
    let table = |rows: &[Vec<String>]| terminal.table(rows);
    let mut text = model_card::scores(&training.validation, table);
    if !training.validation.methods.is_empty() {
        text.push_str(&format!("\n{COLUMNS}"));
    }
    for note in notes {
        text.push_str(&format!("{} {note}\n", terminal.warning("note:")));
    }
    text + &format!(
        "\nThe model, named {:?}, is in {}.{drawn}\nNext: sapwise predict --model {}",
        model.name,
        path.display(),
        shell::path(path)
    )
}
