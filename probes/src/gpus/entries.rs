//! Which algorithms can be made on the GPUs of this machine, tried without loading a driver into the process that asks.

use crate::child::{Ended, run_part};
use sapwise::gpu::Gpus;
use sapwise::{AlgorithmId, Registry};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Kernels compile in a fraction of a second; a driver may take much longer on its first start.
const LIMIT: Duration = Duration::from_secs(60);

/// An algorithm on GPUs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OnGpus {
    pub(crate) id: AlgorithmId,
    /// Why it can't run here, if it can't.
    pub(crate) unavailable: Option<String>,
}

/// What the process prints: each algorithm in a line.
///
/// # Errors
/// When standard output can't be written.
pub(crate) fn print_entries() -> anyhow::Result<()> {
    let gpus = Gpus::find();
    let mut registry = Registry::with_cores(1);
    registry.add_gpus(&gpus);
    for id in sapwise::gpu::algorithms(gpus.identities()).into_iter().map(|e| e.id) {
        let unavailable = registry.create(&id).err().map(|e| e.to_string());
        crate::output::print_json(&OnGpus { id, unavailable })?;
    }
    Ok(())
}

/// The algorithms that could be tried, and what kept the process from trying the others.
///
/// # Errors
/// When no process can be started.
pub(crate) fn entries() -> anyhow::Result<(Vec<OnGpus>, Option<String>)> {
    let mut entries: Vec<OnGpus> = Vec::new();
    let ended = run_part(&["gpu-algorithms"], LIMIT, &mut |line| {
        entries.extend(serde_json::from_str::<OnGpus>(line));
        Ok(())
    })?;
    let why = match ended {
        Ended::Well => None,
        Ended::Interrupted => Some("interrupted while its drivers were loaded".to_owned()),
        Ended::Badly(how) => Some(format!("the process that loaded its drivers {how}")),
    };
    Ok((entries, why))
}
