//! What a filter and `Changes` cost beside finding the pairs: `clustered`, forth and back through a few frames, on
//! one core.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sapwise::{Aabb, BroadPhase, Changes, Filter, Membership, PairOrder, Pairs, Registry};
use sapwise_scenes::Scenario;

/// Frames that are gone through, the last as near to the last but one as the first to the second.
const FRAMES: usize = 4;

/// The next of `frames` each time, forth and back.
fn walk<T>(frames: &[T]) -> impl Iterator<Item = &T> + Clone {
    let back = frames[1..frames.len() - 1].iter().rev();
    frames.iter().chain(back).cycle()
}

fn strips() -> Box<dyn BroadPhase> {
    Registry::with_cores(1).create(&"grid-sap@cpu1".parse().expect("an id")).expect("one core is enough")
}

/// Pairs of every frame.
fn found(boxes: &[Vec<Aabb>], order: PairOrder) -> Vec<Pairs> {
    let mut algorithm = strips();
    let find = |boxes: &Vec<Aabb>| {
        let mut pairs = Pairs::with_order(order);
        algorithm.find_pairs(boxes, &mut pairs).expect("valid boxes");
        pairs
    };
    boxes.iter().map(find).collect()
}

fn changes(c: &mut Criterion) {
    for objects in [300, 28_000, 850_000] {
        let mut scene = Scenario::Clustered.start(objects, 1);
        let mut next = |_| {
            scene.advance();
            scene.boxes().to_vec()
        };
        let boxes: Vec<Vec<Aabb>> = (0..FRAMES).map(&mut next).collect();
        let ids: Vec<u64> = (1..=objects as u64).map(|k| k.wrapping_mul(0x9e37_79b9_7f4a_7c15)).collect();
        let (any, canonical) = (found(&boxes, PairOrder::Any), found(&boxes, PairOrder::Canonical));
        let mut group = c.benchmark_group("pairs");
        group.throughput(Throughput::Elements(any[0].len() as u64)).sample_size(if objects > 100_000 {
            10
        } else {
            100
        });
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
        for (name, pairs) in [("in any order", &any), ("in canonical order", &canonical)] {
            let (mut changes, mut frames) = (Changes::new(), walk(pairs));
            group.bench_function(BenchmarkId::new(format!("changes by position, {name}"), objects), |b| {
                b.iter(|| frames.next().map(|pairs| changes.update_positions(pairs)));
            });
            let (mut changes, mut frames) = (Changes::new(), walk(pairs));
            group.bench_function(BenchmarkId::new(format!("changes by id, {name}"), objects), |b| {
                b.iter(|| frames.next().map(|pairs| changes.update(pairs, &ids)));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, changes);
criterion_main!(benches);
