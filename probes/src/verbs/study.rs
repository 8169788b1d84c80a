//! `sapwise study`: a page with figures and tables of any set of reports.

use crate::args::Study as Arguments;
use crate::exit::{Outcome, WrongUsage};
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{interrupt, output, shell};
use sapwise_lab::spread;
use sapwise_lab::study::{NotAmongReports, PAGE, Sources, Study, Summary, prepare};
use sapwise_lab::text::count;
use std::path::Path;

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let sources = Sources::new(&arguments.reports, arguments.reference.as_deref(), &arguments.machines);
    let sources = sources.map_err(|why| match why.downcast::<NotAmongReports>() {
        Ok(why) => WrongUsage(why.to_string()).into(),
        Err(why) => why,
    })?;
    interrupt::listen()?;
    let made = prepare(&arguments.out)?;
    let written = write(arguments, &sources);
    if written.is_err() && made {
        // Where something is in it by now it stays.
        let _ = std::fs::remove_dir(&arguments.out);
    }
    let (study, summary) = written?;
    for (name, why) in study.unreadable() {
        output::warn(&format!("{name} is left out: {why}"));
    }
    if arguments.json {
        output::print_json(&summary)?;
    } else {
        output::print(&text(&summary, &arguments.out))?;
    }
    Ok(Outcome::Done)
}

fn write(arguments: &Arguments, sources: &Sources) -> anyhow::Result<(Study, Summary)> {
    let progress = Progress::new(0);
    let study = Study::of(sources, command(arguments), &progress)?;
    progress.message("drawing");
    let summary = study.write(&arguments.out, &progress)?;
    Ok((study, summary))
}

/// Paths in the command at most; more tell nobody anything.
const MOST_PATHS: usize = 6;

/// The command that makes the study again where it was called. What is above the folder it was called in is of this machine alone, and of
/// a path that begins there the last name stands.
fn command(arguments: &Arguments) -> String {
    let mut words = vec!["sapwise study".to_owned()];
    match &arguments.reports[..] {
        few if few.len() <= MOST_PATHS => words.extend(few.iter().map(|p| shown(p))),
        many => words.push(format!("({} reports or folders)", many.len())),
    }
    words.push(format!("--out {}", shown(&arguments.out)));
    words.extend(arguments.reference.iter().map(|p| format!("--reference {}", shown(p))));
    words.extend(arguments.machines.iter().map(|p| format!("--machine {}", shown(p))));
    words.join(" ")
}

/// A path as a shell takes it, without what is of this machine alone.
fn shown(path: &Path) -> String {
    let last = || path.file_name().map(|n| n.to_string_lossy().into_owned());
    let text = if path.is_relative() { path.display().to_string() } else { last().unwrap_or_else(|| "/".to_owned()) };
    shell::quoted(&text)
}

fn text(summary: &Summary, out: &Path) -> String {
    let studied = summary.reports.iter().filter(|r| r.left_out.is_none()).count();
    let mut text = format!(
        "{} read, the timings of {studied} studied; physical machines: {}\n\n",
        count(summary.reports.len(), "report"),
        summary.physical_machines
    );
    for report in &summary.reports {
        if let Some(why) = &report.left_out {
            text.push_str(&format!("{} is left out: {why}\n", report.file));
        }
    }
    for sentence in &summary.can_say {
        text.push_str(&format!("{sentence}\n"));
    }
    let mut rows = vec![["the paper says", "by its own table", "by these reports"].map(str::to_owned).to_vec()];
    rows.extend(
        summary.claims.iter().map(|c| vec![c.claim.clone(), c.by_its_table.clone(), c.by_these_reports.clone()]),
    );
    text.push_str(&format!("\n{}", Terminal::of_standard_output().table(&rows)));
    if let Some(ours) = summary.strategies.first() {
        text.push_str(&format!(
            "\nPredicted from hardware parameters, with each {} held out in turn: mean regret (least to largest) {}\n",
            summary.held_out,
            spread::percent(ours.mean_regret, ours.regret_range(), 1)
        ));
    }
    for missing in &summary.missing {
        text.push_str(&format!("\nmissing: {missing}"));
    }
    text + &format!(
        "\n\nThe page is {}, with {} files beside it. Open it in a browser.",
        out.join(PAGE).display(),
        summary.files.len()
    )
}
