//! `sapwise compare`: how well repeated reports of one machine agree.

use crate::args::Compare;
use crate::exit::Outcome;
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{output, shell};
use sapwise_lab::compare::{Comparison, steady};
use sapwise_lab::data::read_reports;

pub(crate) fn run(arguments: &Compare) -> anyhow::Result<Outcome> {
    let mut reports = read_reports(&arguments.reports, &Progress::new(0))?;
    let mut left_out = Vec::new();
    if arguments.steady {
        let all = reports.len();
        (reports, left_out) = steady(reports);
        if reports.len() < 2 {
            anyhow::bail!(
                "of {all} reports {} are steady and alike; measure more of them, or leave out --steady",
                reports.len()
            );
        }
    }
    let comparison = Comparison::of(reports)?;
    if arguments.json {
        output::print_json(&comparison)?;
    } else {
        let terminal = Terminal::of_standard_output();
        let told = left_out
            .iter()
            .map(|name| format!("{name} is left out: its cores were elsewhere or moved, or where they were is unknown\n"));
        let reports: Vec<String> = arguments.reports.iter().map(|path| shell::path(path)).collect();
        let next = format!("\nNext: sapwise study {} --out study", reports.join(" "));
        output::print(&(told.collect::<String>() + &comparison.text(|rows| terminal.table(rows)) + &next))?;
    }
    Ok(Outcome::Done)
}
