//! `sapwise check`: whether files are sound, current and applicable here.

use crate::algorithms::Algorithms;
use crate::args::Check;
use crate::check::{Finding, Here};
use crate::exit::Outcome;
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{output, shell};
use serde::Serialize;
use std::path::PathBuf;

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    files: Vec<Finding>,
}

pub(crate) fn run(arguments: &Check, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    let here = Here::new(algorithms);
    let progress = Progress::new(arguments.files.len() as u64);
    progress.message("reading");
    let look_at = |path: &PathBuf| {
        let finding = here.look_at(path);
        progress.advance(1);
        finding
    };
    let files: Vec<Finding> = arguments.files.iter().map(look_at).collect();
    drop(progress);
    let failed = files.iter().any(|f| !f.problems.is_empty());
    if arguments.json {
        output::print_json(&Answer { files })?;
    } else {
        let terminal = Terminal::of_standard_output();
        files.iter().try_for_each(|f| output::print(&text(f, terminal)))?;
        output::print(&format!("Next: {}", next_step(&files)))?;
    }
    Ok(if failed { Outcome::Failed } else { Outcome::Done })
}

/// The next command to try: for the files with problems, else for all files of the kind of the first.
fn next_step(files: &[Finding]) -> String {
    // One that was cut short is to be measured again, as one with a problem.
    let is_bad = |f: &&Finding| !f.problems.is_empty() || f.is_cut_short();
    let is_old = |f: &&Finding| f.problems.iter().any(|p| p.contains("`sapwise convert"));
    if files.iter().any(|f| is_old(&f)) {
        return format!("sapwise convert {} --out converted", names(files.iter().filter(is_old)));
    }
    let bad = files.iter().find(is_bad);
    let Some(file) = bad.or(files.first()) else { return "sapwise predict".to_owned() };
    let (name, kind) = (shell::quoted(&file.file), file.kind());
    match (bad.is_some(), kind) {
        (true, Some("model")) => "sapwise predict".to_owned(),
        (true, Some("tuning")) => "sapwise predict --out tuning.json".to_owned(),
        (true, _) => "sapwise probe --out report.json".to_owned(),
        (false, Some("model")) => format!("sapwise predict --model {name}"),
        (false, Some("tuning")) => format!("sapwise run fragmentation --tuning {name}"),
        (false, _) => format!("sapwise study {} --out study", names(files.iter().filter(|f| f.kind() == kind))),
    }
}

/// The files as words of a command.
fn names<'a>(files: impl Iterator<Item = &'a Finding>) -> String {
    files.map(|f| shell::quoted(&f.file)).collect::<Vec<_>>().join(" ")
}

fn text(finding: &Finding, terminal: Terminal) -> String {
    let state = match (&finding.problems[..], &finding.doubts[..]) {
        ([], []) => terminal.good("good"),
        ([], _) => terminal.warning("DOUBTFUL"),
        _ => terminal.bad("BAD"),
    };
    let schema = finding.schema.map_or(String::new(), |s| format!(" {s}"));
    let mut text = format!("{}:{schema} {state}", finding.file);
    for problem in &finding.problems {
        text.push_str(&format!("\n  {} {problem}", terminal.bad("problem:")));
    }
    for doubt in &finding.doubts {
        text.push_str(&format!("\n  {} {doubt}", terminal.warning("doubt:")));
    }
    for note in &finding.notes {
        text.push_str(&format!("\n  {} {note}", terminal.warning("note:")));
    }
    text
}
