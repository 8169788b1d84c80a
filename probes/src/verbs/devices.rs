//! `sapwise devices`: what this machine can run.

use crate::args::Devices;
use crate::exit::Outcome;
use crate::{output, table};
use sapwise::{Registry, SimdLevel, usable_cores};
use serde::Serialize;

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    algorithms: Vec<Algorithm>,
    /// Always empty: this version has no GPU backend.
    adapters: [(); 0],
}

#[derive(Serialize)]
struct Algorithm {
    id: String,
    revision: u32,
    available: bool,
    /// Why it is not available.
    reason: Option<String>,
}

pub(crate) fn run(arguments: &Devices) -> anyhow::Result<Outcome> {
    let registry = Registry::new();
    let algorithms: Vec<Algorithm> = registry
        .entries()
        .iter()
        .map(|e| Algorithm {
            id: e.id.to_string(),
            revision: e.revision,
            available: e.unavailable.is_none(),
            reason: e.unavailable.clone(),
        })
        .collect();
    if arguments.json {
        output::print_json(&Answer { algorithms, adapters: [] })?;
    } else {
        output::print(&text(&algorithms))?;
    }
    Ok(Outcome::Done)
}

fn text(algorithms: &[Algorithm]) -> String {
    let mut rows = vec![["algorithm", "revision", "runs here"].map(str::to_owned).to_vec()];
    for a in algorithms {
        let here = a.reason.as_ref().map_or_else(|| "yes".to_owned(), |reason| format!("no: {reason}"));
        rows.push(vec![a.id.clone(), a.revision.to_string(), here]);
    }
    let cores = usable_cores();
    let plural = if cores == 1 { "" } else { "s" };
    format!(
        "{}\n{cores} usable core{plural}, vector instructions: {}.\n\
         This version has no GPU backend, so only algorithms on the CPU are listed.",
        table::columns(&rows),
        SimdLevel::in_use()
    )
}
