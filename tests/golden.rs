//! The pairs of every scenario over 500 frames, as stored hashes: the same from every algorithm, on every platform and
//! in every version.
//!
//! A line of tests/fixtures/golden.csv has a scenario, the selection of its frames, a hash of the bits of their boxes,
//! and a hash of their pairs in canonical order, both by the oracle. After a change of the scenes,
//! `SAPWISE_WRITE_GOLDEN=1 cargo test --test golden` writes the file.

mod common;

use common::{every_algorithm, naive};
use sapwise::algorithm::SimdLevel;
use sapwise::internals::Pair;
use sapwise::{Aabb, BroadPhase, PairOrder, Pairs};
use sapwise_scenes::Scenario;
use std::fmt::Write;

const GOLDEN: &str = include_str!("fixtures/golden.csv");
const HEAD: &str = "scenario,objects,every,boxes_fnv1a,pairs_fnv1a";
const FRAMES: usize = 500;

/// A selection of the frames of a scenario: every nth one, with this number of boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Frames {
    objects: usize,
    every: usize,
}

/// Too few boxes for several threads.
const SMALL: Frames = Frames { objects: 300, every: 1 };
/// Several threads share a frame.
const LARGE: Frames = Frames { objects: 3000, every: 50 };
/// For software adapters, which are slow.
const FEW: Frames = Frames { objects: 300, every: 50 };

/// FNV-1a of 64 bits.
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn pairs(&mut self, pairs: &[Pair]) {
        self.add(pairs.len() as u32);
        pairs.iter().for_each(|&(i, j)| [i, j].into_iter().for_each(|k| self.add(k)));
    }

    fn boxes(&mut self, boxes: &[Aabb]) {
        self.add(boxes.len() as u32);
        boxes.iter().flat_map(|b| b.min.into_iter().chain(b.max)).for_each(|x| self.add(x.to_bits()));
    }
}

impl Frames {
    fn of(self, scenario: Scenario) -> impl Iterator<Item = Vec<Aabb>> {
        let mut scene = scenario.start(self.objects, 42);
        (0..FRAMES).filter_map(move |frame| {
            let boxes = (frame % self.every == 0).then(|| scene.boxes().to_vec());
            scene.advance();
            boxes
        })
    }

    /// Returns the stored hash of the pairs.
    fn golden(self, scenario: Scenario) -> u64 {
        let begin = format!("{scenario},{},{},", self.objects, self.every);
        let line = GOLDEN
            .lines()
            .find(|line| line.starts_with(&begin))
            .unwrap_or_else(|| panic!("there is no line {begin}..."));
        u64::from_str_radix(line.rsplit(',').next().unwrap(), 16).unwrap()
    }
}

/// Runs each algorithm on the frames of every scenario, alternately in canonical and in any order.
fn assert_golden(frames: Frames, mut algorithms: Vec<(String, Box<dyn BroadPhase>)>) {
    let mut orders = [PairOrder::Canonical, PairOrder::Any].map(Pairs::with_order);
    for scenario in Scenario::ALL {
        let mut hashes: Vec<Hash> = algorithms.iter().map(|_| Hash::new()).collect();
        for (frame, boxes) in frames.of(scenario).enumerate() {
            let pairs = &mut orders[frame % 2];
            for ((id, algorithm), hash) in algorithms.iter_mut().zip(&mut hashes) {
                // Spoils the list: the previous algorithm left the right answer in it.
                pairs.push(u32::MAX - 1, u32::MAX);
                algorithm.find_pairs(&boxes, pairs).unwrap_or_else(|e| panic!("{id} on {scenario}: {e}"));
                if pairs.order() == PairOrder::Canonical {
                    hash.pairs(pairs.as_slice());
                } else {
                    let mut sorted = pairs.as_slice().to_vec();
                    sorted.sort_unstable();
                    hash.pairs(&sorted);
                }
            }
        }
        let golden = frames.golden(scenario);
        for ((id, _), hash) in algorithms.iter().zip(hashes) {
            assert_eq!(format!("{:016x}", hash.0), format!("{golden:016x}"), "{id} on {scenario}, {frames:?}");
        }
    }
}

#[test]
fn oracle_finds_the_golden_pairs() {
    let mut text = HEAD.to_owned() + "\n";
    let all = [SMALL, FEW, LARGE];
    for (scenario, frames) in Scenario::ALL.into_iter().flat_map(|s| all.map(|f| (s, f))) {
        let (mut boxes, mut pairs) = (Hash::new(), Hash::new());
        for frame in frames.of(scenario) {
            boxes.boxes(&frame);
            pairs.pairs(&naive(&frame));
        }
        let Frames { objects, every } = frames;
        writeln!(text, "{scenario},{objects},{every},{:016x},{:016x}", boxes.0, pairs.0).unwrap();
    }
    if std::env::var_os("SAPWISE_WRITE_GOLDEN").is_some() {
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/golden.csv"), &text).unwrap();
        return;
    }
    for (now, kept) in text.lines().zip(GOLDEN.lines()) {
        assert_eq!(now, kept);
    }
    assert_eq!(text.lines().count(), GOLDEN.lines().count());
}

#[test]
fn every_algorithm_finds_the_golden_pairs() {
    let fastest = SimdLevel::detected();
    // With few boxes every frame runs on one thread.
    let few = every_algorithm().into_iter();
    let few = few.filter(|(id, _)| id.contains("@cpu1 ") || id.ends_with(&format!("@cpu7 at {fastest}")));
    assert_golden(SMALL, few.collect());
    let all = |id: &str| cfg!(feature = "long-tests") || id.ends_with(&format!(" at {fastest}"));
    assert_golden(LARGE, every_algorithm().into_iter().filter(|(id, _)| all(id)).collect());
}
