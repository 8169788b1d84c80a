//! `Space` beside the slice interface, and beside a space without the bodies that should cost nothing. One thread.
//!
//! Reports the median and the slowest hundredth of all updates after a warm-up, setting of the boxes included. Both
//! sides of a row take turns in each frame.

use sapwise::{Aabb, Adaptive, Body, BroadPhase, Changes, Filter, Handle, Membership, Pairs, Registry, Space, Tuning};
use sapwise_scenes::{Random, Scenario};
use std::time::Instant;

/// Warm-up frames: after them bodies rest and margins have settled.
const WARM_UP: usize = 100;

fn adaptive() -> Adaptive {
    let registry = Registry::with_cores(1);
    Adaptive::new(Tuning::usual(&registry), &registry).expect("the usual tuning has algorithms on one thread")
}

/// The times of the updates of one side, in microseconds.
#[derive(Default)]
struct Times(Vec<f64>);

impl Times {
    fn add(&mut self, frame: usize, work: impl FnOnce()) {
        let started = Instant::now();
        work();
        if frame >= WARM_UP {
            self.0.push(started.elapsed().as_nanos() as f64 / 1000.0);
        }
    }

    /// Returns the median and the 99th percentile.
    fn quantiles(&mut self) -> [f64; 2] {
        self.0.sort_by(f64::total_cmp);
        [0.5, 0.99].map(|q| self.0[((self.0.len() - 1) as f64 * q) as usize])
    }
}

fn row(name: &str, mut space: Times, mut other: Times) {
    let ([median, slow], [beside, _]) = (space.quantiles(), other.quantiles());
    println!("| {name} | {} | {median:.1} | {slow:.1} | {beside:.1} | {:.2} |", space.0.len(), median / beside);
}

fn step(space: &mut Space, handles: &[Handle], boxes: &[Aabb]) {
    space.set_all(handles, boxes).expect("valid boxes");
    space.update().expect("an update");
}

/// Returns the number of frames for a scene of this size, so that all scenes take about the same time.
fn frames(objects: usize) -> usize {
    WARM_UP + (2_000_000 / objects).clamp(60, 2000)
}

/// All bodies move, compared with the slice interface with filter, ids and events.
fn all_moving(scenario: Scenario, objects: usize) {
    let mut scene = scenario.start(objects, 1);
    let mut space = Space::with(adaptive());
    let handles = space.insert_all(scene.boxes(), Body::default().groups(1)).expect("valid boxes");
    let (mut search, mut pairs, mut changes) = (adaptive(), Pairs::new(), Changes::new());
    let membership = Membership { groups: 1, ..Membership::ALL };
    pairs.set_filter(Some(Filter::new(vec![membership; objects])));
    let ids: Vec<u64> = handles.iter().map(|handle| handle.to_bits()).collect();
    let mut boxes = scene.boxes().to_vec();
    let (mut one, mut other) = (Times::default(), Times::default());
    for frame in 0..frames(objects) {
        scene.advance();
        for turn in 0..2 {
            if (turn + frame) % 2 == 0 {
                one.add(frame, || step(&mut space, &handles, scene.boxes()));
            } else {
                other.add(frame, || {
                    boxes.copy_from_slice(scene.boxes());
                    search.find_pairs(&boxes, &mut pairs).expect("a frame");
                    changes.update(&pairs, &ids).expect("an id for each box");
                });
            }
        }
        assert_eq!((space.pairs().len(), space.begun().len()), (pairs.len(), changes.begun().len()));
    }
    row(&format!("{scenario} {objects}: slice interface"), one, other);
}

/// A few of many bodies are set, compared with a space that has only these few.
fn few_of_many(objects: usize, set: usize) {
    let mut scene = Scenario::Uniform.start(objects, 1);
    let (mut many, mut few) = (Space::with(adaptive()), Space::with(adaptive()));
    let handles = many.insert_all(scene.boxes(), Body::default()).expect("valid boxes");
    let alone = few.insert_all(&scene.boxes()[..set], Body::default()).expect("valid boxes");
    let stored: Vec<Vec<Aabb>> = (0..256)
        .map(|_| {
            scene.advance();
            scene.boxes()[..set].to_vec()
        })
        .collect();
    let (mut one, mut other) = (Times::default(), Times::default());
    for frame in 0..WARM_UP + 2000 {
        // To and fro, so that no box jumps.
        let at = frame % 510;
        let boxes = &stored[if at < 256 { at } else { 510 - at }];
        one.add(frame, || step(&mut many, &handles[..set], boxes));
        other.add(frame, || step(&mut few, &alone, boxes));
    }
    row(&format!("{set} of {objects} set: those alone"), one, other);
}

/// All bodies move and one in a hundred is replaced in each frame, compared with a space in which none is replaced.
fn churn(objects: usize) {
    let mut scene = Scenario::Uniform.start(objects, 1);
    let (mut space, mut steady) = (Space::with(adaptive()), Space::with(adaptive()));
    let mut handles = space.insert_all(scene.boxes(), Body::default()).expect("valid boxes");
    let alone = steady.insert_all(scene.boxes(), Body::default()).expect("valid boxes");
    let (mut random, mut one, mut other) = (Random::new(1), Times::default(), Times::default());
    for frame in 0..frames(objects) {
        scene.advance();
        one.add(frame, || {
            for _ in 0..objects / 100 {
                let at = (random.uniform() * objects as f64) as usize;
                space.remove(handles[at]).expect("a body");
                handles[at] = space.insert(scene.boxes()[at], Body::default()).expect("a valid box");
            }
            step(&mut space, &handles, scene.boxes());
        });
        other.add(frame, || step(&mut steady, &alone, scene.boxes()));
    }
    row(&format!("{objects} moving, 1 % replaced: none replaced"), one, other);
}

fn main() {
    println!("| what: beside what | n | median, µs | p99, µs | beside, µs | ratio |");
    println!("|---|---|---|---|---|---|");
    for scenario in [Scenario::Uniform, Scenario::Clustered, Scenario::Resting] {
        [1000, 10_000, 100_000].into_iter().for_each(|objects| all_moving(scenario, objects));
    }
    few_of_many(100_000, 100);
    [1000, 10_000, 100_000].into_iter().for_each(churn);
}
