//! `sapwise study`: a page with figures and tables of any set of reports.

use crate::args::Study as Arguments;
use crate::exit::Outcome;
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{interrupt, output};
use sapwise_lab::study::{PAGE, Summary, study};
use sapwise_lab::text::count;
use std::path::Path;

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    interrupt::listen()?;
    let progress = Progress::new(0);
    let summary = study(&arguments.reports, &arguments.out, &progress)?;
    drop(progress);
    if arguments.json {
        output::print_json(&summary)?;
    } else {
        output::print(&text(&summary, &arguments.out, Terminal::of_standard_output()))?;
    }
    Ok(Outcome::Done)
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
