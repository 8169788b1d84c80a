//! The loads of a scenario over sizes, with the pairs that it really has.

use anyhow::Context;
use sapwise::{Displacement, Load, Pairs, Registry};
use sapwise_scenes::{Scenario, Scene};

/// Advances to the next frame that has as many objects as the size says.
///
/// Only in `fragmentation` the number changes, and samples of different sizes can't be put together.
pub fn next_frame(scene: &mut Scene) {
    for _ in 0..Scenario::FRAGMENTATION_FRAMES {
        scene.advance();
        if scene.boxes().len() == scene.peak_objects() {
            return;
        }
    }
}

/// The load of a scenario's second frame at each of `sizes`, in numbers of objects. `done` is called with each load as it is known, and ends
/// the work by an error.
///
/// # Errors
/// When the pairs can't be found for want of memory, and those of `done`.
pub fn loads(
    scenario: Scenario,
    sizes: &[u32],
    seed: u64,
    mut done: impl FnMut(&Load) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<Load>> {
    let registry = Registry::with_cores(1);
    let mut counter = registry.create(&"grid-sap@cpu1".parse()?)?;
    let mut pairs = Pairs::new();
    let mut displacement = Displacement::default();
    let mut loads = Vec::new();
    for &objects in sizes {
        let mut scene = scenario.start(objects as usize, seed);
        displacement.watch(scene.boxes());
        next_frame(&mut scene);
        counter
            .find_pairs(scene.boxes(), &mut pairs)
            .with_context(|| format!("the pairs of {scenario} at {objects} objects"))?;
        let moved = displacement.moved(scene.boxes());
        let load = Load::estimate(scene.boxes(), Some(pairs.len() as f64), moved);
        done(&load)?;
        loads.push(load);
    }
    Ok(loads)
}
