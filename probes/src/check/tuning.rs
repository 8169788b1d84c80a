//! Checks of tuning.

use super::{Finding, Here};
use crate::gpus::uses;
use crate::revisions;
use sapwise::{AlgorithmId, Backend, Error, GpuIdentity, GpuKind, Tuning, Unavailable, usable_cores};

/// What keeps an algorithm from running here.
enum Obstacle {
    /// It wants more threads than there are cores.
    Threads,
    /// Anything else, in a sentence.
    Other(String),
}

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
        let (mut missing, mut wide) = (Vec::new(), Vec::new());
        let mut most = 0;
        for id in wanted {
            match self.obstacle(id) {
                None => {}
                Some(Obstacle::Threads) => {
                    most = most.max(id.threads());
                    wide.push(id.to_string());
                }
                Some(Obstacle::Other(why)) => missing.push(why),
            }
        }
        if !wide.is_empty() {
            missing.push(format!(
                "it names up to {most} threads, and {} may be used here: {} can't run; predict again on this machine",
                usable_cores(),
                wide.join(", ")
            ));
        }
        finding.applicable = Some(missing.is_empty());
        finding.problems.extend(missing);
        finding.notes.extend(self.on_software_adapters(tuning));
        if tuning.extrapolated {
            finding.notes.push("predicted for a machine outside what the model was trained on".to_owned());
        }
    }

    /// Why an algorithm can't run here, if it can't.
    fn obstacle(&self, id: &AlgorithmId) -> Option<Obstacle> {
        if let Some(entry) = self.registry.entries().iter().find(|e| e.id == *id) {
            return entry.unavailable.as_ref().map(|why| Obstacle::Other(format!("{id} can't run here: {why}")));
        }
        let why = match id.backend() {
            // The revision check reports an unknown method already, but tuning without costs has no revisions.
            _ if !revisions::is_known(revisions::of(id), &self.registry) => Some(format!("{id} is not in this build")),
            // Ours can be made on any number of threads, a user's only on those that are listed.
            Backend::Cpu(_) => match self.registry.create(id).err()? {
                Error::Unavailable { reason: Unavailable::TooFewCores { .. }, .. } => return Some(Obstacle::Threads),
                error => Some(error.to_string()),
            },
            Backend::Gpu(indices) => self.gpus().lacks(indices).map(|why| format!("{id} can't run here: {why}")),
            _ => Some(format!("{id} can't run here: this version does not know this kind of processor")),
        };
        why.map(Obstacle::Other)
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
