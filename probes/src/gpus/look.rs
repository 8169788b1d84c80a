//! The search for GPUs.

use crate::child::{Ended, answers};
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
    let (identities, ended) = answers(&["gpus"], LIMIT)?;
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
        let (before, now) = (names(self.identities.iter()), names(gpus.identities()));
        let now = if now.is_empty() { "none".to_owned() } else { now };
        Err(format!("GPUs are left out: {before} were seen first and {now} now"))
    }

    /// Returns which of these GPUs this machine lacks, in a sentence, if any.
    pub(crate) fn lacks(&self, indices: &[u32]) -> Option<String> {
        let absent = indices.iter().find(|k| self.identities.iter().all(|g| g.index != **k))?;
        Some(match &self.remark {
            Some(remark) => remark.clone(),
            None if self.identities.is_empty() => format!("this machine has no gpu{absent}: no GPU was found"),
            None => format!("this machine has no gpu{absent}, only {}", names(self.identities.iter())),
        })
    }
}

fn names<'a>(gpus: impl Iterator<Item = &'a GpuIdentity>) -> String {
    gpus.map(|g| format!("gpu{} ({})", g.index, g.name)).collect::<Vec<_>>().join(", ")
}
