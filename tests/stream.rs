//! Boxes of a real engine: cubes that fall, collide and break into pieces in rapier3d, 300 frames of up to 155 boxes.
//!
//! ```sh
//! cargo run --release -p sapwise-example-rapier3d -- --frames 300 --bodies 110 --record tests/fixtures/fragments.npy
//! ```
//!
//! The boxes have the order of rapier's colliders. A new piece takes the position of a removed one, so the same
//! position holds different boxes from frame to frame. The octants of a whole cube touch each other, which no scenario
//! has.

mod common;

use common::{assert_each_finds, every_algorithm, naive};
use sapwise::{Adaptive, BroadPhase, PairOrder, Pairs, Registry, Tuning};
use sapwise_scenes::Frames;
use std::path::Path;

fn frames() -> Frames {
    Frames::read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/fragments.npy"))).unwrap()
}

#[test]
fn fixture_is_as_expected() {
    let frames = frames();
    let counts: Vec<usize> = frames.iter().map(<[_]>::len).collect();
    assert_eq!((counts.len(), counts[0], counts.iter().max(), counts[299]), (300, 85, Some(&155), 5));
    assert_eq!(frames.check(), Ok(()));
    let pairs: usize = frames.iter().map(|boxes| naive(boxes).len()).sum();
    assert!(pairs > 50_000, "{pairs} pairs");
}

#[test]
fn every_algorithm_matches_the_double_loop() {
    let mut algorithms = every_algorithm();
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    for (at, boxes) in frames().iter().enumerate() {
        assert_each_finds(&naive(boxes), &mut algorithms, boxes, &mut pairs, &format!("frame {at}"));
    }
}

#[test]
fn adaptive_matches_the_double_loop() {
    let registry = Registry::with_cores(2);
    let mut adaptive = Adaptive::new(Tuning::usual(&registry), &registry).unwrap();
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    let mut ran = Vec::new();
    for (at, boxes) in frames().iter().enumerate() {
        adaptive.find_pairs(boxes, &mut pairs).unwrap();
        let algorithm = adaptive.last_decision().unwrap().algorithm;
        assert!(pairs.as_slice() == naive(boxes), "{algorithm}, frame {at}");
        if ran.last() != Some(algorithm) {
            ran.push(algorithm.clone());
        }
    }
    assert!(ran.len() > 1, "only {ran:?} ran");
}
