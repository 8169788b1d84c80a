//! The tuning of a machine from its hardware parameters, or from its report.

use crate::algorithms::Algorithms;
use crate::args::Predict;
use crate::check::doubts;
use crate::progress::{Progress, Steps as _};
use crate::{interrupt, output, revisions};
use anyhow::bail;
use sapwise::algorithm::{Load, usable_cores};
use sapwise::{Registry, Tuning};
use sapwise_lab::StoredModel;
use sapwise_lab::data::{Document, read_document, usual_scenario};
use sapwise_lab::fit::measured_tuning;
use sapwise_lab::report::Report;
use sapwise_lab::sweep::loads;
use sapwise_scenes::Scenario;
use sapwise_tune::hardware::ParameterId;
use sapwise_tune::{GpuIdentity, Hardware, Model};
use std::collections::BTreeSet;
use std::path::Path;

/// Sizes of the slice that the tuning shows, in quarters of a decade: from ten objects to a million.
const SLICE: std::ops::RangeInclusive<u32> = 4..=24;

/// Returns the number of objects at a quarter of a decade.
fn size(quarter: u32) -> u32 {
    10.0_f64.powf(f64::from(quarter) / 4.0).round() as u32
}

/// Returns whether an interval spans the whole slice.
pub(crate) fn is_whole_slice((low, high): (f64, f64)) -> bool {
    low <= f64::from(size(*SLICE.start())) && high >= f64::from(size(*SLICE.end()))
}

/// Seed of the scenes of the slice.
const SEED: u64 = 1;

/// The loads of a scenario over the number of objects.
pub(crate) struct Slice {
    scenario: Scenario,
    /// Ascending.
    pub(crate) loads: Vec<Load>,
    /// Why the slice ends early, if it does.
    cut: Option<String>,
}

impl Slice {
    /// Returns the loads of a scenario, with its real pairs, up to the largest size that fits into memory.
    ///
    /// # Errors
    /// On Ctrl-C, and when no size fits into memory.
    pub(crate) fn of(scenario: Scenario) -> anyhow::Result<Self> {
        let sizes: Vec<u32> = SLICE.map(size).collect();
        let progress = Progress::new(sizes.iter().map(|&n| u64::from(n)).sum());
        progress.message(&format!("pairs of the scenario {scenario}"));
        let mut known = Vec::new();
        let done = |load: &Load| {
            known.push(*load);
            progress.advance(u64::from(load.objects));
            interrupt::check()
        };
        let found = loads(scenario, &sizes, SEED, done).map(|_| ());
        Self::as_far_as_known(scenario, known, found)
    }

    /// Keeps the loads that are known if the only error was a lack of memory.
    fn as_far_as_known(scenario: Scenario, loads: Vec<Load>, found: anyhow::Result<()>) -> anyhow::Result<Self> {
        let cut = match (found, loads.last()) {
            (Ok(()), _) => None,
            (Err(error), Some(last)) if matches!(error.downcast_ref(), Some(sapwise::Error::OutOfMemory { .. })) => {
                Some(format!("the tuning shows no more than {} objects, since memory was short: {error}", last.objects))
            }
            (Err(error), _) => return Err(error),
        };
        Ok(Self { scenario, loads, cut })
    }
}

/// Reads the model of a file, or the built-in one, with its training.
///
/// # Errors
/// When the file is no sound model.
pub(crate) fn model(path: Option<&Path>) -> anyhow::Result<StoredModel> {
    let Some(path) = path else { return Ok(StoredModel::built_in()?) };
    match read_document(path, &output::warn)? {
        Document::Model(stored) => Ok(*stored),
        _ => bail!("{} is no model; make one with `sapwise train`", path.display()),
    }
}

/// Predicts the tuning of a machine: every algorithm on 1, 2, 4, ... and all of its cores, and on some of its GPUs.
///
/// # Errors
/// When the model predicts none of the algorithms.
pub(crate) fn predict(
    model: &Model,
    hardware: &Hardware,
    gpus: &[GpuIdentity],
    slice: &Slice,
    algorithms: &Algorithms,
) -> anyhow::Result<Tuning> {
    let cores = hardware.value(ParameterId::UsableCores).map_or(1, |k| k as u32);
    let registry = algorithms.registry(cores);
    let mut known = registry.available();
    known.extend(sapwise_gpu::algorithms(gpus));
    let prediction = model.predict(hardware, &known).map_err(anyhow::Error::msg)?;
    let mut tuning = prediction.tuning(&slice.scenario.to_string(), &slice.loads);
    tuning.warnings.extend(unknown(algorithms, &registry, model));
    tuning.warnings.extend(slice.cut.clone());
    Ok(tuning)
}

