//! The fastest broad phase of this machine, without a benchmark.
//!
//! ```sh
//! cargo run --release -p sapwise-tune --example this_machine
//! ```
//!
//! The first start measures the hardware in two seconds, predicts what each algorithm costs and keeps that in the
//! user's cache folder. The second start reads it from there.

use sapwise::{Aabb, BroadPhase, Pairs};
use sapwise_tune::StartOptions;
use std::error::Error;

/// Returns cubes, each of which circles around its own point.
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
    // By default this returns at once, and frames run with the usual tuning until a background thread has measured.
    let mut broad_phase = sapwise_tune::for_this_machine(&StartOptions::new().background(false))?;
    let setup = broad_phase.setup();
    println!("tuning: {:?} after {:.2} s, file {:?}", setup.origin, setup.seconds, setup.file);
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
            let expected = decision.predicted_ns.map_or("no time".to_owned(), |ns| format!("{:.1} µs", ns / 1000.0));
            let measured = decision.measured_ns.map_or("not timed".to_owned(), |ns| format!("{:.1} µs", ns / 1000.0));
            let (algorithm, reason) = (decision.algorithm, decision.reason);
            println!(
                "{objects} objects, {} pairs: {algorithm} ({reason:?}), expected {expected}, took {measured}",
                pairs.len()
            );
        }
    }
    // The next start begins with what these frames have taught.
    broad_phase.save()?;
    Ok(())
}
