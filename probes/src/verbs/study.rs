//! `sapwise study`: a page with figures and tables of any set of reports.

use crate::args::Study as Arguments;
use crate::exit::Outcome;
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{date, interrupt, output, shell};
use sapwise_lab::study::{PAGE, Summary, study};
use sapwise_lab::text::count;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    interrupt::listen()?;
    let progress = Progress::new(0);
    let summary = study(&arguments.reports, &arguments.out, &made(&arguments.reports), &progress)?;
    drop(progress);
    output::answer(arguments.json, &summary, || text(&summary, &arguments.out, Terminal::of_standard_output()))
}

/// Returns when and by which command a page was made, and the commit of its reports if git knows it.
fn made(reports: &[PathBuf]) -> String {
    let folder = reports.first().map(|path| if path.is_dir() { path } else { path.parent().unwrap_or(path) });
    let folder = folder.filter(|path| !path.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let describe = ["describe", "--always", "--dirty", "--abbrev=8", "--exclude=*"];
    let answer = Command::new("git").arg("-C").arg(folder).args(describe).stdin(Stdio::null()).output().ok();
    let commit = answer.filter(|a| a.status.success()).map(|a| String::from_utf8_lossy(&a.stdout).trim().to_owned());
    let commit = commit.map_or(String::new(), |commit| format!(", from reports of commit {commit}"));
    format!("Made on {} by `{}`{commit}.", date::today(), shell::own_command())
}

fn text(summary: &Summary, out: &Path, terminal: Terminal) -> String {
    let mut text = format!(
        "{} read, the timings of {} on {} studied.\n",
        count(summary.reports, "report"),
        summary.studied,
        count(summary.hosts, "host")
    );
    for note in &summary.notes {
        text.push_str(&format!("{} {note}\n", terminal.warning("note:")));
    }
    for missing in &summary.missing {
        text.push_str(&format!("{} {missing}\n", terminal.warning("missing:")));
    }
    let others = count(summary.files.len() - 1, "file");
    text + &format!("\nThe page is {}, with {others} beside it. Open it in a browser.", out.join(PAGE).display())
}
