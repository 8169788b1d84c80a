//! The algorithms that run on the GPUs of this machine, tried in another process that loads the drivers.

use super::choice::uses;
use super::parameters::inert;
use crate::child::{Ended, answers};
use sapwise::error::{GpuErrorKind, Unavailable};
use sapwise::{Aabb, AlgorithmId, BroadPhase, Error, Pairs, Registry};
use sapwise_gpu::Gpus;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Kernels compile in a fraction of a second; the first start of a driver may take much longer.
const LIMIT: Duration = Duration::from_secs(60);

/// An algorithm on GPUs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OnGpus {
    pub(crate) id: AlgorithmId,
    /// The reason why it can't run here, if any.
    pub(crate) unavailable: Option<String>,
    /// A sentence about a GPU of it that executes nothing, if one does so.
    pub(crate) inert: Option<String>,
}

/// Prints each algorithm in a line.
///
/// # Errors
/// When standard output can't be written.
pub(crate) fn print_entries() -> anyhow::Result<()> {
    let gpus = Gpus::find();
    let mut registry = Registry::with_cores(1);
    sapwise_gpu::add_to(&mut registry, &gpus);
    for id in sapwise_gpu::algorithms(gpus.identities()).into_iter().map(|e| e.id) {
        let error = registry.create(&id).and_then(|mut algorithm| try_out(algorithm.as_mut())).err();
        let gpu = match &error {
            Some(Error::Unavailable { reason: Unavailable::Gpu(why), .. }) if why.kind() == GpuErrorKind::Inert => gpus
                .identities()
                .find(|gpu| uses(&id).contains(&gpu.index) && gpus.open(gpu.index).is_ok_and(|g| g.fault().is_some())),
            _ => None,
        };
        let (unavailable, inert) = (error.map(|e| e.to_string()), gpu.map(inert));
        crate::output::print_json(&OnGpus { id, unavailable, inert })?;
    }
    Ok(())
}

/// Runs a frame of two boxes: a device that executes nothing compiles everything.
fn try_out(algorithm: &mut dyn BroadPhase) -> Result<(), Error> {
    algorithm.find_pairs(&[Aabb::default(); 2], &mut Pairs::new())
}

/// Returns the algorithms that could be tried, and why the process did not try the others.
///
/// # Errors
/// When no process can be started.
pub(crate) fn entries() -> anyhow::Result<(Vec<OnGpus>, Option<String>)> {
    let (entries, ended) = answers(&["gpu-algorithms"], LIMIT)?;
    let why = match ended {
        Ended::Well => None,
        Ended::Interrupted => Some("interrupted while its drivers were loaded".to_owned()),
        Ended::Badly(how) => Some(format!("the process that loaded its drivers {how}")),
    };
    Ok((entries, why))
}
