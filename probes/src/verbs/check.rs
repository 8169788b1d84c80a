//! `sapwise check`: whether files are sound, current and usable here, and how far repeated reports agree.

use crate::algorithms::Algorithms;
use crate::args::Check;
use crate::check::{Finding, Here};
use crate::exit::Outcome;
use crate::progress::{Progress, Steps as _};
use crate::terminal::Terminal;
use crate::{output, shell};
use sapwise_lab::data::report_files;
use sapwise_lab::kinds::{Agreement, Kind, Times};
use sapwise_lab::text::{count, once};
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// Times over those of repeats above which a report is not like them. Undisturbed repeats differ by 2 %, a program
/// that takes memory or cache makes it 0 to 36 %.
const SLOW: f64 = 1.15;

/// The reports of one kind, in the order of the files.
#[derive(Serialize)]
struct OfKind {
    #[serde(flatten)]
    kind: Kind,
    reports: Vec<Repeat>,
}

/// A report among those of its kind.
#[derive(Serialize)]
struct Repeat {
    file: String,
    /// Its times over those of the others; null without others that were neither cut short nor disturbed.
    over_others: Option<Agreement>,
}

pub(crate) fn run(arguments: &Check, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    let here = Here::new(algorithms);
    let paths = report_files(&arguments.files)?;
    let progress = Progress::new(paths.len() as u64);
    progress.message("reading");
    let look_at = |path: &PathBuf| {
        let finding = here.look_at(path);
        progress.advance(1);
        finding
    };
    let mut files: Vec<Finding> = paths.iter().map(look_at).collect();
    drop(progress);
    let kinds = compare(&mut files);
    let failed = files.iter().any(|f| !f.problems.is_empty());
    let done = output::answer(arguments.json, &json!({"files": files, "kinds": kinds}), || {
        text(&files, &kinds, Terminal::of_standard_output()) + &next_step(&files, &arguments.files)
    })?;
    Ok(if failed { Outcome::Failed } else { done })
}

/// Sorts reports into kinds and compares each with the others of its kind. One that is slower than they are becomes
/// doubtful.
fn compare(files: &mut [Finding]) -> Vec<OfKind> {
    let of_kind = |kind: Kind| {
        let members: Vec<&Finding> = files.iter().filter(|f| f.kind.as_ref() == Some(&kind)).collect();
        let repeat = |own: &&Finding| {
            let others = members.iter().filter(|f| f.file != own.file).filter_map(|f| f.times.as_ref());
            let over_others = own.times.as_ref().and_then(|times| times.over(&others.collect::<Vec<&Times>>()));
            Repeat { file: own.file.clone(), over_others }
        };
        OfKind { reports: members.iter().map(repeat).collect(), kind }
    };
    let kinds: Vec<OfKind> = once(files.iter().filter_map(|f| f.kind.clone())).into_iter().map(of_kind).collect();
    for Repeat { file, over_others } in kinds.iter().flat_map(|kind| &kind.reports) {
        let slow = over_others.map(|a| a.median).filter(|&ratio| ratio > SLOW);
        if let (Some(ratio), Some(finding)) = (slow, files.iter_mut().find(|f| f.file == *file)) {
            finding.doubts.push(format!(
                "it takes {ratio:.2} × the time of the other reports of its kind: look for throttling, other programs \
                 or another setup"
            ));
        }
    }
    kinds
}

fn text(files: &[Finding], kinds: &[OfKind], terminal: Terminal) -> String {
    let reports = kinds.iter().map(|kind| kind.reports.len()).sum::<usize>();
    // With several reports, the table lists the good ones.
    let is_told = |f: &&Finding| reports < 2 || f.kind.is_none() || !f.problems.is_empty() || !f.doubts.is_empty();
    let mut text: String = files.iter().filter(is_told).map(|f| of_file(f, terminal)).collect();
    if reports > 1 {
        text += &format!("\n{}", table(files, kinds, terminal));
    }
    text
}

fn of_file(finding: &Finding, terminal: Terminal) -> String {
    let schema = finding.schema.map_or(String::new(), |s| format!(" {s}"));
    let mut text = format!("{}:{schema} {}\n", finding.file, verdict(finding, terminal));
    let mut list = |what: String, lines: &[String]| {
        lines.iter().for_each(|line| text.push_str(&format!("  {what} {line}\n")));
    };
    list(terminal.bad("problem:"), &finding.problems);
    list(terminal.warning("doubt:"), &finding.doubts);
    list(terminal.warning("note:"), &finding.notes);
    text
}

