//! Where the tuning of a run comes from.

use crate::algorithms::Algorithms;
use crate::args::Run;
use crate::gpus::{self, GpuChoice};
use crate::hardware::measure_hardware;
use crate::prediction::{self, Slice};
use crate::{output, revisions};
use anyhow::{Context, bail};
use sapwise::{AlgorithmId, Registry, Source, Tuning, measure};
use sapwise_lab::data::{Document, read_document, usual_scenario};
use sapwise_lab::fit::measured_tuning;
use sapwise_scenes::Scenario;
use serde::Serialize;
use std::path::Path;

/// The tuning, and what is said about it.
pub(super) struct Origin {
    pub(super) tuning: Tuning,
    pub(super) from: OriginKind,
    /// The processor of the other machine whose report it comes from.
    pub(super) other_machine: Option<String>,
}

/// What it was taken from.
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
    /// Where the tuning comes from, in a sentence.
    pub(super) fn text(&self) -> String {
        let Tuning { source, model, .. } = &self.tuning;
        let model = model.as_ref().map_or(String::new(), |name| format!(" by the model {name}"));
        match (self.from, source) {
            (OriginKind::Prediction, _) => format!("predicted for this machine{model}"),
            (OriginKind::Report, _) => match &self.other_machine {
                Some(cpu) => format!("measured on another machine ({cpu})"),
                None => "measured on this machine".to_owned(),
            },
            (OriginKind::Tuning, Source::Default) => "from a file, written by hand".to_owned(),
            (OriginKind::Tuning, Source::Predicted) => format!("from a file, predicted{model}"),
            (OriginKind::Tuning, Source::Measured) => "from a file, measured".to_owned(),
            (OriginKind::Tuning, Source::Learned) => format!("from a file, learned on line{model}"),
            (OriginKind::Tuning, _) => "from a file".to_owned(),
        }
    }
}

/// Tuning predicted for this machine.
///
/// # Errors
/// When no process can be started, a GPU that was asked for is not there, or the model predicts none of the algorithms.
pub(super) fn predicted(arguments: &Run, algorithms: &Algorithms) -> anyhow::Result<Origin> {
    let (hardware, measured) = measure_hardware(None, &arguments.gpus)?;
    let model = prediction::model(None)?;
    let (usable, slice) = (&measured.usable, Slice::of(Scenario::Uniform)?);
    let mut tuning = prediction::predict(&model.model, &hardware, usable, &slice, algorithms)?;
    tuning.warnings.extend(measured.remarks);
    Ok(Origin { tuning, from: OriginKind::Prediction, other_machine: None })
}

/// The tuning of a file, which may be a report whose timings they are measured from.
///
/// # Errors
/// When the file is neither, or tells of other revisions of the algorithms than those of this build.
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
            let tuning = measured_tuning(&report, usual_scenario(&report), sapwise::Model::built_in().ok().as_ref())
                .with_context(|| format!("{} yields no tuning", path.display()))?;
            let machine = &report.hardware.machine;
            let here = machine.physical_id == measure::machine().physical_id;
            let other_machine = (!here).then(|| machine.cpu.clone());
            Ok(Origin { tuning, from: OriginKind::Report, other_machine })
        }
        _ => bail!("{} is a model; name a tuning file or a report, or leave out --tuning to predict", path.display()),
    }
}

/// Adds the algorithms on the GPUs that are taken, where the tuning names any, and returns what keeps some from running.
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
    let mut warnings: Vec<String> = Vec::new();
    let (taken, left_out): (Vec<_>, Vec<_>) = seen.identities.iter().cloned().partition(|g| choice.takes(g));
    for id in named {
        let out = left_out.iter().find(|g| gpus::uses(id).contains(&g.index));
        warnings.extend(seen.lacks(gpus::uses(id)).map(|why| format!("{id} is left out: {why}")));
        warnings.extend(out.map(|g| match choice.only[..] {
            [] => {
                format!(
                    "{id} is left out: gpu{} ({}) is a software adapter; use --software-gpus to run it",
                    g.index, g.name
                )
            }
            _ => format!("{id} is left out: --gpu does not name gpu{}", g.index),
        }));
    }
    if !taken.is_empty() {
        match seen.load() {
            Ok(gpus) => registry.add_gpus(&gpus.choose(|g| taken.contains(g))),
            Err(why) => warnings.push(why),
        }
    }
    Ok(warnings)
}
