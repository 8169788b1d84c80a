//! The search for GPUs.

use crate::child::{Ended, run_part};
use sapwise_gpu::Gpus;
use sapwise_tune::GpuIdentity;
use std::time::Duration;

/// Looking takes tens of milliseconds, and seconds when a driver compiles on its first start.
const LIMIT: Duration = Duration::from_secs(30);

/// The GPUs that another process found.
#[derive(Debug, Clone, Default)]
pub(crate) struct Seen {
    /// Ordered by their numbers.
    pub(crate) identities: Vec<GpuIdentity>,
    /// The reason why the search failed. There are no GPUs then.
    pub(crate) remark: Option<String>,
}

/// Looks for GPUs without loading a driver into this process.
///
/// # Errors
/// When no process can be started.
pub(crate) fn look() -> anyhow::Result<Seen> {
    let mut identities: Vec<GpuIdentity> = Vec::new();
    let ended = run_part(&["gpus"], LIMIT, &mut |line| {
        // Drivers print what they like on the standard output of whoever loads them.
        identities.extend(serde_json::from_str::<GpuIdentity>(line));
        Ok(())
    })?;
    let remark = match ended {
        Ended::Well => return Ok(Seen { identities, remark: None }),
        Ended::Interrupted => "GPUs are left out: interrupted while looking for them".to_owned(),
        Ended::Badly(how) => format!(
            "GPUs are left out: the process that looked for them {how}; update or remove the driver, or use --no-gpus"
        ),
    };
    Ok(Seen { identities: Vec::new(), remark: Some(remark) })
}

impl Seen {
    /// Loads the drivers into this process if there is any GPU. An error is a sentence that says how the GPUs have
    /// changed.
    pub(crate) fn load(&self) -> Result<Gpus, String> {
        if self.identities.is_empty() {
            return Ok(Gpus::none());
        }
        let gpus = Gpus::find();
        if gpus.identities().eq(&self.identities) {
            return Ok(gpus);
        }
        let names = |list: &mut dyn Iterator<Item = &GpuIdentity>| {
            list.map(|g| format!("gpu{} ({})", g.index, g.name)).collect::<Vec<_>>().join(", ")
        };
        let (before, now) = (names(&mut self.identities.iter()), names(&mut gpus.identities()));
        let now = if now.is_empty() { "none".to_owned() } else { now };
        Err(format!("GPUs are left out: {before} were seen first and {now} now"))
    }

    /// Returns which of these GPUs this machine lacks, in a sentence, if any.
    pub(crate) fn lacks(&self, indices: &[u32]) -> Option<String> {
        let absent = indices.iter().find(|k| self.identities.iter().all(|g| g.index != **k))?;
        let there: Vec<String> = self.identities.iter().map(|g| format!("gpu{} ({})", g.index, g.name)).collect();
        Some(match &self.remark {
            Some(remark) => remark.clone(),
            None if there.is_empty() => format!("this machine has no gpu{absent}: no GPU was found"),
            None => format!("this machine has no gpu{absent}, only {}", there.join(", ")),
        })
    }
}
