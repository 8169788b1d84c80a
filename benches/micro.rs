//! Single calls: prediction from the text of a model to the tuning, one decision, and what a filter and `Changes` cost
//! beside finding the pairs.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sapwise::algorithm::Load;
use sapwise::{Aabb, Adaptive, BroadPhase, Changes, Filter, Membership, PairOrder, Pairs, Registry, Tuning};
use sapwise_scenes::Scenario;
use sapwise_tune::{Hardware, Machine, Model, Parameter, ParameterId, json};
use std::hint::black_box;

const CORES: u32 = 16;

/// Returns a machine with all parameters that a report holds.
fn machine() -> Hardware {
    let value = |id: ParameterId| match id {
        ParameterId::UsableCores | ParameterId::PhysicalCores => f64::from(CORES),
        ParameterId::ClockMeasuredGhz | ParameterId::ClockReportedGhz => 4.5,
        ParameterId::SimdLanes => 16.0,
        ParameterId::ScalingTwoThreadsRatio => 1.9,
        ParameterId::ScalingAllThreadsRatio => 12.0,
        id if id.as_str().ends_with("_bytes") => 3.3e7,
        id if id.as_str().ends_with("_ns") => 8000.0,
        _ => 45.0,
    };
    let parameters = ParameterId::ALL.iter().map(|&id| Parameter::reported(id, value(id), "made up")).collect();
    Hardware::new(Machine::default(), parameters)
}

/// Returns a load like those of `uniform`.
fn load(n: f64) -> Load {
    Load::of_objects(n as u32).with_candidates(0.3 * n.powf(5.0 / 3.0), 4.0 * n).with_pairs(n).with_moved(0.04)
}

/// Times the way to a tuning, then decisions by it.
fn prediction_and_decision(c: &mut Criterion) {
    let text = include_str!("../models/default.json");
    let model = Model::built_in().expect("a sound model");
    let (hardware, registry) = (machine(), Registry::with_cores(CORES));
    let loads: Vec<Load> = (4..=24).map(|k| load(10.0_f64.powf(f64::from(k) / 4.0).round())).collect();
    let predict = |model: &Model| model.predict(black_box(&hardware), registry.entries()).expect("known methods");
    let tuning: Tuning = predict(&model).tuning("uniform", &loads);
    c.bench_function("read the model", |b| b.iter(|| json::model(black_box(text)).expect("a sound model")));
    c.bench_function("predict", |b| b.iter(|| predict(&model)));
    c.bench_function("predict and cut a slice", |b| b.iter(|| predict(&model).tuning("uniform", &loads)));
    for count in [16, tuning.costs.len()] {
        c.bench_function(&format!("rank {count} algorithms"), |b| {
            b.iter(|| tuning.cheapest(black_box(&loads[12]), |k| k < count));
        });
    }
    for objects in [100, 10_000, 1_000_000] {
        let scene = Scenario::Uniform.start(objects, 1);
        let mut adaptive = Adaptive::new(tuning.clone(), &registry).expect("available");
        adaptive.find_pairs(scene.boxes(), &mut Pairs::new()).expect("valid boxes");
        c.bench_function(&format!("decide at {objects}, the sample spread over its frames"), |b| {
            b.iter(|| adaptive.decide(black_box(scene.boxes())).is_some());
        });
    }
}

/// Frames that are gone through, forth and back.
const FRAMES: usize = 4;

/// Returns the next of `frames` each time, forth and back.
fn walk<T>(frames: &[T]) -> impl Iterator<Item = &T> + Clone {
    let back = frames[1..frames.len() - 1].iter().rev();
    frames.iter().chain(back).cycle()
}

fn strips() -> Box<dyn BroadPhase> {
    Registry::with_cores(1).create(&"grid-sap@cpu1".parse().expect("an id")).expect("one core is enough")
}

/// Times `clustered` on one core.
fn filter_and_changes(c: &mut Criterion) {
    for objects in [300, 28_000, 850_000] {
        let mut scene = Scenario::Clustered.start(objects, 1);
        let mut next = |_| {
            scene.advance();
            scene.boxes().to_vec()
        };
        let boxes: Vec<Vec<Aabb>> = (0..FRAMES).map(&mut next).collect();
        let ids: Vec<u64> = (1..=objects as u64).map(|k| k.wrapping_mul(0x9e37_79b9_7f4a_7c15)).collect();
        let mut group = c.benchmark_group("pairs");
        group.sample_size(if objects > 100_000 { 10 } else { 100 });
        // Half of the pairs pass.
        let membership =
            |k: usize| Membership { groups: 1 << (k % 2), mask: 1 << (k / 2 % 2) | 1 << (k % 2), ..Membership::ALL };
        let filter = Filter::new((0..objects).map(|k| k.wrapping_mul(0x9e37_79b9) >> 7).map(membership).collect());
        for (name, filter) in [("find", None), ("find, filtered", Some(filter))] {
            let (mut algorithm, mut pairs, mut frames) = (strips(), Pairs::new(), walk(&boxes));
            pairs.set_filter(filter);
            group.bench_function(BenchmarkId::new(name, objects), |b| {
                b.iter(|| frames.next().map(|boxes| algorithm.find_pairs(boxes, &mut pairs)));
            });
        }
        for order in [PairOrder::Any, PairOrder::Canonical] {
            let mut algorithm = strips();
            let find = |boxes: &Vec<Aabb>| {
                let mut pairs = Pairs::with_order(order);
                algorithm.find_pairs(boxes, &mut pairs).expect("valid boxes");
                pairs
            };
            let pairs: Vec<Pairs> = boxes.iter().map(find).collect();
            group.throughput(Throughput::Elements(pairs[0].len() as u64));
            let (mut changes, mut frames) = (Changes::new(), walk(&pairs));
            group.bench_function(BenchmarkId::new(format!("changes by position, {order:?}"), objects), |b| {
                b.iter(|| frames.next().map(|pairs| changes.update_positions(pairs)));
            });
            let (mut changes, mut frames) = (Changes::new(), walk(&pairs));
            group.bench_function(BenchmarkId::new(format!("changes by id, {order:?}"), objects), |b| {
                b.iter(|| frames.next().map(|pairs| changes.update(pairs, &ids)));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, prediction_and_decision, filter_and_changes);
criterion_main!(benches);
