//! Runs each CPU method over the same frames, for `tools/instructions.py`, which counts their instructions under
//! callgrind.
//!
//! ```sh
//! cargo run --release --example instructions -- uniform portable
//! ```

use sapwise::algorithm::SimdLevel;
use sapwise::{Aabb, AlgorithmId, BroadPhase, Pairs, Registry};
use sapwise_scenes::Scenario;
use std::error::Error;

const METHODS: [&str; 5] = ["brute", "sap", "grid-sap", "bvh", "pair-cache"];
const OBJECTS: usize = 2000;
/// Enough for `pair-cache` to settle on a margin.
const WARM_UP_FRAMES: usize = 32;
const MEASURED_FRAMES: usize = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [scenario, simd] = &words[..] else { return Err("usage: instructions SCENARIO SIMD_LEVEL".into()) };
    let mut registry = Registry::with_cores(1);
    registry.limit_simd(simd.parse::<SimdLevel>()?);
    registry.ignore_clock();
    let frames = frames(scenario.parse()?);
    for method in METHODS {
        let mut algorithm = registry.create(&format!("{method}@cpu1").parse::<AlgorithmId>()?)?;
        let mut pairs = Pairs::new();
        let (warm_up, measured) = frames.split_at(WARM_UP_FRAMES);
        for boxes in warm_up {
            algorithm.find_pairs(boxes, &mut pairs)?;
        }
        let found = measured_frames(&mut *algorithm, measured, &mut pairs)?;
        println!("{method} {found}");
    }
    Ok(())
}

fn frames(scenario: Scenario) -> Vec<Vec<Aabb>> {
    let mut scene = scenario.start(OBJECTS, 1);
    let mut frames = Vec::new();
    for _ in 0..WARM_UP_FRAMES + MEASURED_FRAMES {
        frames.push(scene.boxes().to_vec());
        scene.advance();
    }
    frames
}

/// Returns the number of pairs in all frames. Callgrind counts what happens in here, by the name of the function.
#[inline(never)]
fn measured_frames(
    algorithm: &mut dyn BroadPhase,
    frames: &[Vec<Aabb>],
    pairs: &mut Pairs,
) -> Result<usize, sapwise::Error> {
    let mut found = 0;
    for boxes in frames {
        algorithm.find_pairs(boxes, pairs)?;
        found += pairs.len();
    }
    Ok(found)
}
