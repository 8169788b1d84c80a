//! Puts a model together from the profiles that it is trained on.

use super::fit::Designs;
use super::profile::Profile;
use super::{GPU_PARAMETERS, PARAMETERS};
use anyhow::{Result, bail};
use sapwise::model::{GPU_PREFIX, ModelSchema, Range, TrainingCount, TrainingReport, Validation};
use sapwise::report::Label;
use sapwise::{Backend, GpuHardware, Model};
use std::collections::{BTreeMap, BTreeSet};

/// Reports that a model lists; of more it keeps the counts. One takes 130 bytes, and whoever links the library carries the file.
pub(super) const MOST_LISTED: usize = 400;

/// A model of the chosen profiles, without validation, and what was left out and why.
///
/// # Errors
/// When no method could be fitted, or a regression fails.
pub(crate) fn model(
    profiles: &[Profile],
    designs: &Designs<'_>,
    chosen: &[bool],
    name: &str,
) -> Result<(Model, Vec<String>)> {
    let (methods, notes) = designs.fit(chosen)?;
    let profiles: Vec<&Profile> = profiles.iter().zip(chosen).filter(|(_, chosen)| **chosen).map(|(p, _)| p).collect();
    let (trained_on, trained_on_counts) = trained_on(&profiles);
    let model = Model {
        schema: ModelSchema,
        name: name.to_owned(),
        trained_on,
        trained_on_counts,
        ranges: ranges(&profiles),
        methods,
        prior: None,
        validation: Validation::default(),
        clouds: Vec::new(),
        folds: Vec::new(),
    };
    if let Some(defect) = model.defect() {
        bail!("no model could be fitted: {}", [vec![defect], notes].concat().join("; "));
    }
    Ok((model, notes))
}

/// The reports one by one, or their counts where they are too many.
fn trained_on(profiles: &[&Profile]) -> (Vec<TrainingReport>, Vec<TrainingCount>) {
    if profiles.len() <= MOST_LISTED {
        let report =
            |p: &&Profile| TrainingReport { file: p.file.clone(), physical_id: p.machine().to_owned(), label: p.label };
        return (profiles.iter().map(report).collect(), Vec::new());
    }
    // By the name of the label, since labels have no order.
    let mut kinds: BTreeMap<String, (Label, usize, BTreeSet<&str>)> = BTreeMap::new();
    for profile in profiles {
        let kind = kinds.entry(format!("{:?}", profile.label)).or_insert((profile.label, 0, BTreeSet::new()));
        kind.1 += 1;
        kind.2.insert(profile.machine());
    }
    let count = |(label, reports, machines): (Label, usize, BTreeSet<&str>)| TrainingCount {
        label,
        reports,
        physical_machines: machines.len(),
    };
    (Vec::new(), kinds.into_values().map(count).collect())
}

/// Where the parameters lie in the profiles that have them: those of the machine, then those of the GPUs that were timed.
fn ranges(profiles: &[&Profile]) -> Vec<Range> {
    let machine = PARAMETERS
        .into_iter()
        .filter_map(|name| range(name.to_owned(), profiles.iter().filter_map(|p| p.hardware.value(name)).collect()));
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
pub(super) fn timed_gpus(profile: &Profile) -> impl Iterator<Item = &GpuHardware> {
    let used = |k: u32| {
        let on = |backend: &Backend| matches!(backend, Backend::Gpu(list) if list.contains(&k));
        profile.algorithms.iter().any(|t| on(t.id.backend()))
    };
    profile.hardware.gpus.iter().filter(move |g| used(g.gpu.index))
}
