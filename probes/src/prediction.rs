//! Fields of a machine from its hardware parameters.

use crate::algorithms::Algorithms;
use crate::revisions;
use anyhow::Context;
use sapwise::hardware::parameter;
use sapwise::{Displacement, Fields, GpuIdentity, Hardware, Load, Model, Pairs, Registry, Scenario};

/// Objects of the slice that the fields show: four sizes a decade from ten to a million.
const SLICE: std::ops::RangeInclusive<u32> = 4..=24;

/// Seed of the scenes that the slice goes through.
const SEED: u64 = 1;

/// Predicts the fields of a machine: every algorithm on 1, 2, 4, ... and all of its cores, and on these of its GPUs.
///
/// # Errors
/// When the model predicts none of the algorithms.
pub(crate) fn predict(
    model: &Model,
    hardware: &Hardware,
    gpus: &[GpuIdentity],
    scenario: Scenario,
    algorithms: &Algorithms,
) -> anyhow::Result<Fields> {
    let cores = hardware.value(parameter::USABLE_CORES).map_or(1, |k| k as u32);
    let registry = algorithms.registry(cores);
    let mut known = registry.available();
    known.extend(sapwise::gpu::algorithms(gpus));
    let prediction = model.predict(hardware, &known).map_err(anyhow::Error::msg)?;
    let mut fields = prediction.fields(&scenario.to_string(), &slice(scenario)?);
    fields.warnings.extend(revisions::unknown_to(&registry, model));
    Ok(fields)
}

/// The load of a scenario over the number of objects, with the pairs that it really has.
///
/// # Errors
/// As [`loads`].
pub(crate) fn slice(scenario: Scenario) -> anyhow::Result<Vec<Load>> {
    let sizes: Vec<u32> = SLICE.map(|quarter| 10.0_f64.powf(f64::from(quarter) / 4.0).round() as u32).collect();
    loads(scenario, &sizes, SEED)
}

/// The load of a scenario's second frame at each of some sizes, with the pairs that it really has.
///
/// # Errors
/// When the pairs can't be found, for want of memory, and on Ctrl-C.
pub(crate) fn loads(scenario: Scenario, sizes: &[u32], seed: u64) -> anyhow::Result<Vec<Load>> {
    let registry = Registry::with_cores(1);
    let mut counter = registry.create(&"strips@cpu1".parse()?)?;
    let mut pairs = Pairs::new();
    let mut displacement = Displacement::default();
    let mut loads = Vec::new();
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
    }
    Ok(loads)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slice_ascends_and_sees_the_density_of_its_scenario() {
        let uniform = slice(Scenario::Uniform).unwrap();
        let clustered = slice(Scenario::Clustered).unwrap();
        assert_eq!(uniform.len(), 21);
        assert!(uniform.is_sorted_by(|a, b| a.objects < b.objects && a.axis_candidates <= b.axis_candidates));
        assert!(clustered[20].pairs > 3.0 * uniform[20].pairs);
        assert!(uniform.iter().all(|l| (0.02..=0.05).contains(&l.moved)), "{uniform:?}");
    }
}
