//! Which methods run on GPUs, and on which GPUs together.

use crate::algorithm::{AlgorithmId, Backend};
use crate::entry::Entry;
use crate::hardware::{GpuIdentity, GpuKind};

/// A method on GPUs: one row here puts it into every test, probe, sweep and plot.
struct Method {
    /// The part of the id before the `@`.
    name: &'static str,
    /// Counts up when its speed changes.
    revision: u32,
}

/// Every method, the simplest first.
const METHODS: &[Method] = &[
    Method { name: "brute", revision: 2 },
    Method { name: "sap", revision: 2 },
    Method { name: "grid-sap", revision: 3 },
    Method { name: "bvh", revision: 2 },
];

/// Whether a method runs on GPUs.
#[cfg(feature = "gpu")]
pub(crate) fn has_method(name: &str) -> bool {
    METHODS.iter().any(|m| m.name == name)
}

/// Our algorithms on these GPUs: each method on each GPU alone, and on the first two, three and so on
/// together. Software adapters work with each other only.
#[must_use]
pub fn algorithms<'a>(gpus: impl IntoIterator<Item = &'a GpuIdentity>) -> Vec<Entry> {
    let (software, hardware): (Vec<_>, Vec<_>) = gpus.into_iter().partition(|g| g.kind == GpuKind::Software);
    let mut sets: Vec<Vec<u32>> = Vec::new();
    for class in [hardware, software] {
        let indices: Vec<u32> = class.iter().map(|g| g.index).collect();
        sets.extend(indices.iter().map(|&k| vec![k]));
        sets.extend((2..=indices.len()).map(|k| indices[..k].to_vec()));
    }
    let on = |set: &Vec<u32>| {
        let set = set.clone();
        METHODS.iter().filter_map(move |m| {
            Some(Entry::new(AlgorithmId::new(m.name, Backend::Gpu(set.clone())).ok()?, m.revision))
        })
    };
    sets.iter().flat_map(on).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gpus_work_alone_and_with_their_like() {
        let gpu = |index, kind| GpuIdentity {
            index,
            name: String::new(),
            device: String::new(),
            driver: String::new(),
            api: String::new(),
            kind,
        };
        let gpus = [
            gpu(0, GpuKind::Discrete),
            gpu(1, GpuKind::Integrated),
            gpu(2, GpuKind::Software),
            gpu(3, GpuKind::Software),
        ];
        let ids = algorithms(&gpus).into_iter().map(|entry| entry.id.to_string());
        let strips: Vec<String> = ids.filter(|id| id.starts_with("grid-sap")).collect();
        assert_eq!(
            strips,
            ["grid-sap@gpu0", "grid-sap@gpu1", "grid-sap@gpu0+1", "grid-sap@gpu2", "grid-sap@gpu3", "grid-sap@gpu2+3"]
        );
        assert!(algorithms(&[]).is_empty());
    }
}
