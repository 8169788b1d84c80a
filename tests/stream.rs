//! Boxes of a real engine: cubes that fall, collide and break into pieces in rapier3d, 300 consecutive frames of up to 155 boxes.
//!
//! Made by
//! ```sh
//! cargo run --release -p sapwise-example-rapier3d -- --frames 300 --bodies 110 --record tests/fixtures/fragments.npy
//! ```
//! In the order in which rapier has its colliders: a piece takes the place of one that was cleared away, so that one place stands for
//! other boxes from one frame to the next; and the octants of a whole cube touch each other, as no scenario of ours does.

mod common;

use common::{every_algorithm, naive};
use sapwise::{Adaptive, BroadPhase, PairOrder, Pairs, Registry, Tuning};
use sapwise_scenes::Frames;
use std::path::Path;

fn frames() -> Frames {
    Frames::read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/fragments.npy"))).unwrap()
}

#[test]
fn the_stream_is_what_this_test_takes_it_for() {
    let frames = frames();
    let counts: Vec<usize> = frames.iter().map(<[_]>::len).collect();
    assert_eq!((counts.len(), counts[0], counts.iter().max(), counts[299]), (300, 85, Some(&155), 5));
    assert_eq!(frames.check(), Ok(()));
    let pairs: usize = frames.iter().map(|boxes| naive(boxes).len()).sum();
    assert!(pairs > 50_000, "{pairs} pairs");
}

#[test]
fn every_algorithm_finds_the_pairs_of_the_double_loop_in_every_frame() {
    let mut algorithms = every_algorithm();
    for (at, boxes) in frames().iter().enumerate() {
        let expected = naive(boxes);
        for (id, algorithm) in &mut algorithms {
            let mut pairs = Pairs::with_order(PairOrder::Canonical);
            algorithm.find_pairs(boxes, &mut pairs).unwrap();
            assert!(pairs.as_slice() == expected, "{id}, frame {at}: {} pairs, not {}", pairs.len(), expected.len());
        }
    }
}

#[test]
fn the_adaptive_module_finds_them_too_as_it_switches() {
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
