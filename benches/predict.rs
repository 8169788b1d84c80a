//! What a prediction costs from the text of a model to the tuning: reading, predicting, and cutting a slice.

use criterion::{Criterion, criterion_group, criterion_main};
use sapwise::Registry;
use sapwise::algorithm::{Entry, Load};
use sapwise_tune::{Hardware, Machine, Model, Parameter, ParameterId, json};
use std::hint::black_box;

const CORES: u32 = 8;

/// A machine with all parameters that a report holds.
fn machine() -> Hardware {
    let value = |id: ParameterId| match id {
        ParameterId::UsableCores | ParameterId::PhysicalCores => f64::from(CORES),
        ParameterId::ClockMeasuredGhz | ParameterId::ClockReportedGhz => 4.5,
        ParameterId::SimdLanes => 16.0,
        ParameterId::ScalingTwoThreadsRatio => 1.9,
        ParameterId::ScalingAllThreadsRatio => 6.5,
        id if id.as_str().ends_with("_bytes") => 3.3e7,
        id if id.as_str().ends_with("_ns") => 8000.0,
        _ => 45.0,
    };
    let parameters = ParameterId::ALL.iter().map(|&id| Parameter::reported(id, value(id), "made up")).collect();
    Hardware::new(Machine::default(), parameters)
}

fn predict(c: &mut Criterion) {
    let text = include_str!("../models/default.json");
    let model = Model::built_in().expect("a sound model");
    let hardware = machine();
    let algorithms: Vec<Entry> = Registry::with_cores(CORES).available();
    let loads: Vec<Load> = (4..=24).map(|k| load(10.0_f64.powf(f64::from(k) / 4.0).round())).collect();
    let prediction = model.predict(&hardware, &algorithms).expect("known methods");
    let tuning = prediction.clone().tuning("uniform", &loads);
    let (costs, crossovers) = (prediction.costs.len(), tuning.crossovers.len());
    let mut group =
        c.benchmark_group(format!("{costs} algorithms, {crossovers} crossovers, a model of {} kB", text.len() / 1000));
    group.bench_function("read the model", |b| b.iter(|| json::model(black_box(text)).expect("a sound model")));
    group.bench_function("predict", |b| {
        b.iter(|| model.predict(black_box(&hardware), &algorithms).expect("known methods"));
    });
    group.bench_function("tuning", |b| b.iter(|| prediction.clone().tuning("uniform", black_box(&loads))));
    group.bench_function("all", |b| {
        b.iter(|| {
            let model = json::model(black_box(text)).expect("a sound model");
            model.predict(&hardware, &algorithms).expect("known methods").tuning("uniform", &loads)
        });
    });
    group.finish();
}

/// Loads like those of `uniform`.
fn load(n: f64) -> Load {
    Load::of_objects(n as u32).with_candidates(0.3 * n.powf(5.0 / 3.0), 4.0 * n).with_pairs(n).with_moved(0.04)
}

criterion_group!(benches, predict);
criterion_main!(benches);
