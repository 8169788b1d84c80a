//! `sapwise check`: whether files are sound, current and applicable here.

use crate::algorithms::Algorithms;
use crate::args::Check;
use crate::check::{Finding, Here};
use crate::exit::Outcome;
use crate::output;
use crate::progress::Progress;
use crate::terminal::Terminal;
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

/// What to do with the files: about those that failed, else with the first of them.
fn next_step(files: &[Finding]) -> String {
    if files.iter().any(|f| !f.problems.is_empty()) {
        return "each problem says what is wrong; `sapwise probe --out R.json`, `train` or `predict` makes such a file anew"
            .to_owned();
    }
    let first = files.first().map_or("FILE", |f| &f.file);
    match files.first().and_then(|f| f.schema) {
        Some(schema) if schema.starts_with("model/") => format!("sapwise predict --model {first}"),
        Some(schema) if schema.starts_with("tuning/") => format!("sapwise run fragmentation --tuning {first}"),
        _ => format!("sapwise predict --report {first}"),
    }
}

fn text(finding: &Finding, terminal: Terminal) -> String {
    let state = if finding.problems.is_empty() { terminal.good("good") } else { terminal.bad("BAD") };
    let schema = finding.schema.map_or(String::new(), |s| format!(" {s}"));
    let mut text = format!("{}:{schema} {state}", finding.file);
    for problem in &finding.problems {
        text.push_str(&format!("\n  {} {problem}", terminal.bad("problem:")));
    }
    for note in &finding.notes {
        text.push_str(&format!("\n  {} {note}", terminal.warning("note:")));
    }
    text
}
