//! Simulated machines: reports made from published specifications through an explicit cost model.
//!
//! They test the code and show how accuracy grows with the number of machines. They are no evidence of how fast any machine is.

mod cost;
mod factors;
mod hardware;
mod loads;
mod machine;
mod pairing;
mod race;
mod specification;

use crate::progress::Progress;
use crate::report::{Label, Provenance, Report, Timed};
use anyhow::Result;
use cost::Costs;
use machine::TrueMachine;
use sapwise::{AlgorithmId, Registry};

pub use loads::Loads;
pub use specification::{Specifications, built_in, read};

/// `machines` machines made from specifications, each with the name of its file less the ending. The same arguments make the same
/// reports.
///
/// # Errors
/// When the specifications make fewer different machines; when the user asked to stop.
pub fn simulate(
    specifications: &Specifications,
    machines: usize,
    loads: &Loads,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Vec<(String, Report)>> {
    let builds = pairing::builds(specifications, machines, seed)?;
    progress.start(builds.len() as u64);
    let report = |build: pairing::Build<'_>| {
        progress.check()?;
        let machine = TrueMachine::new(&build, seed);
        let name = build.name();
        progress.message(&format!("sweep: {name}"));
        let hardware = hardware::hardware(&build, &machine);
        let mut algorithms = Registry::with_cores(build.cpu.threads).available();
        algorithms.extend(sapwise::gpu::algorithms(hardware.gpus.iter().map(|g| &g.gpu)));
        let ids: Vec<AlgorithmId> = algorithms.iter().map(|e| e.id.clone()).collect();
        let points = race::race(&Costs::new(&machine), &ids, loads, seed, &name);
        let report = Report {
            label: Label::Simulated,
            provenance: provenance(&specifications.date, seed),
            hardware,
            algorithms: algorithms.into_iter().map(|e| Timed::new(e.id, e.revision)).collect(),
            points,
            remarks: vec!["simulated: no machine was measured, and no algorithm has run".to_owned()],
        };
        progress.advance(1);
        Ok((name, report))
    };
    builds.into_iter().map(report).collect()
}

fn provenance(date: &str, seed: u64) -> Provenance {
    Provenance {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        date: date.to_owned(),
        command: format!("simulate --seed {seed}"),
        seed,
        threads: None,
        simd: None,
        gpu_threads: None,
        restriction: None,
        // The cost model is one of optimised builds, whatever this one is.
        optimised: true,
        seconds: 0.0,
    }
}

#[cfg(test)]
mod tests;
