//! `sapwise compare`: how well repeated reports of one machine agree.

use crate::args::Compare;
use crate::exit::Outcome;
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{output, shell};
use sapwise_lab::compare::{Comparison, steady};
use sapwise_lab::data::read_reports;

pub(crate) fn run(arguments: &Compare) -> anyhow::Result<Outcome> {
    let progress = Progress::new(0);
    let mut reports = read_reports(&arguments.reports, &progress)?;
    let mut left_out = Vec::new();
    if arguments.steady {
        let all = reports.len();
        (reports, left_out) = steady(reports);
        if reports.len() < 2 {
            let kept = reports.len();
            anyhow::bail!("of {all} reports {kept} are steady and alike; measure more of them, or leave out --steady");
        }
    }
    let comparison = Comparison::of(reports)?;
    drop(progress);
    if arguments.json {
        output::print_json(&comparison)?;
    } else {
        let terminal = Terminal::of_standard_output();
        let why = "its cores were elsewhere or moved, or where they were is unknown";
        let left_out: String = left_out.iter().map(|name| format!("{name} is left out: {why}\n")).collect();
        let paths: Vec<String> = arguments.reports.iter().map(|path| shell::path(path)).collect();
        let next = format!("\nNext: sapwise study {} --out study", paths.join(" "));
        output::print(&(left_out + &comparison.text(|rows| terminal.table(rows)) + &next))?;
    }
    Ok(Outcome::Done)
}
