//! One machine under one restriction.

use crate::args::Probe;
use crate::contention::Contended;
use crate::restriction::{self, LAVAPIPE_THREADS};

use sapwise::{GpuIdentity, GpuKind, SimdLevel};
use sapwise_lab::report::Restricted;
use sapwise_lab::sweep::Plan;
use sapwise_scenes::Scenario;
use std::path::Path;
use std::time::Duration;

/// What the hardware parameters of the CPU take, with the start of the processes.
const HARDWARE: Duration = Duration::from_secs(8);

/// What a GPU adds, and a software adapter.
const REAL_GPU: Duration = Duration::from_secs(8);
const SOFTWARE_GPU: Duration = Duration::from_secs(25);

/// What is taken from the machine, and how long it is measured.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Profile {
    /// Its part of the file name, such as `avx2-1t`.
    pub(super) name: String,
    /// Threads; `None` for all.
    pub(super) threads: Option<u32>,
    /// SIMD level; `None` for the highest.
    pub(super) simd: Option<SimdLevel>,
    pub(super) contended: Option<Contended>,
    /// The GPUs that are taken.
    pub(super) gpus: Vec<GpuIdentity>,
    /// Threads of lavapipe; `None` for what it takes by itself.
    pub(super) gpu_threads: Option<u32>,
    pub(super) quick: bool,
}

impl Profile {
    /// What is taken from the machine.
    pub(super) fn kinds(&self) -> Vec<Restricted> {
        let mut kinds = Vec::new();
        kinds.extend(self.threads.map(|_| Restricted::Threads));
        kinds.extend(self.simd.map(|_| Restricted::Simd));
        kinds.extend(self.contended.map(restriction::contention));
        kinds.extend(self.gpu_threads.map(|_| Restricted::GpuThreads));
        kinds
    }

    /// The same with one thing less taken.
    pub(super) fn lifted(&self, kind: Restricted) -> Self {
        let mut lifted = self.clone();
        match kind {
            Restricted::Threads => lifted.threads = None,
            Restricted::Simd => lifted.simd = None,
            Restricted::ContendedMemory | Restricted::ContendedCache => lifted.contended = None,
            Restricted::GpuThreads => lifted.gpu_threads = None,
        }
        lifted
    }

    /// Whether the same is taken from the machine, whatever its name and length.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        let taken = |p: &Self| (p.threads, p.simd, p.contended, p.gpu_threads);
        taken(self) == taken(other) && self.gpus == other.gpus
    }

    /// The command that measures it. `numbers` are those of its GPUs, which may have changed since it was listed.
    pub(super) fn arguments(&self, family: &Probe, numbers: &[u32]) -> Vec<String> {
        let mut words = vec!["probe".to_owned(), format!("--seed={}", family.seed)];
        if self.quick {
            words.push("--quick".to_owned());
        }
        words.extend(self.threads.map(|k| format!("--threads={k}")));
        words.extend(self.contended.map(|kind| format!("--contended={kind}")));
        words.extend(numbers.iter().map(|k| format!("--gpu={k}")));
        if numbers.is_empty() {
            words.push("--no-gpus".to_owned());
        }
        words.extend(family.max_objects.map(|n| format!("--max-objects={n}")));
        words.extend(family.scenarios.iter().map(|s| format!("--scenario={s}")));
        words
    }

    /// The variables that it is measured under.
    pub(super) fn variables(&self) -> Vec<(&'static str, String)> {
        let simd = self.simd.map(|level| ("SAPWISE_SIMD", level.to_string()));
        simd.into_iter().chain(self.gpu_threads.map(|k| (LAVAPIPE_THREADS, k.to_string()))).collect()
    }

    /// The most that it should take.
    pub(super) fn time(&self, scenarios: &[Scenario], max_objects: Option<u32>) -> Duration {
        let plan = Plan::new(self.quick, scenarios, max_objects);
        let gpu = |g: &GpuIdentity| if g.kind == GpuKind::Software { SOFTWARE_GPU } else { REAL_GPU };
        plan.total + HARDWARE + self.gpus.iter().map(gpu).sum::<Duration>()
    }
}

/// The beginning of the file names of a machine's profiles.
pub(crate) fn machine_stem(cpu: &str, cores: u32) -> String {
    format!("{}-{cores}c", super::slug::cpu(cpu))
}

/// Whether this is the name of a report of that stem, of whatever day.
pub(super) fn is_named(path: &Path, stem: &str) -> bool {
    let name = path.file_name().and_then(|n| n.to_str());
    let day = name.and_then(|n| n.strip_prefix(stem)?.strip_prefix("--")?.strip_suffix(".json"));
    day.is_some_and(crate::date::is_day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_profiles_and_other_machines_are_told_apart() {
        assert_eq!(machine_stem("AMD EPYC", 2), "amd-epyc-2c");
        let named = |name: &str| is_named(&Path::new("reports").join(name), "amd-epyc-2c-avx2");
        assert!(named("amd-epyc-2c-avx2--2026-11-21.json"));
        for other in ["amd-epyc-2c-avx2-1t--2026-11-21.json", "amd-epyc-2c-avx2--old.json", "amd-epyc-2c-avx2.json", ""]
        {
            assert!(!named(other), "{other}");
        }
    }
}
