//! `sapwise compare`: how well repeated reports of one machine agree.

use crate::args::Compare;
use crate::exit::Outcome;
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{output, shell};
use sapwise_lab::compare::{Comparison, CrossoverSpread, Losses, STEEP, Spread, steady};
use sapwise_lab::data::read_reports;
use sapwise_lab::steadiness::Steadiness;
use sapwise_lab::text::grouped;

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
    let comparison = Comparison::of(&reports)?;
    if arguments.json {
        output::print_json(&comparison)?;
    } else {
        let told = left_out
            .iter()
            .map(|name| format!("{name} is left out: its cores were elsewhere or moved, or where they were is unknown\n"));
        let reports: Vec<String> = arguments.reports.iter().map(|path| shell::path(path)).collect();
        let next = format!("\nNext: sapwise study {} --out study", reports.join(" "));
        output::print(&(told.collect::<String>() + &text(&comparison, Terminal::of_standard_output()) + &next))?;
    }
    Ok(Outcome::Done)
}

fn text(comparison: &Comparison, terminal: Terminal) -> String {
    let mut text = format!("{} reports of one machine", comparison.reports);
    if let Some(load) = comparison.foreign_load {
        text.push_str(&format!(", foreign load at most {} at half of the points of each", percent(load)));
    }
    let known: Vec<&Steadiness> = comparison.steadiness.iter().flatten().collect();
    if let Some(first) = known.first() {
        let of = |pick: fn(f64, f64) -> f64| known.iter().map(|s| s.core_to_core_ns).fold(first.core_to_core_ns, pick);
        let moved = known.iter().filter(|s| !s.is_steady()).count();
        text.push_str(&format!(
            "\nlatency between cores {:.0} to {:.0} ns from report to report; it changed within {moved} of them",
            of(f64::min),
            of(f64::max)
        ));
    }
    text.push_str("\n\n");
    let head = ["parameter", "median", "IQR/median", "least to most"].map(str::to_owned).to_vec();
    let rows = comparison.parameters.iter().map(spread);
    text.push_str(&terminal.table(&std::iter::once(head).chain(rows).collect::<Vec<_>>()));
    if !comparison.borders.is_empty() {
        text.push('\n');
        let head = ["crossover", "", "objects", "farthest", "IQR/median", "in its interval", "slope", "reports"];
        let rows = comparison.borders.iter().map(crossover);
        text.push_str(&terminal.table(&std::iter::once(head.map(str::to_owned).to_vec()).chain(rows).collect::<Vec<_>>()));
    }
    if let Some(Losses { own, others, beyond_own, beyond_own_most }) = &comparison.losses {
        text.push_str(&format!(
            "\nMean regret of the tuning of a report: {} on its own timings, {} on those of the others; beyond its own {}, at most {}\n",
            percent(*own),
            percent(*others),
            percent(*beyond_own),
            percent(*beyond_own_most)
        ));
    }
    text
}

fn spread(s: &Spread) -> Vec<String> {
    let over = |v: f64| if s.median == 0.0 { "-".to_owned() } else { format!("{:.3}", v / s.median) };
    vec![
        s.name.clone(),
        format!("{:.4}", s.median),
        s.dispersion.map_or("-".to_owned(), percent),
        format!("{} to {}", over(s.low), over(s.high)),
    ]
}

fn crossover(b: &CrossoverSpread) -> Vec<String> {
    let slope = b
        .slope
        .map_or("-".to_owned(), |slope| format!("{slope:.2} {}", if slope.abs() >= STEEP { "steep" } else { "shallow" }));
    vec![
        b.scenario.clone(),
        format!("{} to {}", b.below, b.above),
        grouped(b.objects.round() as u64),
        percent(b.spread),
        b.dispersion.map_or("-".to_owned(), percent),
        percent(b.within),
        slope,
        b.reports.to_string(),
    ]
}

fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}
