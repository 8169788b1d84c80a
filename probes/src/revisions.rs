//! Whether the algorithms of a file have the revisions of this build.

use sapwise::algorithm::BackendClass;
use sapwise::{AlgorithmId, Registry, Tuning};
use sapwise_lab::Report;
use sapwise_tune::{GpuIdentity, GpuKind, Model};
use std::collections::BTreeSet;

/// Returns why the timings of a report do not hold for this build, one sentence for each method.
pub(crate) fn stale_in_report(report: &Report, registry: &Registry) -> Vec<String> {
    stale(report.algorithms.iter().map(|t| (of(&t.id), t.revision)), registry)
}

/// Returns why a tuning does not hold for this build. One without costs has no revisions.
pub(crate) fn stale_in_tuning(tuning: &Tuning, registry: &Registry) -> Vec<String> {
    stale(tuning.costs.iter().map(|c| (of(&c.algorithm), c.revision)), registry)
}

/// A method on one class of processor, which has one revision.
pub(crate) type Key<'a> = (BackendClass, &'a str);

pub(crate) fn of(id: &AlgorithmId) -> Key<'_> {
    (id.backend().class(), id.method())
}

/// Follows the name of a method that this build lacks.
const ELSEWHERE: &str = "is not in this build: it is of another version, or of a program that adds it";

/// Returns the methods of a model that this build lacks, one sentence for each.
pub(crate) fn unknown_to(registry: &Registry, model: &Model) -> Vec<String> {
    let keys = model.methods.iter().map(|m| (m.backend, m.method.as_str()));
    let unknown = keys.filter(|&key| !is_known(key, registry));
    unknown.map(|key| format!("the model {} knows {}, which {ELSEWHERE}", model.name, name(key))).collect()
}

fn name((class, method): Key<'_>) -> String {
    if class == BackendClass::Cpu { method.to_owned() } else { format!("{method} on a GPU") }
}

/// Returns the methods whose revision is not that of this build, one sentence for each.
pub(crate) fn stale<'a>(used: impl Iterator<Item = (Key<'a>, u32)>, registry: &Registry) -> Vec<String> {
    let sentence = |(key, there): (Key<'a>, u32)| match revision(key, registry) {
        Some(ours) if ours == there => None,
        Some(ours) => Some(format!("{} has revision {there} there and {ours} in this build", name(key))),
        None => Some(format!("{} {ELSEWHERE}", name(key))),
    };
    let stale: BTreeSet<String> = used.filter_map(sentence).collect();
    stale.into_iter().collect()
}

/// Returns whether this build has a method on that class of processor.
pub(crate) fn is_known(key: Key<'_>, registry: &Registry) -> bool {
    revision(key, registry).is_some()
}

/// Returns the revision of a method, which is one on every number of threads, and on every GPU, known without any.
fn revision(key: Key<'_>, registry: &Registry) -> Option<u32> {
    let on_gpus = sapwise_gpu::algorithms(std::iter::once(&any_gpu()));
    registry.entries().iter().chain(&on_gpus).find(|e| of(&e.id) == key).map(|e| e.revision)
}

fn any_gpu() -> GpuIdentity {
    GpuIdentity::new(0, "", GpuKind::Other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn revisions_count_on_cpu_and_gpu_apart_and_without_any_gpu() {
        let registry = Registry::with_cores(1);
        let on_gpu = sapwise_gpu::algorithms(std::iter::once(&any_gpu()))[0].revision;
        let key = |class| (class, "brute");
        assert_eq!(stale(std::iter::once((key(BackendClass::Gpu), on_gpu)), &registry), Vec::<String>::new());
        let told = stale(std::iter::once((key(BackendClass::Gpu), 999)), &registry);
        assert!(told[0].starts_with("brute on a GPU has revision 999"), "{told:?}");
        let told = stale(std::iter::once((key(BackendClass::Cpu), 999)), &registry);
        assert!(told[0].starts_with("brute has revision 999"), "{told:?}");
    }
}
