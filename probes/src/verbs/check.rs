//! `sapwise check`: whether files are sound, current and applicable here.

use crate::algorithms::Algorithms;
use crate::args::Check;
use crate::check::{Finding, Here};
use crate::exit::Outcome;
use crate::output;
use serde::Serialize;

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    files: Vec<Finding>,
}

pub(crate) fn run(arguments: &Check, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    let here = Here::new(algorithms);
    let files: Vec<Finding> = arguments.files.iter().map(|path| here.look_at(path)).collect();
    let failed = files.iter().any(|f| !f.problems.is_empty());
    if arguments.json {
        output::print_json(&Answer { files })?;
    } else {
        files.iter().try_for_each(|f| output::print(&text(f)))?;
    }
    Ok(if failed { Outcome::Failed } else { Outcome::Done })
}

fn text(finding: &Finding) -> String {
    let state = if finding.problems.is_empty() { "good" } else { "BAD" };
    let schema = finding.schema.map_or(String::new(), |s| format!(" {s}"));
    let mut text = format!("{}:{schema} {state}", finding.file);
    for problem in &finding.problems {
        text.push_str(&format!("\n  problem: {problem}"));
    }
    for note in &finding.notes {
        text.push_str(&format!("\n  note: {note}"));
    }
    text
}
