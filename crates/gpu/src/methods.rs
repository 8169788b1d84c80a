//! The methods that run on GPUs, and the GPUs that work together.

use super::Gpu;
use sapwise::algorithm::{Backend, Entry};
use sapwise::internals::{GpuIdentity, GpuKind};
use sapwise::{AlgorithmId, Error};

/// Name and revision of every method, the simplest first. A row here puts a method into every test, probe, sweep and
/// plot. A revision counts up when the speed changes.
const METHODS: [(&str, u32); 4] = [("brute", 3), ("sap", 3), ("grid-sap", 4), ("bvh", 3)];

/// Returns whether a method runs on GPUs.
pub(super) fn has_method(name: &str) -> bool {
    METHODS.iter().any(|m| m.0 == name)
}

/// Returns the id of a method on GPUs, of which one may be there several times.
///
/// # Errors
/// [`Error::UnknownAlgorithm`] without a GPU, or if `method` is no name.
pub(super) fn id(method: &str, gpus: &[Gpu]) -> Result<AlgorithmId, Error> {
    let mut indices: Vec<u32> = gpus.iter().map(|g| g.identity().index).collect();
    indices.sort_unstable();
    indices.dedup();
    AlgorithmId::new(method, Backend::Gpu(indices))
        .map_err(|e| Error::UnknownAlgorithm { text: method.to_owned(), hint: e.to_string() })
}

/// Returns each method on each of these GPUs alone, and on the first two, the first three and so on together.
/// Software adapters work together with each other only.
pub fn algorithms<'a>(gpus: impl IntoIterator<Item = &'a GpuIdentity>) -> Vec<Entry> {
    let (software, hardware): (Vec<_>, Vec<_>) = gpus.into_iter().partition(|g| g.kind == GpuKind::Software);
    let mut sets: Vec<Vec<u32>> = Vec::new();
    for class in [hardware, software] {
        let indices: Vec<u32> = class.iter().map(|g| g.index).collect();
        sets.extend(indices.iter().map(|&k| vec![k]));
        sets.extend((2..=indices.len()).map(|k| indices[..k].to_vec()));
    }
    let on = |set: Vec<u32>| {
        METHODS.iter().filter_map(move |&(name, revision)| {
            Some(Entry::new(AlgorithmId::new(name, Backend::Gpu(set.clone())).ok()?, revision))
        })
    };
    sets.into_iter().flat_map(on).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gpus_work_alone_and_with_their_like() {
        let kinds = [GpuKind::Discrete, GpuKind::Integrated, GpuKind::Software, GpuKind::Software];
        let gpus: Vec<GpuIdentity> = (0..).zip(kinds).map(|(index, kind)| GpuIdentity::new(index, "", kind)).collect();
        let ids = algorithms(&gpus).into_iter().map(|entry| entry.id.to_string());
        let strips: Vec<String> = ids.filter(|id| id.starts_with("grid-sap")).collect();
        assert_eq!(strips, ["0", "1", "0+1", "2", "3", "2+3"].map(|set| format!("grid-sap@gpu{set}")));
        assert!(algorithms(&[]).is_empty());
    }
}
