//! Checks of tuning.

use super::{Finding, Here};
use crate::gpus::uses;
use crate::revisions;
use sapwise::{AlgorithmId, Backend, GpuKind, Tuning};

impl Here {
    pub(super) fn tuning(&self, tuning: &Tuning, finding: &mut Finding) {
        finding.schema = Some("tuning/2");
        finding.set_current(
            revisions::stale_in_tuning(tuning, &self.registry),
            "predict again, or probe again where they were measured",
        );
        let mut wanted = tuning.algorithms();
        wanted.extend(tuning.steps.iter().map(|s| &s.algorithm));
        let mut missing: Vec<String> = wanted.into_iter().filter_map(|id| self.unavailable(id)).collect();
        missing.sort_unstable();
        missing.dedup();
        finding.applicable = Some(missing.is_empty());
        finding.problems.extend(missing);
        finding.notes.extend(self.on_software_adapters(tuning));
        if tuning.extrapolated {
            finding.notes.push("predicted for a machine outside what the model was trained on".to_owned());
        }
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
        let mut notes = Vec::new();
        for id in tuning.algorithms().into_iter().filter(|id| !uses(id).is_empty()) {
            let gpus = self.gpus().identities.iter().filter(|g| uses(id).contains(&g.index));
            for gpu in gpus.filter(|g| g.kind == GpuKind::Software) {
                notes.push(format!("{id}: gpu{} is a software adapter here: {}", gpu.index, gpu.name));
            }
        }
        notes
    }
}