fn verdict(finding: &Finding, terminal: Terminal) -> String {
    match (&finding.problems[..], &finding.doubts[..]) {
        ([], []) => terminal.good("good"),
        ([], _) => terminal.warning("DOUBTFUL"),
        _ => terminal.bad("BAD"),
    }
}

/// Draws a table: which reports can be believed, which are of one kind, and how far repeats agree.
fn table(files: &[Finding], kinds: &[OfKind], terminal: Terminal) -> String {
    let mut rows = vec![["report", "kind", "believed", "× repeats"].map(str::to_owned).to_vec()];
    let folder = common_folder(kinds.iter().flat_map(|kind| &kind.reports).map(|repeat| &*repeat.file));
    for (k, kind) in kinds.iter().enumerate() {
        for Repeat { file, over_others } in &kind.reports {
            let finding = files.iter().find(|f| f.file == *file);
            let ratio = over_others.map_or("-".to_owned(), |a| {
                let [low, high] = a.quartiles;
                format!("{:.2} ({low:.2}–{high:.2})", a.median)
            });
            let believed = finding.map_or_else(String::new, |f| verdict(f, terminal));
            rows.push(vec![file[folder..].to_owned(), (k + 1).to_string(), believed, ratio]);
        }
    }
    let good = files.iter().filter(|f| f.kind.is_some() && f.problems.is_empty() && f.doubts.is_empty()).count();
    let kinds: String =
        kinds.iter().enumerate().map(|(k, of)| format!("{:>4}  {}\n", k + 1, words(&of.kind))).collect();
    let note = "× repeats: times over those of other reports of the kind, median and quartiles.";
    format!(
        "{}{note}\n\n{}\n{kinds}{good} of {} can be believed.\n",
        terminal.table(&rows),
        terminal.head("kind"),
        count(rows.len() - 1, "report")
    )
}

/// Returns the length of the folder that all paths begin with, its slash included.
fn common_folder<'a>(mut paths: impl Iterator<Item = &'a str>) -> usize {
    let Some(first) = paths.next() else { return 0 };
    let alike = |path: &str| first.bytes().zip(path.bytes()).take_while(|(a, b)| a == b).count();
    let shared = paths.map(alike).min().unwrap_or(0);
    first.as_bytes()[..shared].iter().rposition(|&b| b == b'/').map_or(0, |at| at + 1)
}

fn words(kind: &Kind) -> String {
    let Kind { cpu, cores, simd, host, .. } = kind;
    let gpu_threads = kind.gpu_threads.map_or(String::new(), |k| format!(" on {}", count(k as usize, "thread")));
    let gpus = if kind.gpus.is_empty() { String::new() } else { format!("\n      with {}", kind.gpus.join(", ")) };
    format!("{cpu}, {}, {simd}, host {host}{gpus}{gpu_threads}", count(*cores as usize, "core"))
}

/// Returns the next command to try: for the first file with a problem or a doubt, otherwise for the first file or for
/// all reports.
fn next_step(files: &[Finding], given: &[PathBuf]) -> String {
    let bad = files.iter().find(|f| !f.problems.is_empty() || !f.doubts.is_empty());
    let Some(file) = bad.or(files.first()) else { return shell::next("predict") };
    let name = shell::quoted(&file.file);
    let reports = || -> String {
        if files.iter().all(|f| f.kind.is_some()) {
            return given.iter().map(|path| shell::path(path) + " ").collect();
        }
        files.iter().filter(|f| f.kind.is_some()).map(|f| shell::quoted(&f.file) + " ").collect()
    };
    let next = match (bad.is_some(), file.schema_name()) {
        (true, Some("model")) => "predict".to_owned(),
        (true, Some("tuning")) => "predict --out tuning.json".to_owned(),
        (true, _) => "probe --out report.json".to_owned(),
        (false, Some("model")) => format!("predict --model {name}"),
        (false, Some("tuning")) => format!("run fragmentation --tuning {name}"),
        (false, _) => format!("study {}--out study", reports()),
    };
    shell::next(&next)
}
