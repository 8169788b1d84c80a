//! The Rust half of `figures.py`: scenes, and the time of the library's own call.
//!
//! `figures scene uniform OBJECTS SEED FRAMES FILE` writes the frames of a scenario from the second on as 32-bit
//! floats. `figures serve FILE ALGORITHM` reads a number of frames from each line of the standard input, and answers
//! with the times of these frames in nanoseconds and the number of pairs. `figures space FILE ALGORITHM` does the same
//! for a space that is set to two frames of the file in turn.

use sapwise::{Aabb, Adaptive, Body, BroadPhase, PairOrder, Pairs, Registry, Space};
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
        ["serve", file, algorithm] => serve(&boxes(file)?, algorithm),
        ["space", file, algorithm] => space(&boxes(file)?, algorithm),
        _ => Err("usage: figures scene SCENARIO OBJECTS SEED FRAMES FILE | figures serve|space FILE ALGORITHM".into()),
    }
}

fn boxes(file: &str) -> Result<Vec<Aabb>, Box<dyn Error>> {
    let bytes = std::fs::read(file)?;
    let floats: Vec<f32> = bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
    Ok(floats.as_chunks().0.iter().map(|&[a, b, c, d, e, f]| Aabb::new([a, b, c], [d, e, f])).collect())
}

/// What `sapwise.pairs` calls, on the same boxes.
fn serve(boxes: &[Aabb], algorithm: &str) -> Result<(), Box<dyn Error>> {
    let mut broad_phase = Adaptive::only(algorithm.parse()?, &Registry::new())?;
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    answer(|| {
        broad_phase.find_pairs(boxes, &mut pairs)?;
        Ok(pairs.len())
    })
}

/// What `sapwise.Space` calls, on the same boxes.
fn space(boxes: &[Aabb], algorithm: &str) -> Result<(), Box<dyn Error>> {
    let (even, odd) = boxes.split_at(boxes.len() / 2);
    let mut space = Space::with(Adaptive::only(algorithm.parse()?, &Registry::new())?);
    let handles = space.insert_all(even, Body::default())?;
    let mut turns = [odd, even].into_iter().cycle();
    answer(|| {
        space.set_all(&handles, turns.next().unwrap_or(even))?;
        space.update()?;
        Ok(space.pairs().len())
    })
}

fn answer(mut frame: impl FnMut() -> Result<usize, sapwise::Error>) -> Result<(), Box<dyn Error>> {
    for line in stdin().lock().lines() {
        let mut pairs = 0;
        for _ in 0..line?.trim().parse::<usize>()? {
            let began = Instant::now();
            pairs = frame()?;
            print!("{} ", began.elapsed().as_nanos());
        }
        println!("{pairs}");
        stdout().flush()?;
    }
    Ok(())
}