/// Predicts the tuning of the machine of a report, or measures it from the timings of the report. Adds warnings about
/// doubts of the report.
///
/// # Errors
/// When the model predicts none of the algorithms, or the report has too few timings.
pub(crate) fn of_report(
    report: &Report,
    arguments: &Predict,
    model: &Model,
    algorithms: &Algorithms,
) -> anyhow::Result<Tuning> {
    let mut tuning = if arguments.measured {
        let mut report = report.clone();
        arguments.gpus.restrict(&mut report);
        let scenario = arguments.scenario.map(|s| s.to_string());
        measured_tuning(&report, scenario.as_deref().unwrap_or_else(|| usual_scenario(&report)), Some(model))?
    } else {
        let gpus = report.hardware.gpus.iter().map(|g| g.gpu.clone());
        let taken: Vec<_> = gpus.filter(|g| arguments.gpus.takes(g)).collect();
        let slice = Slice::of(arguments.scenario.unwrap_or(Scenario::Uniform))?;
        predict(model, &report.hardware, &taken, &slice, algorithms)?
    };
    // The worst first: only the first is shown by default.
    let mut warnings: Vec<String> =
        doubts(report).into_iter().map(|doubt| format!("the report is doubtful: {doubt}")).collect();
    // A prediction does not depend on the timings of the report.
    if arguments.measured {
        let registry = algorithms.registry(usable_cores());
        let stale = revisions::stale_in_report(report, &registry);
        warnings.extend(stale.into_iter().map(|why| format!("the report is stale: {why}; probe again")));
        let timed = |method: &str| report.algorithms.iter().any(|timed| timed.id.method() == method);
        let ids = registry.available().into_iter().map(|entry| entry.id);
        let untimed: BTreeSet<String> = ids.map(|id| id.method().to_owned()).filter(|method| !timed(method)).collect();
        warnings
            .extend(untimed.into_iter().map(|method| format!("{method}: left out, since the report has not timed it")));
    }
    tuning.warnings.splice(0..0, warnings);
    Ok(tuning)
}

/// Returns warnings about methods of the model that this build lacks, and methods of the user that the model lacks.
fn unknown(algorithms: &Algorithms, registry: &Registry, model: &Model) -> Vec<String> {
    let mut warnings = revisions::unknown_to(registry, model);
    for (method, _) in algorithms.users() {
        let id = format!("{method}@cpu1").parse();
        if id.is_ok_and(|id| model.method(&id).is_none()) {
            warnings.push(format!(
                "{method} is not predicted: the model {} was trained on reports without it. Measure it with this \
                 program: `probe --out own.json`, `train own.json --out own-model.json`, then `predict --model \
                 own-model.json`",
                model.name
            ));
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slice_ascends_and_sees_the_density_of_its_scenario() {
        let [uniform, clustered] = [Scenario::Uniform, Scenario::Clustered].map(|s| Slice::of(s).unwrap().loads);
        assert_eq!(uniform.len(), 21);
        assert!(uniform.is_sorted_by(|a, b| a.objects < b.objects && a.axis_candidates <= b.axis_candidates));
        assert!(clustered[20].pairs > 3.0 * uniform[20].pairs);
        assert!(uniform.iter().all(|l| (0.02..=0.05).contains(&l.moved)), "{uniform:?}");
    }

    #[test]
    fn a_slice_ends_with_the_memory_and_other_errors_are_returned() {
        let short =
            || Err(anyhow::Error::from(sapwise::Error::OutOfMemory { what: "boxes", elements: 9 }).context("at 90"));
        let known = vec![Load::of_objects(10), Load::of_objects(50)];
        let slice = Slice::as_far_as_known(Scenario::Uniform, known.clone(), short()).unwrap();
        let told = slice.cut.unwrap();
        assert!(slice.loads.len() == 2 && told.contains("50 objects") && told.contains("at 90"), "{told}");
        assert!(Slice::as_far_as_known(Scenario::Uniform, known.clone(), Ok(())).unwrap().cut.is_none());
        assert!(Slice::as_far_as_known(Scenario::Uniform, Vec::new(), short()).is_err());
        assert!(Slice::as_far_as_known(Scenario::Uniform, known, Err(anyhow::anyhow!("interrupted"))).is_err());
    }
}
