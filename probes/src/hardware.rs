//! The hardware parameters of this machine.

use crate::exit::WrongUsage;
use crate::gpus::{self, GpuChoice};
use crate::interrupt;
use crate::progress::{Progress, Steps as _};
use sapwise::algorithm::usable_cores;
use sapwise_tune::measure::{self, Family, Options};
use sapwise_tune::{Hardware, Parameter};

/// Measures the parameters of the CPU on at most `threads` cores, in under five seconds, then the GPUs that are
/// taken.
///
/// A value that no machine has comes from other programs: the CPU is measured once more then. After Ctrl-C the
/// parameters that were not measured are missing, with the reason. The hardware holds the parameters of the GPUs; the
/// second part of the answer holds all other results about them.
///
/// # Errors
/// When no process can be started, or this machine lacks a GPU that `--gpu` names.
pub(crate) fn measure_hardware(threads: Option<u32>, choice: &GpuChoice) -> anyhow::Result<(Hardware, gpus::Measured)> {
    let mut hardware = measure_cpu(threads);
    if hardware.implausible().is_some() && !interrupt::requested() {
        hardware = measure_cpu(threads);
    }
    let measured = gpus::measure(choice, threads, &mut hardware)?;
    Ok((hardware, measured))
}

fn measure_cpu(threads: Option<u32>) -> Hardware {
    let progress = Progress::new(Family::ALL.len() as u64);
    let options = Options::default().with_threads(threads);
    let mut found: Vec<Parameter> = Vec::new();
    for family in Family::ALL {
        progress.message(&format!("hardware: {}", family.as_str()));
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

/// Refuses hardware with a value that no machine has.
///
/// # Errors
/// States that the machine is busy, and names the first such value.
pub(crate) fn check_plausible(hardware: &Hardware) -> anyhow::Result<()> {
    match hardware.implausible() {
        None => Ok(()),
        Some(why) => anyhow::bail!(
            "this machine is too busy to be measured: {}, measured twice; end other programs and try again",
            why.problem()
        ),
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_tune::Machine;
    use sapwise_tune::hardware::{ParameterId, Statistic};

    #[test]
    fn impossible_values_say_that_the_machine_is_busy() {
        let hardware = |ns| {
            let parameter = Parameter::from_samples(ParameterId::ForkJoinColdNs, Statistic::Median, vec![ns], "test");
            Hardware::new(Machine::default(), vec![parameter])
        };
        assert!(check_plausible(&hardware(60e3)).is_ok());
        let told = check_plausible(&hardware(16_304_526.5)).unwrap_err().to_string();
        assert!(told.contains("busy") && told.contains("fork_join_cold_ns") && !told.contains("unit"), "{told}");
    }
}
