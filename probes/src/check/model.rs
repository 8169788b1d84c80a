//! Checks of a model.

use super::{Finding, Here};
use crate::revisions;
use sapwise::hardware::with_unit;
use sapwise::measure::{self, Family, Options};
use sapwise::{BackendClass, How, Model, Parameter, usable_cores};
use sapwise_lab::StoredModel;

impl Here {
    pub(super) fn model(&self, StoredModel { model, training }: &StoredModel, finding: &mut Finding) {
        finding.schema = Some("model/3");
        let used = model.methods.iter().map(|m| ((m.backend, m.method.as_str()), m.revision));
        finding.set_current(revisions::stale(used, &self.registry), "train it again on new reports");
        finding.applicable = Some(finding.current == Some(true));
        let known = training.trained_on.iter().any(|t| t.host.starts_with(&self.machine.physical_id));
        finding.notes.push(if known {
            "trained on a machine like this one".to_owned()
        } else if training.trained_on.is_empty() && !training.trained_on_counts.is_empty() {
            "trained on too many reports to tell whether a machine like this one is among them".to_owned()
        } else {
            "not trained on a machine like this one; `sapwise predict` measures whether it extrapolates here".to_owned()
        });
        if model.simulated {
            finding.notes.push("trained on simulated machines: no evidence of accuracy".to_owned());
        }
        let cores = usable_cores();
        let on_cpu = model.methods.iter().filter(|m| m.backend == BackendClass::Cpu);
        let most = on_cpu.map(|m| m.max_threads).max().unwrap_or(0);
        if cores > most {
            finding.notes.push(format!("extrapolates: trained on up to {most} threads, this machine has {cores}"));
        }
        finding.notes.extend(outside(model));
    }
}

/// In which parameters that the system reports this machine lies outside the training. Those that take seconds to measure
/// are left to `predict`.
fn outside(model: &Model) -> Vec<String> {
    let quick = Options::default().brief(true);
    let families = [Family::Topology, Family::Caches].into_iter();
    let parameters: Vec<Parameter> = families.flat_map(|f| measure::family(f, &quick)).collect();
    let mut notes = Vec::new();
    for range in &model.ranges {
        let reported = parameters.iter().find(|p| p.name == range.parameter && p.how == How::Reported);
        let Some(value) = reported.and_then(|p| p.value) else { continue };
        // The same tolerance as that of a prediction.
        if value < range.min / 1.1 || value > range.max * 1.1 {
            let parameter = &range.parameter;
            let [value, least, most] = [value, range.min, range.max].map(|figure| with_unit(parameter, figure));
            notes.push(format!("extrapolates: {parameter} is {value}, in training it was {least} to {most}"));
        }
    }
    notes
}
