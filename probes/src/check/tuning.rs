//! Checks of a tuning.

use super::{Finding, Here};
use crate::revisions;
use sapwise::algorithm::{Backend, usable_cores};
use sapwise::{AlgorithmId, Tuning};
use std::collections::BTreeSet;

impl Here {
    pub(super) fn tuning(&self, tuning: &Tuning, finding: &mut Finding) {
        finding.schema = Some("tuning/3");
        finding.set_current(
            revisions::stale_in_tuning(tuning, &self.registry),
            "predict again, or probe again where they were measured",
        );
        let wanted: BTreeSet<&AlgorithmId> =
            tuning.algorithms().into_iter().chain(tuning.steps.iter().map(|s| &s.algorithm)).collect();
        // One line for all that want more threads, however many they are.
        let (wide, others): (Vec<&AlgorithmId>, Vec<&AlgorithmId>) =
            wanted.into_iter().partition(|id| id.threads() > usable_cores());
        let mut missing: Vec<String> = others.into_iter().filter_map(|id| self.obstacle(id)).collect();
        if let Some(most) = wide.iter().map(|id| id.threads()).max() {
            let names: Vec<String> = wide.iter().map(ToString::to_string).collect();
            missing.push(format!(
                "it names up to {most} threads, and {} may be used here: {} can't run; predict again on this machine",
                usable_cores(),
                names.join(", ")
            ));
        }
        finding.applicable = Some(missing.is_empty());
        finding.problems.extend(missing);
        if tuning.extrapolated {
            finding.notes.push("predicted for a machine outside what the model was trained on".to_owned());
        }
    }

    /// Why an algorithm can't run here, if it can't.
    fn obstacle(&self, id: &AlgorithmId) -> Option<String> {
        // The check of revisions names an unknown method too, but a tuning without costs has no revisions.
        if !revisions::is_known(revisions::of(id), &self.registry) {
            return Some(format!("{id} is not in this build"));
        }
        let entry = self.registry.entries().iter().find(|e| e.id == *id);
        let why = match (id.backend(), entry) {
            (Backend::Gpu(indices), _) => self.gpus().lacks(indices),
            (_, Some(entry)) => entry.unavailable.as_ref().map(ToString::to_string),
            // Ours can be made on any number of threads, a user's only on those that are listed.
            (_, None) => self.registry.create(id).err().map(|error| error.to_string()),
        };
        why.map(|why| format!("{id} can't run here: {why}"))
    }
}
