//! The hardware parameters of this machine, each family measured in a process of its own.

use crate::child::{Ended, run_part};
use crate::exit::WrongUsage;
use crate::gpus::{self, GpuChoice};
use crate::progress::Progress;
use sapwise::measure::{self, Family};
use sapwise::{Hardware, Parameter, usable_cores};
use std::time::Duration;

/// A family takes a second or less. One that takes this long hangs in a driver or has no processor to run on.
const LIMIT: Duration = Duration::from_secs(15);

/// Measures every family of parameters, on at most `threads` cores, in under five seconds, then the GPUs that are taken.
///
/// A family that crashes, hangs or is interrupted leaves its parameters missing, with the reason. What is told of the GPUs
/// beside their parameters, which move into the hardware, is the second part of the answer.
///
/// # Errors
/// When no process can be started, or a GPU that was asked for by its number is not there.
pub(crate) fn measure_hardware(threads: Option<u32>, choice: &GpuChoice) -> anyhow::Result<(Hardware, gpus::Measured)> {
    let mut hardware = measure_cpu(threads)?;
    let mut measured = gpus::measure(choice, threads)?;
    hardware.gpus = std::mem::take(&mut measured.gpus);
    hardware.gpu_groups = std::mem::take(&mut measured.groups);
    Ok((hardware, measured))
}

fn measure_cpu(threads: Option<u32>) -> anyhow::Result<Hardware> {
    let progress = Progress::new(Family::ALL.into_iter().map(usual_ms).sum());
    let mut found: Vec<Parameter> = Vec::new();
    for family in Family::ALL {
        let name = family.as_str();
        progress.message(format!("hardware: {name}"));
        match measure_family(name, threads)? {
            Ok(parameters) => found.extend(parameters),
            Err(why) => found.extend(family.parameters().iter().map(|p| Parameter::missing(p, &why))),
        }
        progress.advance(usual_ms(family));
    }
    Ok(measure::assemble(measure::machine(), found))
}

/// What a family takes on a machine of two cores, for the time that is left: the latencies of caches take as long as all others together.
fn usual_ms(family: Family) -> u64 {
    match family {
        Family::Topology => 10,
        Family::Clock => 400,
        Family::Caches => 3200,
        Family::Memory => 1000,
        Family::CoreToCore => 200,
        Family::ForkJoin | Family::Scaling => 600,
        _ => 500,
    }
}

/// Refuses more threads than this process may use.
///
/// # Errors
/// Says how many there are.
pub(crate) fn check_threads(threads: Option<u32>) -> Result<(), WrongUsage> {
    let cores = usable_cores();
    match threads {
        Some(threads) if threads > cores => {
            Err(WrongUsage(format!("--threads {threads}: this process may use {cores} cores; use at most {cores}")))
        }
        _ => Ok(()),
    }
}

/// The parameters of a family, or why there are none.
fn measure_family(name: &str, threads: Option<u32>) -> anyhow::Result<Result<Vec<Parameter>, String>> {
    if crate::interrupt::requested() {
        return Ok(Err("interrupted before it was measured".to_owned()));
    }
    let threads = threads.map(|k| k.to_string());
    let mut arguments = vec!["hardware", name];
    if let Some(threads) = &threads {
        arguments.extend(["--threads", threads]);
    }
    let mut text = String::new();
    let ended = run_part(&arguments, LIMIT, &mut |line| {
        text.push_str(line);
        Ok(())
    })?;
    Ok(match ended {
        Ended::Well => {
            serde_json::from_str(&text).map_err(|e| format!("the probe {name} returned an unreadable answer: {e}"))
        }
        Ended::Interrupted => Err("interrupted while it was measured".to_owned()),
        Ended::Badly(how) => Err(format!("the probe {name} {how}")),
    })
}
