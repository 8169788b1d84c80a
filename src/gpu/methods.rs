//! Which methods run on GPUs, and on which GPUs together.

use crate::hardware::{GpuIdentity, GpuKind};
use crate::{AlgorithmId, Backend};

/// A method on GPUs: one row here puts it into every test, probe, sweep and plot.
pub(crate) struct Method {
    /// The part of the id before the `@`.
    pub(crate) name: &'static str,
    /// Counts up when its speed changes.
    pub(crate) revision: u32,
}

/// Every method, the simplest first.
pub(crate) const METHODS: &[Method] =
    &[Method { name: "brute", revision: 1 }, Method { name: "sweep", revision: 1 }, Method { name: "strips", revision: 1 }];

/// Our algorithms on these GPUs with their revisions: each method on each GPU alone, and on the first two, three and so on
/// together. Programs that act as GPUs work with each other only.
#[must_use]
pub fn algorithms<'a>(gpus: impl IntoIterator<Item = &'a GpuIdentity>) -> Vec<(AlgorithmId, u32)> {
    let (software, hardware): (Vec<_>, Vec<_>) = gpus.into_iter().partition(|g| g.kind == GpuKind::Software);
    let mut sets: Vec<Vec<u32>> = Vec::new();
    for class in [hardware, software] {
        let indices: Vec<u32> = class.iter().map(|g| g.index).collect();
        sets.extend(indices.iter().map(|&k| vec![k]));
        sets.extend((2..=indices.len()).map(|k| indices[..k].to_vec()));
    }
    let on = |set: &Vec<u32>| {
        let set = set.clone();
        METHODS.iter().filter_map(move |m| Some((AlgorithmId::new(m.name, Backend::Gpu(set.clone())).ok()?, m.revision)))
    };
    sets.iter().flat_map(on).collect()
}
