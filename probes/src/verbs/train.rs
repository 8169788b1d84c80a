//! `sapwise train`: a model from reports, validated on machines that are held out.

use crate::args::Train;
use crate::check::doubts;
use crate::exit::{Outcome, WrongUsage};
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{interrupt, output, outputs, shell};
use sapwise_lab::data::{Published, Selection, read_reports, report_files};
use sapwise_lab::text::count;
use sapwise_lab::write::write_text;
use sapwise_lab::{Trained, Training, model_card, train, write_model};
use sapwise_tune::Model;
use serde_json::json;
use std::path::Path;

pub(crate) fn run(arguments: &Train) -> anyhow::Result<Outcome> {
    let name = name(arguments)?;
    let files = report_files(&arguments.reports)?;
    let outputs: Vec<_> = [Some(&arguments.out), arguments.card.as_ref()].into_iter().flatten().collect();
    outputs::check(&files, &outputs)?;
    interrupt::listen()?;
    // Before the work, which takes a minute.
    let published = Published::read(&arguments.reports)?;
    let progress = Progress::new(0);
    let reports = read_reports(&files, &progress)?;
    let Trained { mut model, mut training, mut notes, .. } = train(Selection::of(&reports), &name, &progress)?;
    training.published = published.compare(&mut model);
    drop(progress);
    let doubtful = reports.iter().filter(|(_, report)| !doubts(report).is_empty()).count();
    if doubtful > 0 {
        notes.push(format!("{doubtful} of {} are doubtful; `sapwise check` says why", count(reports.len(), "report")));
    }
    write_text(&arguments.out, &write_model(&model, &training)?)?;
    if let Some(path) = &arguments.card {
        write_text(path, &model_card::page(&model, &training, &notes))?;
    }
    let answer = json!({"validation": training.validation, "model": model.name, "notes": notes});
    let text = || summary(&model, &training, &notes, &arguments.out, Terminal::of_standard_output());
    output::answer(arguments.json, &answer, text)
}

/// Returns the name that the user gave, or that of the file.
fn name(arguments: &Train) -> anyhow::Result<String> {
    let stem = || arguments.out.file_stem().map(|s| s.to_string_lossy().into_owned());
    let name = arguments.name.clone().or_else(stem).unwrap_or_default();
    if name.trim().is_empty() {
        return Err(WrongUsage("the model has no name; give one with --name".to_owned()).into());
    }
    Ok(name)
}

/// Columns of the table of strategies that fit into 80 characters: the strategy, the regrets, the share over 10 %.
const SHOWN: [usize; 4] = [0, 1, 2, 8];

/// Explanation of the columns of the summary.
const COLUMNS: &str = "Regret is time over the best time, less one; in parentheses weighted for games,\n\
assumed to have around 800 objects. --card writes and explains all columns.\n";

fn summary(model: &Model, training: &Training, notes: &[String], path: &Path, terminal: Terminal) -> String {
    let table = |rows: &[Vec<String>]| {
        let kept = |row: &Vec<String>| SHOWN.into_iter().filter_map(|k| row.get(k).cloned()).collect();
        terminal.table(&rows.iter().map(kept).collect::<Vec<_>>())
    };
    let mut text = model_card::scores(&training.validation, table);
    if !training.validation.methods.is_empty() {
        text.push_str(&format!("\n{COLUMNS}"));
    }
    for note in notes {
        text.push_str(&format!("{} {note}\n", terminal.warning("note:")));
    }
    text + &format!(
        "\nThe model, named {:?}, is in {}.\n{}",
        model.name,
        path.display(),
        shell::next(&format!("predict --model {}", shell::path(path)))
    )
}
