//! Trains on all reports of a folder but those of one machine, and prints the regret of choices on one of its reports.
//!
//! ```text
//! cargo run --release -p sapwise-lab --example leave_one_out -- datasets amd-epyc-zen3-2c/full.json
//! ```

use anyhow::{Context, Result};
use sapwise_lab::data::{Selection, read_reports};
use sapwise_lab::evaluate::{Regret, RegretTable, by_costs};
use sapwise_lab::progress::Silent;
use sapwise_lab::spread;
use std::path::Path;

// The tests of the package call `leave_one_out`.
#[cfg(not(test))]
fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().context("name the folder of the reports")?;
    print!("{}", leave_one_out(Path::new(&folder), &arguments.next().context("name the report to hold out")?)?);
    Ok(())
}

/// Returns the regret on a report: of the model that was trained without its machine, and of always choosing each
/// algorithm.
pub(crate) fn leave_one_out(folder: &Path, file: &str) -> Result<String> {
    let reports = read_reports(&[folder.to_owned()], &Silent)?;
    let (profiles, _) = Selection::of(&reports).finish();
    let profile = profiles.iter().find(|p| p.file == file).context("there is no such report to be trained on")?;
    let (model, held_out) = sapwise_lab::without(&profiles, file)?;
    let available = profile.available();
    let costs = model.predict(&profile.hardware, &profile.with_revisions(&available))?.costs;
    let table = RegretTable::new(profile);
    let regret = table.regret(profile, &by_costs(costs, &available));
    let line = |name: &str, regret: &Regret| format!("{name:20} {}\n", spread::percent(regret.mean, regret.range(), 1));
    let mut text = format!(
        "{file}, held out: {held_out}; mean regret (least to largest of a cell)\n{}",
        line("the model", &regret)
    );
    for (algorithm, regret) in profile.algorithms.iter().zip(table.always(None)) {
        text += &line(&algorithm.id.to_string(), &regret);
    }
    Ok(text)
}
