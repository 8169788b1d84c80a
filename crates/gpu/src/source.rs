//! GPUs as a source of algorithms for a [`Registry`].

use super::methods::has_method;
use super::on_gpus::OnGpus;
use super::{Gpus, algorithms, unavailable};
use sapwise::algorithm::{AlgorithmSource, Backend, Entry};
use sapwise::error::GpuError;
use sapwise::{AlgorithmId, BroadPhase, Error, Registry};

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

/// Adds the methods on these GPUs to a registry: on each of them, and on the first two, the first three and so on
/// together. They replace those of GPUs that were added earlier.
///
/// No GPU is opened before an algorithm on it is created.
pub fn add_to(registry: &mut Registry, gpus: &Gpus) {
    registry.add_source(gpus.clone());
}
