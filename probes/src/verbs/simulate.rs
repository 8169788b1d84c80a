//! `sapwise simulate`: reports of simulated machines, from published specifications.

use crate::args::Simulate;
use crate::exit::Outcome;
use crate::progress::Progress;
use crate::{output, outputs, shell};
use anyhow::{Context, bail};
use sapwise_lab::data::{json_files, read_text};
use sapwise_lab::report;
use sapwise_lab::simulated::{Loads, built_in, read, simulate};
use sapwise_lab::text::count;
use sapwise_lab::write::write_text;
use serde::Serialize;

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    /// What was written.
    files: Vec<String>,
}

pub(crate) fn run(arguments: &Simulate) -> anyhow::Result<Outcome> {
    let folder = &arguments.out;
    // Reports of another seed or another file would stay among the new ones, and `train` takes all of a folder.
    if folder.is_dir() && !json_files(folder)?.is_empty() {
        bail!("the folder {} holds *.json files already; name another with --out, or empty it", folder.display());
    }
    let specifications = match &arguments.specifications {
        Some(path) => read(&read_text(path)?).with_context(|| format!("{} can't be used", path.display()))?,
        None => built_in()?,
    };
    let machines = arguments.machines.map_or(specifications.cpus.len(), |n| n as usize);
    let loads = Loads::of_a_sweep(arguments.seed, None)?;
    let reports = simulate(&specifications, machines, &loads, arguments.seed, &Progress::new(0))?;
    outputs::make_folder(folder)?;
    let mut written = Vec::new();
    for (name, report) in &reports {
        let path = folder.join(format!("{name}.json"));
        write_text(&path, &report::write(report)?)?;
        written.push(path.display().to_string());
    }
    if arguments.json {
        output::print_json(&Answer { files: written })?;
    } else {
        output::print(&format!(
            "Reports of {} are in {}. They are no evidence of accuracy.\nNext: sapwise train --simulated {} --out \
             simulated-model.json",
            count(written.len(), "simulated machine"),
            folder.display(),
            shell::path(folder)
        ))?;
    }
    Ok(Outcome::Done)
}
