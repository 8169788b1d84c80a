//! GPUs as a source of algorithms for a [`Registry`].

use super::adapters::Gpus;
use super::failure::unavailable;
use super::methods::{algorithms, has_method};
use super::on_gpus::OnGpus;
use crate::algorithm::{AlgorithmId, Backend};
use crate::broad_phase::BroadPhase;
use crate::entry::Entry;
use crate::error::{Error, GpuError};
#[cfg(feature = "this-machine")]
use crate::hardware::GpuIdentity;
use crate::registry::{AlgorithmSource, Registry};

impl AlgorithmSource for Gpus {
    fn entries(&self) -> Vec<Entry> {
        algorithms(self.identities())
    }

    /// Also makes the methods on sets of GPUs that are not listed.
    fn create(&self, id: &AlgorithmId) -> Option<Result<Box<dyn BroadPhase>, Error>> {
        let Backend::Gpu(indices) = id.backend() else { return None };
        has_method(id.method()).then(|| {
            let opened = indices.iter().map(|&k| self.open(k)).collect::<Result<Vec<_>, GpuError>>();
            OnGpus::on(id, opened.map_err(|e| unavailable(id, e))?)
        })
    }
}

impl Registry {
    /// Adds our algorithms on these GPUs: on each of them, and on the first two, the first three and so on together.
    /// They replace those of GPUs that were added earlier.
    ///
    /// No GPU is opened before an algorithm on it is created.
    pub fn add_gpus(&mut self, gpus: &Gpus) {
        self.add_source(gpus.clone());
    }

    /// Returns the identities of the GPUs that were added.
    #[cfg(feature = "this-machine")]
    pub(crate) fn gpu_identities(&self) -> Vec<GpuIdentity> {
        self.source::<Gpus>().map_or_else(Vec::new, |gpus| gpus.identities().cloned().collect())
    }
}
