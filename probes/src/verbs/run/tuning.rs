//! The source of the tuning of a run.

use crate::algorithms::Algorithms;
use crate::args::Run;
use crate::gpus::{self, GpuChoice};
use crate::hardware::measure_hardware;
use crate::prediction::{self, Slice};
use crate::{output, revisions};
use anyhow::{Context, bail};
use sapwise::tuning::Source;
use sapwise::{AlgorithmId, Registry, Tuning};
use sapwise_lab::data::{Document, read_document, usual_scenario};
use sapwise_lab::fit::measured_tuning;
use sapwise_scenes::Scenario;
use sapwise_tune::{GpuIdentity, measure};
use serde::Serialize;
use std::path::Path;

/// A tuning and its source.
pub(super) struct Origin {
    pub(super) tuning: Tuning,
    pub(super) from: OriginKind,
    /// The processor of the other machine whose report it comes from.
    pub(super) other_machine: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum OriginKind {
    /// A model and the parameters of this machine.
    Prediction,
    /// A tuning file.
    Tuning,
    /// The timings of a report.
    Report,
}

impl Origin {
    /// The source in a few words.
    pub(super) fn text(&self) -> String {
        let Tuning { source, model, .. } = &self.tuning;
        let model = model.as_ref().map_or(String::new(), |name| format!(" by the model {name}"));
        match (self.from, &self.other_machine, source) {
            (OriginKind::Prediction, ..) => format!("predicted for this machine{model}"),
            (OriginKind::Report, Some(cpu), _) => format!("measured on another machine ({cpu})"),
            (OriginKind::Report, None, _) => "measured on this machine".to_owned(),
            (OriginKind::Tuning, _, Source::Default) => "from a file, written by hand".to_owned(),
            (OriginKind::Tuning, _, Source::Predicted) => format!("from a file, predicted{model}"),
            (OriginKind::Tuning, _, Source::Measured) => "from a file, measured".to_owned(),
            (OriginKind::Tuning, ..) => format!("from a file, learned from frames{model}"),
        }
    }
}

/// Predicts a tuning for this machine.
///
/// # Errors
/// When no process can be started, this machine lacks a GPU that `--gpu` names, or the model predicts no algorithm.
pub(super) fn predicted(arguments: &Run, algorithms: &Algorithms) -> anyhow::Result<Origin> {
    let (hardware, measured) = measure_hardware(None, &arguments.gpus)?;
    let model = prediction::model(None)?;
    let slice = Slice::of(Scenario::Uniform)?;
    let mut tuning = prediction::predict(&model.model, &hardware, &measured.usable, &slice, algorithms)?;
    tuning.warnings.extend(measured.remarks);
    Ok(Origin { tuning, from: OriginKind::Prediction, other_machine: None })
}

/// Reads a tuning, or computes one from the timings of a report.
///
/// # Errors
/// When the file is neither, or holds other revisions of the algorithms than this build.
pub(super) fn read(path: &Path, registry: &Registry, choice: &GpuChoice) -> anyhow::Result<Origin> {
    let fresh = |stale: Vec<String>| match &stale[..] {
        [] => Ok(()),
        _ => bail!("{} is stale: {}; predict again or probe again", path.display(), stale.join("; ")),
    };
    match read_document(path, &output::warn)? {
        Document::Tuning(tuning) => {
            fresh(revisions::stale_in_tuning(&tuning, registry))?;
            Ok(Origin { tuning: *tuning, from: OriginKind::Tuning, other_machine: None })
        }
        Document::Report(mut report) => {
            choice.restrict(&mut report);
            fresh(revisions::stale_in_report(&report, registry))?;
            let tuning =
                measured_tuning(&report, usual_scenario(&report), sapwise_tune::Model::built_in().ok().as_ref())
                    .with_context(|| format!("{} yields no tuning", path.display()))?;
            let machine = &report.hardware.machine;
            let here = machine.physical_id == measure::machine().physical_id;
            let other_machine = (!here).then(|| machine.cpu.clone());
            Ok(Origin { tuning, from: OriginKind::Report, other_machine })
        }
        _ => bail!("{} is a model; name a tuning file or a report, or leave out --tuning to predict", path.display()),
    }
}

/// Adds the algorithms on the GPUs that the tuning names and the options admit, and returns why some can't run.
///
/// # Errors
/// When no process can be started.
pub(super) fn add_gpus(registry: &mut Registry, tuning: &Tuning, choice: &GpuChoice) -> anyhow::Result<Vec<String>> {
    let mut named: Vec<&AlgorithmId> = tuning.algorithms();
    named.retain(|id| !gpus::uses(id).is_empty());
    if named.is_empty() {
        return Ok(Vec::new());
    }
    if choice.no_gpus {
        return Ok(named.into_iter().map(|id| format!("{id} is left out by --no-gpus")).collect());
    }
    let seen = gpus::look()?;
    choice.check(&seen)?;
    let taken: Vec<GpuIdentity> = seen.identities.iter().filter(|g| choice.takes(g)).cloned().collect();
    let mut warnings: Vec<String> = Vec::new();
    for id in named {
        let is_taken = |k: &u32| taken.iter().any(|g| g.index == *k);
        match seen.lacks(gpus::uses(id)) {
            Some(why) => warnings.push(format!("{id} is left out: {why}")),
            None if !gpus::uses(id).iter().all(is_taken) => {
                warnings.push(format!("{id} is left out: name its GPUs with --gpu, or use --software-gpus"));
            }
            None => {}
        }
    }
    if !taken.is_empty() {
        match seen.load() {
            Ok(gpus) => sapwise_gpu::add_to(registry, &gpus.choose(|g| taken.contains(g))),
            Err(why) => warnings.push(why),
        }
    }
    Ok(warnings)
}
