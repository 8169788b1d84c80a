//! The loads of a scenario over sizes, with the real number of pairs.

use anyhow::Context;
use sapwise::algorithm::{Displacement, Load};
use sapwise::{Pairs, Registry};
use sapwise_scenes::{Scenario, Scene};

/// Advances to the next frame with all objects. Only `fragmentation` has others.
pub fn next_frame(scene: &mut Scene) {
    for _ in 0..Scenario::FRAGMENTATION_FRAMES {
        scene.advance();
        if scene.boxes().len() == scene.peak_objects() {
            return;
        }
    }
}

/// Returns the load of a scenario's second frame at each of `sizes`, in numbers of objects. Calls `done` with each
/// one; an error of it ends the work.
///
/// # Errors
/// When memory for the pairs is lacking, and those of `done`.
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
        let motion = displacement.motion(scene.boxes());
        let load = Load::estimate(scene.boxes(), Some(pairs.len() as f64), motion);
        done(&load)?;
        loads.push(load);
    }
    Ok(loads)
}
