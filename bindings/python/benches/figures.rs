//! The Rust half of `figures.py`: scenes, and the time of the library's own call.
//!
//! `figures scene uniform OBJECTS SEED FRAMES FILE` writes the frames of a scenario from the second on as 32-bit
//! floats. `figures serve FILE ALGORITHM` answers each number on a line of the standard input with the times of as many
//! frames, in nanoseconds, and the number of pairs.

use sapwise::{Aabb, Adaptive, BroadPhase, PairOrder, Pairs, Registry};
use sapwise_scenes::Scenario;
use std::error::Error;
use std::io::{BufRead, Write, stdin, stdout};
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["scene", scenario, objects, seed, frames, file] => {
            let scenario: Scenario = scenario.parse()?;
            let mut scene = scenario.start(objects.parse()?, seed.parse()?);
            let mut bytes = Vec::new();
            for _ in 0..frames.parse::<usize>()? {
                scene.advance();
                let floats = scene.boxes().iter().flat_map(|b| b.min.into_iter().chain(b.max));
                bytes.extend(floats.flat_map(f32::to_le_bytes));
            }
            std::fs::write(file, bytes)?;
            Ok(())
        }
        ["serve", file, algorithm] => serve(&std::fs::read(file)?, algorithm),
        _ => Err("usage: figures scene SCENARIO OBJECTS SEED FRAMES FILE | figures serve FILE ALGORITHM".into()),
    }
}

/// What `sapwise.pairs` calls, on the same boxes.
fn serve(bytes: &[u8], algorithm: &str) -> Result<(), Box<dyn Error>> {
    let floats: Vec<f32> = bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
    let boxes: Vec<Aabb> =
        floats.as_chunks().0.iter().map(|&[a, b, c, d, e, f]| Aabb::new([a, b, c], [d, e, f])).collect();
    let mut broad_phase = Adaptive::only(algorithm.parse()?, &Registry::new())?;
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    for line in stdin().lock().lines() {
        for _ in 0..line?.trim().parse::<usize>()? {
            let began = Instant::now();
            broad_phase.find_pairs(&boxes, &mut pairs)?;
            print!("{} ", began.elapsed().as_nanos());
        }
        println!("{}", pairs.len());
        stdout().flush()?;
    }
    Ok(())
}
