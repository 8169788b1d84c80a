//! The parameters of GPUs: another process measures each GPU and each group.

use super::choice::{GpuChoice, uses};
use super::look::look;
use super::parameters::{group_without_parameters, inert, without_parameters};
use crate::child::{Ended, answers};
use crate::progress::{Progress, Steps as _};
use sapwise_lab::text::once;
use sapwise_tune::{GpuGroup, GpuHardware, GpuIdentity, GpuParameterId, Hardware};
use serde::de::DeserializeOwned;
use std::time::Duration;

/// A real GPU takes seconds; a software adapter may be a hundred times slower.
const LIMIT: Duration = Duration::from_secs(90);

/// The GPUs of this machine, without their parameters.
#[derive(Debug, Clone, Default)]
pub(crate) struct Measured {
    /// The taken GPUs that can be used: their process ended well, and they execute kernels.
    pub(crate) usable: Vec<GpuIdentity>,
    /// The GPUs that were not taken.
    pub(crate) left_out: Vec<GpuIdentity>,
    /// Sentences about failures.
    pub(crate) remarks: Vec<String>,
}

/// Looks for GPUs, measures those that are taken, at most a minute and a half for each, and adds their parameters to
/// the hardware.
///
/// # Errors
/// When no process can be started, or a GPU that was asked for by its number is not there.
pub(crate) fn measure(choice: &GpuChoice, threads: Option<u32>, hardware: &mut Hardware) -> anyhow::Result<Measured> {
    let mut measured = Measured::default();
    if choice.no_gpus {
        return Ok(measured);
    }
    if crate::interrupt::requested() {
        measured.remarks.push("GPUs are left out: interrupted before they were looked for".to_owned());
        return Ok(measured);
    }
    let progress = Progress::new(0);
    progress.message("looking for GPUs");
    let seen = look()?;
    choice.check(&seen)?;
    measured.remarks.extend(seen.remark);
    let (taken, left_out): (Vec<_>, Vec<_>) = seen.identities.into_iter().partition(|g| choice.takes(g));
    measured.left_out = left_out;
    // One more for several GPUs together.
    progress.start(taken.len() as u64 + 1);
    for identity in taken {
        progress.message(&format!("hardware: gpu{}", identity.index));
        hardware.gpus.push(measured.gpu(identity, threads)?);
        progress.advance(1);
    }
    progress.message("hardware: several GPUs together");
    hardware.gpu_groups = measured.groups(threads)?;
    Ok(measured)
}

impl Measured {
    fn gpu(&mut self, identity: GpuIdentity, threads: Option<u32>) -> anyhow::Result<GpuHardware> {
        let index = identity.index;
        Ok(match part::<GpuHardware>("gpu", &index.to_string(), threads)? {
            Ok(hardware) if hardware.gpu == identity && hardware.value(GpuParameterId::Executes) == Some(0.0) => {
                self.remarks.push(format!("{}; nothing of it is timed", inert(&identity)));
                hardware
            }
            Ok(hardware) if hardware.gpu == identity => {
                self.usable.push(identity);
                hardware
            }
            Ok(other) => {
                let why = format!("{} has become gpu{index} while it was to be measured", other.gpu.name);
                without_parameters(identity, &why)
            }
            Err(why) => {
                self.remarks.push(format!("gpu{index} ({}) is left out: {why}", identity.name));
                without_parameters(identity, &why)
            }
        })
    }

    /// Measures every set of several GPUs that our algorithms run on.
    fn groups(&mut self, threads: Option<u32>) -> anyhow::Result<Vec<GpuGroup>> {
        let mut groups = Vec::new();
        let algorithms = sapwise_gpu::algorithms(&self.usable);
        let sets = once(algorithms.iter().map(|e| uses(&e.id)).filter(|set| set.len() > 1));
        for set in sets {
            let text = sapwise::algorithm::Backend::Gpu(set.to_vec()).to_string();
            let group = part("gpu-group", &text, threads)?;
            groups.push(group.unwrap_or_else(|why| {
                self.remarks.push(format!("{text} could not be measured together: {why}"));
                group_without_parameters(set, &why)
            }));
        }
        Ok(groups)
    }
}

/// Returns the answer of a part, or why there is none.
fn part<T: DeserializeOwned>(kind: &str, which: &str, threads: Option<u32>) -> anyhow::Result<Result<T, String>> {
    if crate::interrupt::requested() {
        return Ok(Err("interrupted before it was measured".to_owned()));
    }
    let threads = threads.map(|k| k.to_string());
    let mut arguments = vec![kind, which];
    if let Some(threads) = &threads {
        arguments.extend(["--threads", threads]);
    }
    let (mut all, ended) = answers(&arguments, LIMIT)?;
    Ok(match (ended, all.pop()) {
        (Ended::Well, Some(answer)) => Ok(answer),
        (Ended::Well, None) => Err("the process that measured it returned no answer".to_owned()),
        (Ended::Interrupted, _) => Err("interrupted while it was measured".to_owned()),
        (Ended::Badly(how), _) => Err(format!("the process that measured it {how}")),
    })
}
