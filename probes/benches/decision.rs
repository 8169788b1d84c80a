//! What one decision costs: the ranking alone, and the whole of `Adaptive::decide` with its sampled estimate.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use sapwise::{Adaptive, AlgorithmCost, BroadPhase, CostCurve, CostTerm, Knot, Load, Pairs, Registry, Source, Term, Tuning};
use sapwise_scenes::Scenario;
use std::hint::black_box;

/// As many algorithms, terms and knots as a predicted field of a 16-core machine has.
fn tuning(registry: &Registry) -> Tuning {
    let curve = |k: u32| {
        let terms = Term::ALL.map(|term| CostTerm::new(term, 1.0 + f64::from(k) / 100.0)).to_vec();
        let knot = |o: u32| Knot { log2_objects: f64::from(o), ln_factor: 0.01 * f64::from(o % 5) };
        CostCurve::new(terms).with_cache(3.2e7).with_correction((3..=24).map(knot).collect())
    };
    let ids = registry.entries().iter().map(|e| (e.id.clone(), e.revision));
    let costs = ids.zip(0..).map(|((algorithm, revision), k)| AlgorithmCost::new(algorithm, revision, curve(k), 0.05));
    let loads: Vec<Load> = (3..20).map(|k| Load::of_objects(1 << k)).collect();
    Tuning::from_costs(Source::Measured, "uniform", costs.collect(), &loads)
}

fn decision(c: &mut Criterion) {
    let registry = Registry::with_cores(16);
    let tuning = tuning(&registry);
    let load = Load::of_objects(12_345).with_candidates(1e6, 1e5).with_pairs(6e3).with_moved(1.0);
    c.bench_function(&format!("rank {} algorithms", tuning.costs.len()), |b| {
        b.iter(|| tuning.rank(black_box(&load), |_| true));
    });
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
