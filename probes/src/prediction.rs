//! Tuning of a machine from its hardware parameters.

use crate::algorithms::Algorithms;
use crate::progress::Progress;
use crate::samples::{Live, Session};
use crate::{interrupt, output, revisions};
use anyhow::bail;
use sapwise::hardware::ParameterId;
use sapwise::model::{ASK, Prediction};
use sapwise::stats::median;
use sapwise::{GpuIdentity, Hardware, Load, Model, Observed, Registry, Source, Tuning};
use sapwise_lab::StoredModel;
use sapwise_lab::belief::{Taken, learn};
use sapwise_lab::data::{Document, read_document};
use sapwise_lab::sweep::loads;
use sapwise_lab::text::count;
use sapwise_scenes::Scenario;
use std::path::Path;

/// Objects of the slice that the tuning shows: four sizes a decade from ten to a million.
const SLICE: std::ops::RangeInclusive<u32> = 4..=24;

/// The number of objects at so many quarters of a decade.
fn size(quarter: u32) -> u32 {
    10.0_f64.powf(f64::from(quarter) / 4.0).round() as u32
}

/// Whether an interval goes from the least to the most objects of the slice.
pub(crate) fn is_whole_slice((low, high): (f64, f64)) -> bool {
    low <= f64::from(size(*SLICE.start())) && high >= f64::from(size(*SLICE.end()))
}

/// Seed of the scenes that the slice goes through.
const SEED: u64 = 1;

/// The loads of a scenario over the number of objects.
pub(crate) struct Slice {
    scenario: Scenario,
    /// Ascending.
    pub(crate) loads: Vec<Load>,
    /// Why there are no more of them.
    cut: Option<String>,
}

impl Slice {
    /// The loads of a scenario, with the pairs that it really has, of as many objects as there is memory for.
    ///
    /// # Errors
    /// On Ctrl-C, and where there is no memory for any.
    pub(crate) fn of(scenario: Scenario) -> anyhow::Result<Self> {
        let sizes: Vec<u32> = SLICE.map(size).collect();
        let progress = Progress::new(sizes.iter().map(|&n| u64::from(n)).sum());
        progress.message(format!("pairs of the scenario {scenario}"));
        let mut known = Vec::new();
        let done = |load: &Load| {
            known.push(*load);
            progress.advance(u64::from(load.objects));
            interrupt::check()
        };
        let found = loads(scenario, &sizes, SEED, done).map(|_| ());
        Self::as_far_as_known(scenario, known, found)
    }

    /// Those that are known, where only memory for more was wanting.
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

/// Puts a sentence in the place of the library's advice for a machine unlike those of training, where `predict --samples` is not what helps.
pub(crate) fn advise(tuning: &mut Tuning, instead: &str) {
    tuning.warnings.iter_mut().filter(|w| *w == ASK).for_each(|w| instead.clone_into(w));
}

/// The model in a file, or the one that is built in, with what training says of it.
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

/// Predicts the tuning of a machine: every algorithm on 1, 2, 4, ... and all of its cores, and on these of its GPUs.
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
    let registry = algorithms.registry(cores(hardware));
    let mut tuning = prediction(model, hardware, gpus, &registry)?.tuning(&slice.scenario.to_string(), &slice.loads);
    tuning.warnings.extend(unknown(algorithms, &registry, model));
    tuning.warnings.extend(slice.cut.clone());
    Ok(tuning)
}

/// Predicts the tuning of this machine and corrects it by up to `most` samples. Also returns whether an algorithm returned a wrong answer.
///
/// Whatever keeps samples from being taken, Ctrl-C too, is a warning: the prediction stays.
///
/// # Errors
/// As [`predict`], and when no process can be started.
pub(crate) fn predict_and_sample(
    model: &Model,
    hardware: &Hardware,
    gpus: &[GpuIdentity],
    slice: &Slice,
    algorithms: &Algorithms,
    most: u32,
) -> anyhow::Result<(Tuning, bool)> {
    let registry = algorithms.registry(cores(hardware));
    let mut prediction = prediction(model, hardware, gpus, &registry)?;
    let Slice { scenario, loads, cut } = slice;
    let session = Session {
        scenario: scenario.to_string(),
        seed: SEED,
        cores: cores(hardware),
        gpus: gpus.to_vec(),
        algorithms: prediction.costs.iter().map(|c| c.algorithm.clone()).collect(),
    };
    let disturbed: Vec<f64> = hardware.parameters.iter().filter_map(|p| p.foreign_load).collect();
    let mut live = Live::new(session, median(&disturbed));
    let costs = prediction.costs.clone();
    let predicted = if prediction.extrapolated { Observed::of_unlike_machine(costs) } else { Observed::new(costs) };
    let learned = learn(predicted, loads, &mut live, most as usize)?;
    let (remarks, wrong) = live.remarks();
    if !learned.usable.contains(&true) {
        bail!("every algorithm failed: {}; --samples 0 predicts without samples", learned.remarks.join("; "));
    }
    prediction.costs = learned.costs();
    let mut tuning = prediction.tuning(&scenario.to_string(), loads);
    tuning.warnings.extend(unknown(algorithms, &registry, model));
    tuning.warnings.extend(cut.clone());
    if !learned.taken.is_empty() {
        tuning.source = Source::Learned;
        tuning.samples = learned.taken.iter().map(Taken::observation).collect();
        // What asked for samples has got them.
        tuning.warnings.retain(|w| w != ASK);
    }
    tuning.warnings.extend(remarks);
    tuning.warnings.extend(learned.remarks);
    if interrupt::requested() {
        let taken = count(learned.taken.len(), "sample");
        tuning.warnings.push(format!("interrupted after {taken}: the prediction is corrected by those only"));
    }
    Ok((tuning, wrong))
}

/// The methods of the model that this build lacks, and the user's methods that the model lacks.
fn unknown(algorithms: &Algorithms, registry: &Registry, model: &Model) -> Vec<String> {
    let mut warnings = revisions::unknown_to(registry, model);
    for (method, _) in algorithms.users() {
        let id = format!("{method}@cpu1").parse();
        if id.is_ok_and(|id| model.method(&id).is_none()) {
            warnings.push(format!(
                "{method} is not predicted: the model {} was trained on reports without it. Measure it with this program: `probe --out own.json`, \
                 `train own.json --out own-model.json`, then `predict --model own-model.json`",
                model.name
            ));
        }
    }
    warnings
}

fn cores(hardware: &Hardware) -> u32 {
    hardware.value(ParameterId::UsableCores).map_or(1, |k| k as u32)
}

/// Costs of every algorithm of the registry and on these GPUs.
fn prediction(
    model: &Model,
    hardware: &Hardware,
    gpus: &[GpuIdentity],
    registry: &Registry,
) -> anyhow::Result<Prediction> {
    let mut known = registry.available();
    known.extend(sapwise::gpu::algorithms(gpus));
    model.predict(hardware, &known).map_err(anyhow::Error::msg)
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
    fn a_slice_ends_where_memory_does_and_no_other_error_is_passed_over() {
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

    #[test]
    fn the_advice_of_the_library_is_replaced_and_no_other_warning() {
        let mut tuning = Tuning::usual(&Registry::with_cores(1));
        tuning.warnings = vec!["left out".to_owned(), ASK.to_owned()];
        advise(&mut tuning, "measure it");
        assert_eq!(tuning.warnings, ["left out", "measure it"]);
    }
}
