//! What a prediction costs from the text of a model to the tuning: reading, predicting, and cutting a slice with intervals.

use criterion::{Criterion, criterion_group, criterion_main};
use sapwise::hardware::ParameterId;
use sapwise::model::{Feature, Fold, FoldMethod, LnErrors, MethodModel, Role, RoleErrors};
use sapwise::{AlgorithmId, BackendClass, Hardware, Load, Machine, Model, Parameter, Registry, json};
use std::hint::black_box;

const FOLDS: u32 = 10;
const CORES: u32 = 8;

/// The built-in model with ten folds that differ by some percent, and errors for all pairs of eight roles on the CPU and six on GPUs.
fn model() -> Model {
    let mut model = Model::built_in().expect("a sound model");
    model.folds = (0..FOLDS).map(|k| fold(&model, 1.0 + 0.02 * f64::from(k))).collect();
    model.validation.physical_machines = FOLDS as usize;
    model
}

fn fold(model: &Model, factor: f64) -> Fold {
    let method = |m: &MethodModel| FoldMethod {
        method: m.method.clone(),
        backend: m.backend,
        objects: (m.min_objects, m.max_objects),
        terms: m.terms.iter().map(|t| (t.term, t.scale, six(t.unit * factor))).collect(),
        fallback_terms: Vec::new(),
        intercept: six(m.residual_intercept),
        slopes: m.residual.iter().map(|r| (r.feature, six(r.slope / 100.0))).collect(),
    };
    let roles = |several| model.methods.iter().map(move |m| Role { method: m.method.clone(), backend: m.backend, several });
    let roles: Vec<Role> = roles(false).chain(roles(true)).collect();
    let errors: LnErrors = [0.012, 0.034, 0.056, 0.078, 0.123, 0.234, 0.345, 0.456];
    let count = roles.len() as u32;
    let of = |(role, k): (Role, u32)| RoleErrors {
        role,
        machines: 1,
        ln_errors: errors.map(|e| 2.0 * e),
        against: (k..count).map(|other| (other, 1, errors)).collect(),
    };
    Fold {
        machines: 1,
        methods: model.methods.iter().map(method).collect(),
        errors: roles.into_iter().zip(0..).map(of).collect(),
    }
}

fn six(x: f64) -> f64 {
    format!("{x:.5e}").parse().expect("a number")
}

/// A machine with all parameters that a report holds.
fn machine() -> Hardware {
    let value = |name: &str| match name {
        ParameterId::UsableCores | ParameterId::PhysicalCores => f64::from(CORES),
        ParameterId::ClockMeasuredGhz | ParameterId::ClockReportedGhz => 4.5,
        ParameterId::SimdLanes => 16.0,
        ParameterId::ScalingTwoThreadsRatio => 1.9,
        ParameterId::ScalingAllThreadsRatio => 6.5,
        name if name.ends_with("_bytes") => 3.3e7,
        name if name.ends_with("_ns") => 8000.0,
        _ => 45.0,
    };
    let parameters = ParameterId::ALL.iter().map(|name| Parameter::reported(name, value(name), "made up")).collect();
    Hardware { machine: Machine::default(), parameters, gpus: Vec::new(), gpu_groups: Vec::new() }
}

fn predict(c: &mut Criterion) {
    let text = json::write_model(&model()).expect("figures");
    let model = json::model(&text).expect("a sound model");
    assert!(Feature::of(BackendClass::Cpu).len() == 4 && model.folds.len() == 10);
    let hardware = machine();
    let algorithms = Registry::with_cores(CORES).entries().to_vec();
    let loads: Vec<Load> = (4..=24).map(|k| load(10.0_f64.powf(f64::from(k) / 4.0).round())).collect();
    let prediction = model.predict(&hardware, &algorithms).expect("known methods");
    let tuning = prediction.clone().tuning("uniform", &loads);
    assert!(tuning.crossovers.iter().all(|b| b.interval().is_some()), "{}", tuning.interval_basis);
    let name = format!(
        "{} algorithms, {} borders, a model of {} kB",
        prediction.costs.len(),
        tuning.crossovers.len(),
        text.len() / 1000
    );
    let mut group = c.benchmark_group(name);
    group.bench_function("read the model", |b| b.iter(|| json::model(black_box(&text)).expect("a sound model")));
    group.bench_function("predict", |b| b.iter(|| model.predict(black_box(&hardware), &algorithms).expect("known methods")));
    group.bench_function("tuning with intervals", |b| b.iter(|| prediction.clone().tuning("uniform", black_box(&loads))));
    group.bench_function("all", |b| {
        b.iter(|| {
            let model = json::model(black_box(&text)).expect("a sound model");
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
