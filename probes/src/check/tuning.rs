//! Checks of tuning.

use super::{Finding, Here};
use crate::gpus::uses;
use crate::revisions;
use sapwise::{AlgorithmId, Backend, Error, GpuIdentity, GpuKind, Tuning, Unavailable, usable_cores};

impl Here {
    pub(super) fn tuning(&self, tuning: &Tuning, finding: &mut Finding) {
        finding.schema = Some("tuning/2");
        finding.set_current(
            revisions::stale_in_tuning(tuning, &self.registry),
            "predict again, or probe again where they were measured",
        );
        let mut wanted = tuning.algorithms();
        wanted.extend(tuning.steps.iter().map(|s| &s.algorithm));
        wanted.sort_unstable();
        wanted.dedup();
        let (wide, others): (Vec<_>, Vec<_>) = wanted.into_iter().partition(|id| self.is_too_wide(id));
        let missing: Vec<String> = others.into_iter().filter_map(|id| self.unavailable(id)).collect();
        finding.applicable = Some(missing.is_empty() && wide.is_empty());
        finding.problems.extend(missing);
        if let Some(most) = wide.iter().map(|id| id.threads()).max() {
            let wide: Vec<String> = wide.iter().map(ToString::to_string).collect();
            finding.problems.push(format!(
                "it names up to {most} threads, and {} may be used here: {} can't run; predict again on this machine",
                usable_cores(),
                wide.join(", ")
            ));
        }
        finding.notes.extend(self.on_software_adapters(tuning));
        if tuning.extrapolated {
            finding.notes.push("predicted for a machine outside what the model was trained on".to_owned());
        }
    }

    /// Whether an algorithm wants more threads than there are cores.
    fn is_too_wide(&self, id: &AlgorithmId) -> bool {
        // One that is listed can be told without making it.
        let is_listed = self.registry.entries().iter().any(|e| e.id == *id);
        !is_listed
            && matches!(self.registry.create(id), Err(Error::Unavailable { reason: Unavailable::TooFewCores { .. }, .. }))
    }

    /// Why an algorithm can't run here, if it can't.
    fn unavailable(&self, id: &AlgorithmId) -> Option<String> {
        if let Some(entry) = self.registry.entries().iter().find(|e| e.id == *id) {
            return entry.unavailable.as_ref().map(|why| format!("{id} can't run here: {why}"));
        }
        match id.backend() {
            // The revision check reports an unknown method already, but tuning without costs has no revisions.
            _ if !revisions::is_known(revisions::of(id), &self.registry) => Some(format!("{id} is not in this build")),
            // Ours can be made on any number of threads, a user's only on those that are listed.
            Backend::Cpu(_) => self.registry.create(id).err().map(|e| e.to_string()),
            Backend::Gpu(indices) => self.gpus().lacks(indices).map(|why| format!("{id} can't run here: {why}")),
            _ => Some(format!("{id} can't run here: this version does not know this kind of processor")),
        }
    }

    /// Which algorithms of tuning run on software adapters here.
    fn on_software_adapters(&self, tuning: &Tuning) -> Vec<String> {
        let on_gpus: Vec<&AlgorithmId> = tuning.algorithms().into_iter().filter(|id| !uses(id).is_empty()).collect();
        if on_gpus.is_empty() {
            return Vec::new();
        }
        let note = |gpu: &GpuIdentity| {
            let on_it: Vec<String> =
                on_gpus.iter().filter(|id| uses(id).contains(&gpu.index)).map(ToString::to_string).collect();
            (!on_it.is_empty())
                .then(|| format!("{}: gpu{} is a software adapter here: {}", on_it.join(", "), gpu.index, gpu.name))
        };
        self.gpus().identities.iter().filter(|g| g.kind == GpuKind::Software).filter_map(note).collect()
    }
}
