//! What a GPU can take at once, asked by opening it.

use crate::child::{Ended, run_part};
use anyhow::{Context, anyhow};
use sapwise::gpu::Gpus;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Opening takes milliseconds, and seconds where a driver compiles on its first start.
const LIMIT: Duration = Duration::from_secs(30);

/// The limits of a GPU that bound what an algorithm can do on it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Limits {
    /// Most bytes that a kernel can see of one buffer.
    pub(crate) binding_bytes: u64,
    /// Largest buffer.
    pub(crate) buffer_bytes: u64,
    /// Most invocations in a workgroup.
    pub(crate) workgroup_invocations: u32,
    /// Most memory that a workgroup shares.
    pub(crate) workgroup_memory_bytes: u32,
    /// Fewest and most lanes that run in lockstep.
    pub(crate) subgroup_lanes: [u32; 2],
}

/// The limits of a GPU, by opening it in this process.
///
/// # Errors
/// When there is no such GPU or its driver refuses.
pub(crate) fn limits_of(index: u32) -> anyhow::Result<Limits> {
    let gpus = Gpus::find();
    let gpu = gpus.open(index).map_err(|e| anyhow!(e))?;
    let info = gpus.adapter(index).with_context(|| format!("there is no gpu{index} any more"))?.get_info();
    let limits = gpu.limits();
    Ok(Limits {
        binding_bytes: limits.max_storage_buffer_binding_size,
        buffer_bytes: limits.max_buffer_size,
        workgroup_invocations: limits.max_compute_invocations_per_workgroup,
        workgroup_memory_bytes: limits.max_compute_workgroup_storage_size,
        subgroup_lanes: [info.subgroup_min_size, info.subgroup_max_size],
    })
}

/// The limits of a GPU by opening it in a process of its own, or why it can't be used.
///
/// # Errors
/// When no process can be started.
pub(crate) fn limits(index: u32) -> anyhow::Result<Result<Limits, String>> {
    let mut limits: Option<Limits> = None;
    let ended = run_part(&["gpu-limits", &index.to_string()], LIMIT, &mut |line| {
        limits = serde_json::from_str(line).ok().or(limits.take());
        Ok(())
    })?;
    Ok(match (ended, limits) {
        (Ended::Well, Some(limits)) => Ok(limits),
        (Ended::Well, None) => Err("the process that opened it returned no answer".to_owned()),
        (Ended::Interrupted, _) => Err("interrupted while it was opened".to_owned()),
        (Ended::Badly(how), _) => Err(format!("the process that opened it {how}")),
    })
}
