//! `sapwise fleet`: which reports of many nodes can be believed.

use crate::algorithms::Algorithms;
use crate::args;
use crate::check::Here;
use crate::destination::UNFINISHED;
use crate::exit::Outcome;
use crate::terminal::Terminal;
use crate::{output, shell};
use sapwise_lab::data::{read_report, refuse_twice, report_files};
use sapwise_lab::fleet::{Fleet, Kind};
use sapwise_lab::report::Report;
use sapwise_lab::text::count;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    #[serde(flatten)]
    fleet: Fleet,
    /// Files that are no whole reports, each with why.
    failed: Vec<Failed>,
    /// Nodes that have left nothing.
    missing: usize,
}

#[derive(Serialize)]
struct Failed {
    file: String,
    problem: String,
}

pub(crate) fn run(arguments: &args::Fleet, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    let here = Here::new(algorithms);
    let mut failed: Vec<Failed> = Vec::new();
    let mut fail = |file: &Path, problem: String| {
        failed.push(Failed {
            file: file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned(),
            problem,
        });
    };
    let unfinished = unfinished(&arguments.reports)?;
    // A folder where every node has failed holds no report at all.
    let files = report_files(&arguments.reports)
        .or_else(|why| if unfinished.is_empty() { Err(why) } else { Ok(Vec::new()) })?;
    refuse_twice(&files)?;
    for file in unfinished {
        fail(&file, "unfinished: the node failed, its job was ended, or it measures still".to_owned());
    }
    let mut reports: Vec<(String, Report)> = Vec::new();
    for file in files {
        match read_report(&file, &output::warn) {
            Err(error) => fail(&file, format!("{error:#}")),
            Ok(report) => match here.look_at(&file).problems.into_iter().next() {
                Some(problem) => fail(&file, problem),
                None => reports.push(report),
            },
        }
    }
    let fleet = Fleet::of(&reports);
    let bad = fleet.nodes.iter().filter(|node| node.problem.is_some()).count() + failed.len();
    let seen = fleet.nodes.len() + failed.len();
    let missing = arguments.nodes.map_or(0, |nodes| (nodes as usize).saturating_sub(seen));
    let answer = Answer { fleet, failed, missing };
    if arguments.json {
        output::print_json(&answer)?;
    } else {
        let good = seen - bad;
        let mut text = table(&answer, Terminal::of_standard_output());
        text += &format!("\n{good} of {} can be believed", count(seen + missing, "node"));
        text += &if missing > 0 { format!("; {missing} left no report.\n") } else { ".\n".to_owned() };
        let paths: Vec<String> = arguments.reports.iter().map(|path| shell::path(path)).collect();
        text += &if bad + missing == 0 {
            format!("Next: sapwise train {} --out model.json", paths.join(" "))
        } else {
            "Next: measure on the others again, or take their files away before `sapwise train`; what is complete is kept"
                .to_owned()
        };
        output::print(&text)?;
    }
    Ok(if bad + missing == 0 { Outcome::Done } else { Outcome::Failed })
}

/// What nodes have left in folders that did not finish, but for those that have a report of before.
fn unfinished(paths: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for folder in paths.iter().filter(|path| path.is_dir()) {
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            if path.extension().is_some_and(|e| e == UNFINISHED) && !path.with_extension("").exists() {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

fn table(answer: &Answer, terminal: Terminal) -> String {
    let mut rows = vec![["report", "kind", "clock", "others took", "over its kind", ""].map(str::to_owned).to_vec()];
    let known = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
    for node in &answer.fleet.nodes {
        rows.push(vec![
            node.file.clone(),
            (node.kind + 1).to_string(),
            known(node.clock_ghz.map(|ghz| format!("{ghz:.2} GHz"))),
            known(node.foreign_load.map(|share| format!("{:.0} %", 100.0 * share))),
            known(node.over_its_kind.map(|ratio| format!("{ratio:.2}"))),
            node.problem.as_deref().map_or(terminal.good("good"), |why| terminal.bad(why)),
        ]);
    }
    for Failed { file, problem } in &answer.failed {
        let dash = || "-".to_owned();
        rows.push(vec![file.clone(), dash(), dash(), dash(), dash(), terminal.bad(problem)]);
    }
    let kinds: String = answer
        .fleet
        .kinds
        .iter()
        .enumerate()
        .map(|(k, kind)| format!("Kind {}: {}\n", k + 1, sentence(kind)))
        .collect();
    format!("{}\n{kinds}", terminal.table(&rows))
}

fn sentence(kind: &Kind) -> String {
    let gpus = if kind.gpus.is_empty() { "no GPU".to_owned() } else { kind.gpus.join(", ") };
    let taken: String = kind.taken.iter().map(|what| format!(", {what}")).collect();
    format!("{}, {}, {}, {gpus}{taken}; host {}", kind.cpu, count(kind.cores as usize, "core"), kind.simd, kind.host)
}
