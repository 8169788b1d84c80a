//! Tuning of a machine from its hardware parameters.

use crate::algorithms::Algorithms;
use crate::progress::Progress;
use crate::revisions;
use crate::samples::{self, Live, Order, Taken};
use crate::table::count;
use anyhow::{Context, bail};
use sapwise::hardware::ParameterId;
use sapwise::model::{ASK, FEWEST_MACHINES, Prediction};
use sapwise::{Displacement, Tuning, GpuIdentity, Hardware, Load, Model, Pairs, Prior, Registry, Scenario};

/// Objects of the slice that the tuning shows: four sizes a decade from ten to a million.
const SLICE: std::ops::RangeInclusive<u32> = 4..=24;

/// Seed of the scenes that the slice goes through.
const SEED: u64 = 1;

/// The loads of a scenario over the number of objects.
pub(crate) struct Slice {
    scenario: Scenario,
    /// Ascending.
    pub(crate) loads: Vec<Load>,
}

impl Slice {
    /// The loads of a scenario, with the pairs that it really has.
    ///
    /// # Errors
    /// As [`loads`].
    pub(crate) fn of(scenario: Scenario) -> anyhow::Result<Self> {
        let sizes: Vec<u32> = SLICE.map(|quarter| 10.0_f64.powf(f64::from(quarter) / 4.0).round() as u32).collect();
        Ok(Self { scenario, loads: loads(scenario, &sizes, SEED)? })
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
    tuning.warnings.extend(revisions::unknown_to(&registry, model));
    Ok(tuning)
}

/// Predicts the tuning of this machine and corrects them by up to `most` samples. Also gives whether an algorithm gave a wrong answer.
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
    let Slice { scenario, loads } = slice;
    let order = Order {
        scenario: scenario.to_string(),
        seed: SEED,
        cores: cores(hardware),
        gpus: gpus.to_vec(),
        algorithms: prediction.costs.iter().map(|c| c.algorithm.clone()).collect(),
    };
    let disturbed: Vec<f64> = hardware.parameters.iter().filter_map(|p| p.foreign_load).collect();
    let mut live = Live::new(order, sapwise::stats::median(&disturbed));
    let prior = model.prior.unwrap_or(Prior::ASSUMED);
    let learned = samples::learn(prediction.costs.clone(), &prior, loads, &mut live, most as usize)?;
    let (remarks, wrong) = live.remarks();
    if !learned.usable.contains(&true) {
        bail!("no algorithm is left: {}; the pure prediction is had by --samples 0", learned.remarks.join("; "));
    }
    let mut usable = learned.usable.iter();
    prediction.costs.retain(|_| usable.next() == Some(&true));
    let mut tuning = prediction.tuning(&scenario.to_string(), loads);
    tuning.warnings.extend(revisions::unknown_to(&registry, model));
    // Without any sample the posterior is the prior, whose spread is that of machines left out and not of the model.
    if !learned.taken.is_empty() {
        let corrected = Tuning::from_posterior(&scenario.to_string(), &learned.posterior, |k| learned.usable[k], loads);
        let samples = learned.taken.iter().map(Taken::observation).collect();
        let Tuning { model: name, extrapolated, warnings, interval_basis, .. } = tuning;
        tuning = Tuning { model: name, extrapolated, warnings, samples, ..corrected };
        // What asked for samples has got them.
        tuning.warnings.retain(|w| w != ASK);
        // What the prior says of a machine never seen was told by too few others to be claimed of this one, sampled or not.
        if model.validation.physical_machines < FEWEST_MACHINES as usize {
            tuning.crossovers.iter_mut().for_each(|b| (b.low, b.high) = (None, None));
            tuning.interval_basis = interval_basis;
        }
    }
    tuning.warnings.extend(remarks);
    tuning.warnings.extend(learned.remarks);
    if crate::interrupt::requested() {
        let taken = count(learned.taken.len(), "sample");
        tuning.warnings.push(format!("interrupted after {taken}: the prediction is corrected by those only"));
    }
    Ok((tuning, wrong))
}

fn cores(hardware: &Hardware) -> u32 {
    hardware.value(ParameterId::UsableCores).map_or(1, |k| k as u32)
}

/// Costs of every algorithm of the registry and on these GPUs.
fn prediction(model: &Model, hardware: &Hardware, gpus: &[GpuIdentity], registry: &Registry) -> anyhow::Result<Prediction> {
    let mut known = registry.available();
    known.extend(sapwise::gpu::algorithms(gpus));
    model.predict(hardware, &known).map_err(anyhow::Error::msg)
}

/// The load of a scenario's second frame at each of some sizes, with the pairs that it really has.
///
/// # Errors
/// When the pairs can't be found, for want of memory, and on Ctrl-C.
pub(crate) fn loads(scenario: Scenario, sizes: &[u32], seed: u64) -> anyhow::Result<Vec<Load>> {
    let registry = Registry::with_cores(1);
    let mut counter = registry.create(&"grid-sap@cpu1".parse()?)?;
    let mut pairs = Pairs::new();
    let mut displacement = Displacement::default();
    let mut loads = Vec::new();
    let progress = Progress::new(sizes.iter().map(|&n| u64::from(n)).sum());
    progress.message(format!("pairs of the scenario {scenario}"));
    for &objects in sizes {
        crate::interrupt::check()?;
        let mut scene = scenario.start(objects as usize, seed);
        displacement.watch(scene.boxes());
        crate::sweep::next_frame(&mut scene);
        counter
            .find_pairs(scene.boxes(), &mut pairs)
            .with_context(|| format!("the pairs of {scenario} at {objects} objects"))?;
        let moved = displacement.moved(scene.boxes());
        loads.push(Load::estimate(scene.boxes(), Some(pairs.len() as f64), moved));
        progress.advance(u64::from(objects));
    }
    Ok(loads)
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
}
