//! Puts a model together from the profiles that it is trained on.

use super::fit::methods;
use super::rows::Profile;
use super::{GPU_PARAMETERS, PARAMETERS};
use anyhow::{Result, bail};
use sapwise::model::{GPU_PREFIX, ModelSchema, Range, TrainingReport, Validation};
use sapwise::{Backend, GpuHardware, Model};

/// A model of the profiles, without validation, and what was left out and why.
///
/// # Errors
/// When no method could be fitted, or a regression fails.
pub(crate) fn model(profiles: &[&Profile], name: &str) -> Result<(Model, Vec<String>)> {
    let (methods, notes) = methods(profiles)?;
    let training = |p: &&Profile| TrainingReport {
        file: p.file.clone(),
        physical_id: p.report.hardware.machine.physical_id.clone(),
        label: p.report.label,
    };
    let model = Model {
        schema: ModelSchema,
        name: name.to_owned(),
        trained_on: profiles.iter().map(training).collect(),
        ranges: ranges(profiles),
        methods,
        prior: None,
        validation: Validation { held_out: String::new(), physical_machines: 0, profiles: 0, methods: Vec::new() },
    };
    if let Some(defect) = model.defect() {
        bail!("no model could be fitted: {defect}; {}", notes.join("; "));
    }
    Ok((model, notes))
}

/// Where the parameters lie in the profiles that have them: those of the machine, then those of the GPUs that were timed.
fn ranges(profiles: &[&Profile]) -> Vec<Range> {
    let machine = PARAMETERS
        .into_iter()
        .filter_map(|name| range(name.to_owned(), profiles.iter().filter_map(|p| p.report.hardware.value(name)).collect()));
    let timed: Vec<&GpuHardware> = profiles.iter().flat_map(|p| timed_gpus(p)).collect();
    let gpus = GPU_PARAMETERS
        .into_iter()
        .filter_map(|name| range(format!("{GPU_PREFIX}{name}"), timed.iter().filter_map(|g| g.value(name)).collect()));
    machine.chain(gpus).collect()
}

fn range(parameter: String, values: Vec<f64>) -> Option<Range> {
    let min = values.iter().copied().min_by(f64::total_cmp)?;
    let max = values.iter().copied().max_by(f64::total_cmp)?;
    Some(Range { parameter, min, max })
}

/// The GPUs of a profile that an algorithm was timed on.
fn timed_gpus(profile: &Profile) -> impl Iterator<Item = &GpuHardware> {
    let used = |k: u32| {
        let on = |backend: &Backend| matches!(backend, Backend::Gpu(list) if list.contains(&k));
        profile.report.algorithms.iter().any(|t| on(t.id.backend()))
    };
    profile.report.hardware.gpus.iter().filter(move |g| used(g.gpu.index))
}
