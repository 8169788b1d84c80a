//! Algorithms on some of the GPUs of a machine.

use sapwise::gpu::Gpus;
use sapwise::{GpuIdentity, Registry};
use std::sync::Arc;

/// Adds our algorithms on these GPUs to a registry, and gives for each that can't run here the reason.
///
/// [`Registry::add_gpus`] adds all that there are, programs on the CPU too.
pub(crate) fn register(registry: &mut Registry, gpus: &Gpus, taken: &[GpuIdentity]) -> Vec<String> {
    let mut all = Registry::with_cores(1);
    all.add_gpus(gpus);
    let all = Arc::new(all);
    let mut reasons = Vec::new();
    for (id, revision) in sapwise::gpu::algorithms(taken) {
        let entry = all.entries().iter().find(|e| e.id == id);
        match entry.map(|e| e.unavailable.clone()) {
            Some(None) => {
                let (all, wanted) = (Arc::clone(&all), id.clone());
                registry.add(id, revision, move || all.create(&wanted));
            }
            Some(Some(why)) => reasons.push(format!("{id} can't run here: {why}")),
            None => reasons.push(format!("{id} is not in this build")),
        }
    }
    reasons
}
