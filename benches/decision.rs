//! What one decision costs: the ranking alone, and the whole of `Adaptive::decide` with its sampled estimate.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use sapwise::algorithm::Load;
use sapwise::{Adaptive, BroadPhase, Pairs, Registry, Tuning};
use sapwise_scenes::Scenario;
use sapwise_tune::{Hardware, Machine, Model, Parameter, ParameterId};
use std::hint::black_box;

/// What the built-in model predicts for a machine of 16 cores.
fn tuning(registry: &Registry) -> Tuning {
    let figures = [
        (ParameterId::UsableCores, 16.0),
        (ParameterId::ClockMeasuredGhz, 3.0),
        (ParameterId::SimdLanes, 8.0),
        (ParameterId::CacheLlcBytes, 3.2e7),
        (ParameterId::BandwidthOneThreadGbPerS, 20.0),
        (ParameterId::ForkJoinColdNs, 8000.0),
        (ParameterId::ScalingTwoThreadsRatio, 1.9),
        (ParameterId::ScalingAllThreadsRatio, 12.0),
    ];
    let parameters = figures.map(|(id, value)| Parameter::reported(id, value, "made up")).to_vec();
    let hardware = Hardware::new(Machine::default(), parameters);
    let loads: Vec<Load> = (3..20).map(|k| Load::of_objects(1 << k)).collect();
    let model = Model::built_in().expect("the built-in model is sound");
    model.predict(&hardware, registry.entries()).expect("a machine like others").tuning("uniform", &loads)
}

fn decision(c: &mut Criterion) {
    let registry = Registry::with_cores(16);
    let tuning = tuning(&registry);
    let load = Load::of_objects(12_345).with_candidates(1e6, 1e5).with_pairs(6e3).with_moved(0.04);
    for count in [16, tuning.costs.len()] {
        c.bench_function(&format!("rank {count} algorithms"), |b| {
            b.iter(|| tuning.cheapest(black_box(&load), |k| k < count));
        });
    }
    for objects in [100, 10_000, 1_000_000] {
        let scene = Scenario::Uniform.start(objects, 1);
        let mut adaptive = Adaptive::new(tuning.clone(), &registry).expect("available");
        adaptive.find_pairs(scene.boxes(), &mut Pairs::new()).expect("valid boxes");
        let mut group = c.benchmark_group("decide, the sample spread over its frames");
        group.bench_function(BenchmarkId::from_parameter(objects), |b| {
            b.iter(|| adaptive.decide(black_box(scene.boxes())).is_some());
        });
        group.finish();
    }
}

criterion_group!(benches, decision);
criterion_main!(benches);
