//! Times what `findPairs` of the npm package does, natively on one thread, for `tools/web.sh bench`.
//!
//! ```sh
//! SAPWISE_SIMD=portable cargo run --release --example find_pairs -- BOXES.f32 CALLS
//! ```
//!
//! Prints the number of pairs, and the milliseconds of the median call. The file holds six 32-bit floats a box.

use sapwise::{Aabb, AlgorithmId, PairOrder, Pairs, Registry};
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [file, calls] = &words[..] else { return Err("usage: find_pairs BOXES.f32 CALLS".into()) };
    let floats: Vec<f32> = std::fs::read(file)?.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let grid: AlgorithmId = "grid-sap@cpu1".parse()?;
    let call = || -> Result<usize, sapwise::Error> {
        let boxes: Vec<Aabb> = black_box(&floats).as_chunks().0.iter().map(aabb).collect();
        let mut pairs = Pairs::with_order(PairOrder::Canonical);
        Registry::with_cores(1).create(&grid)?.find_pairs(&boxes, &mut pairs)?;
        Ok(black_box(pairs.as_slice().to_vec()).len())
    };
    let found = call()?;
    let mut times = Vec::new();
    for _ in 0..calls.parse::<usize>()?.max(1) {
        let start = Instant::now();
        call()?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_unstable_by(f64::total_cmp);
    println!("{found} {}", times[times.len() / 2]);
    Ok(())
}

fn aabb(corners: &[f32; 6]) -> Aabb {
    let [a, b, c, d, e, f] = *corners;
    Aabb::new([a, b, c], [d, e, f])
}
