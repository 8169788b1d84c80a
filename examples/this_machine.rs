//! The headline feature: the fastest broad phase of this machine, without a benchmark.
//!
//! ```sh
//! cargo run --release -p sapwise --example this_machine --features this-machine
//! ```
//!
//! The first start measures the hardware in seconds, predicts what each algorithm costs on it and keeps that in the user's cache folder;
//! the second start reads it from there.

use sapwise::{Aabb, Adaptive, BroadPhase, Pairs, StartOptions};
use std::error::Error;

/// A cloud of cubes, each of which turns around a point of its own.
fn boxes(objects: usize, frame: usize) -> Vec<Aabb> {
    let edge = (objects as f32).cbrt().ceil();
    let cube = |k: usize| {
        let (k, turn) = (k as f32, (k + 3 * frame) as f32 * 0.02);
        let cell = [k % edge, (k / edge).floor() % edge, (k / edge / edge).floor()];
        Aabb::cube([cell[0] + 0.3 * turn.sin(), cell[1] + 0.3 * turn.cos(), cell[2]], 0.45)
    };
    (0..objects).map(cube).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    // In the background, which is the default, this would return at once, and frames would run with the usual tuning meanwhile.
    let mut broad_phase = Adaptive::for_this_machine(&StartOptions::new().background(false))?;
    let setup = broad_phase.setup();
    println!("the tuning is {:?}, after {:.2} s, kept in {:?}", setup.origin, setup.seconds, setup.file);
    setup.remarks.iter().for_each(|remark| println!("remark: {remark}"));
    for step in &broad_phase.tuning().steps {
        println!("expected from {} objects up: {}", step.from_objects, step.algorithm);
    }
    let mut pairs = Pairs::new();
    for objects in [10, 100, 1000, 10_000, 30_000] {
        for frame in 0..40 {
            broad_phase.find_pairs(&boxes(objects, frame), &mut pairs)?;
        }
        if let Some(decision) = broad_phase.last_decision() {
            let expected = decision.predicted_ns.map_or("nothing".to_owned(), |ns| format!("{:.1} us", ns / 1000.0));
            let measured = decision.measured_ns.map_or("not timed".to_owned(), |ns| format!("{:.1} us", ns / 1000.0));
            let (algorithm, reason) = (decision.algorithm, decision.reason);
            println!(
                "{objects} objects, {} pairs: {algorithm} ({reason:?}), expected {expected}, took {measured}",
                pairs.len()
            );
        }
    }
    // What the frames have taught is there at the next start.
    broad_phase.save()?;
    Ok(())
}
