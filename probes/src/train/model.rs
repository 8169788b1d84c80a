//! Puts a model together from the profiles that it is trained on.

use super::PARAMETERS;
use super::fit::methods;
use super::rows::Profile;
use anyhow::{Result, bail};
use sapwise::Model;
use sapwise::model::{ModelSchema, Range, TrainingReport, Validation};

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
        ranges: PARAMETERS.into_iter().filter_map(|p| range(profiles, p)).collect(),
        methods,
        validation: Validation { held_out: String::new(), physical_machines: 0, profiles: 0, methods: Vec::new() },
    };
    if let Some(defect) = model.defect() {
        bail!("no model could be fitted: {defect}; {}", notes.join("; "));
    }
    Ok((model, notes))
}

/// Where a parameter lies in the profiles that have it.
fn range(profiles: &[&Profile], parameter: &str) -> Option<Range> {
    let values = || profiles.iter().filter_map(|p| p.report.hardware.value(parameter));
    let (min, max) = (values().min_by(f64::total_cmp)?, values().max_by(f64::total_cmp)?);
    Some(Range { parameter: parameter.to_owned(), min, max })
}
