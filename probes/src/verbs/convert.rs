//! `sapwise convert`: files of before version 0.2 in the form that is read now.

use crate::args::Convert;
use crate::exit::{Outcome, WrongUsage};
use crate::{output, outputs};
use sapwise_lab::convert::convert;
use sapwise_lab::write::write_text;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    files: Vec<Line>,
}

/// What became of a file.
#[derive(Serialize)]
struct Line {
    file: String,
    /// Where its current form went; absent where it was not converted.
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    schema: Option<&'static str>,
    /// What was left out.
    dropped: Vec<String>,
    /// Why it was not converted.
    #[serde(skip_serializing_if = "Option::is_none")]
    problem: Option<String>,
}

pub(crate) fn run(arguments: &Convert) -> anyhow::Result<Outcome> {
    let folder = &arguments.out;
    let place = |file: &PathBuf| match file.file_name() {
        Some(name) => Ok(folder.join(name)),
        None => Err(WrongUsage(format!("{} names no file", file.display()))),
    };
    let places = arguments.files.iter().map(place).collect::<Result<Vec<PathBuf>, _>>()?;
    outputs::refuse_overwriting(&arguments.files, &places.iter().collect::<Vec<_>>())?;
    outputs::make_folder(folder)?;
    let files: Vec<Line> = arguments.files.iter().zip(&places).map(|(file, out)| converted(file, out)).collect();
    let failed = files.iter().any(|line| line.problem.is_some());
    if arguments.json {
        output::print_json(&Answer { files })?;
    } else {
        files.iter().try_for_each(|line| output::print(&text(line)))?;
    }
    Ok(if failed { Outcome::Failed } else { Outcome::Done })
}

fn converted(file: &Path, out: &Path) -> Line {
    let convert = || {
        let converted = convert(&std::fs::read_to_string(file)?)?;
        write_text(out, &converted.text)?;
        anyhow::Ok(converted)
    };
    let (file, out) = (file.display().to_string(), out.display().to_string());
    match convert() {
        Ok(c) => Line { file, out: Some(out), schema: Some(c.schema), dropped: c.dropped, problem: None },
        Err(why) => Line { file, out: None, schema: None, dropped: Vec::new(), problem: Some(format!("{why:#}")) },
    }
}

fn text(line: &Line) -> String {
    let mut text = line.file.clone();
    if let (Some(out), Some(schema)) = (&line.out, line.schema) {
        text.push_str(&format!(": {schema} in {out}"));
    }
    for what in &line.dropped {
        text.push_str(&format!("\n  left out: {what}"));
    }
    if let Some(why) = &line.problem {
        text.push_str(&format!(": not converted: {why}"));
    }
    text
}
