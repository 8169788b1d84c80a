//! The hardware parameters of this machine.

use crate::exit::WrongUsage;
use crate::gpus::{self, GpuChoice};
use crate::interrupt;
use crate::progress::Progress;
use sapwise::algorithm::usable_cores;
use sapwise_tune::measure::{self, Family, Options};
use sapwise_tune::{Hardware, Parameter};

/// Measures the parameters of the CPU on at most `threads` cores, in under five seconds, then the GPUs that are
/// taken.
///
/// After Ctrl-C the parameters that were not measured are missing, with the reason. The hardware takes the parameters
/// of the GPUs; whatever else is known of them is the second part of the answer.
///
/// # Errors
/// When no process can be started, or this machine lacks a GPU that `--gpu` names.
pub(crate) fn measure_hardware(threads: Option<u32>, choice: &GpuChoice) -> anyhow::Result<(Hardware, gpus::Measured)> {
    let mut hardware = measure_cpu(threads);
    let mut measured = gpus::measure(choice, threads)?;
    hardware.gpus = std::mem::take(&mut measured.gpus);
    hardware.gpu_groups = std::mem::take(&mut measured.groups);
    Ok((hardware, measured))
}

fn measure_cpu(threads: Option<u32>) -> Hardware {
    let progress = Progress::new(Family::ALL.len() as u64);
    let options = Options::default().with_threads(threads);
    let mut found: Vec<Parameter> = Vec::new();
    for family in Family::ALL {
        progress.message(format!("hardware: {}", family.as_str()));
        if interrupt::requested() {
            let why = "interrupted before it was measured";
            found.extend(family.parameters().iter().map(|p| Parameter::missing(p, why)));
        } else {
            found.extend(measure::family(family, &options));
        }
        progress.advance(1);
    }
    measure::assemble(measure::machine(), found)
}

/// Refuses more threads than this process may use.
///
/// # Errors
/// Names the number of cores.
pub(crate) fn check_threads(threads: Option<u32>) -> Result<(), WrongUsage> {
    let cores = usable_cores();
    match threads {
        Some(threads) if threads > cores => {
            Err(WrongUsage(format!("--threads {threads}: this process may use {cores} cores; use at most {cores}")))
        }
        _ => Ok(()),
    }
}
