//! Our algorithms beside parry3d's `Bvh`, which rapier builds on, on the same boxes in the same run.
//!
//! Both take new boxes and give the full list of overlapping pairs in reused memory. The pair sets of all contestants
//! are compared before anything is timed. Bias: one scenario, one peer, one thread; the box coordinates are copied into
//! parry's own type inside the timed part, because an engine that uses parry stores them in that type already and would
//! not pay for it, so parry is charged about 24 bytes a box too much.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use parry3d::bounding_volume::Aabb as ParryAabb;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};
use sapwise::{Aabb, BroadPhase, Error, Pairs, Registry, Scenario};
use std::hint::black_box;

/// parry's tree: leaves updated, refitted, traversed against itself.
struct ParryRefit {
    tree: Bvh,
    workspace: BvhWorkspace,
}

fn parry_box(b: &Aabb) -> ParryAabb {
    ParryAabb::new(b.min.into(), b.max.into())
}

impl ParryRefit {
    fn new(boxes: &[Aabb]) -> Self {
        let leaves: Vec<ParryAabb> = boxes.iter().map(parry_box).collect();
        Self { tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves), workspace: BvhWorkspace::default() }
    }
}

impl BroadPhase for ParryRefit {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        for (k, b) in boxes.iter().enumerate() {
            self.tree.insert_or_update_partially(parry_box(b), k as u32, 0.0);
        }
        self.tree.refit(&mut self.workspace);
        self.tree.traverse_bvtt_single_tree::<false>(&mut self.workspace, &mut |a, b| pairs.push(a, b));
        pairs.finish()
    }
}

/// Frames that each contestant goes through in turn: consecutive, so that a tree can be refitted.
const FRAMES: usize = 4;

fn peers(c: &mut Criterion) {
    let registry = Registry::new();
    for objects in [1_000, 10_000, 100_000, 1_000_000] {
        let mut scene = Scenario::Uniform.start(objects, 1);
        let frames: Vec<Vec<Aabb>> = (0..FRAMES)
            .map(|_| {
                scene.advance();
                scene.boxes().to_vec()
            })
            .collect();
        let mut contestants: Vec<(String, Box<dyn BroadPhase>)> =
            vec![("parry3d-refit".to_owned(), Box::new(ParryRefit::new(&frames[0])))];
        for id in ["sweep@cpu1", "strips@cpu1"].iter().filter(|id| !(id.starts_with("sweep") && objects > 100_000)) {
            let id = id.parse().expect("an algorithm of ours");
            contestants.push((format!("{id}"), registry.create(&id).expect("available everywhere")));
        }
        let mut pairs = Pairs::new();
        for boxes in &frames {
            let fingerprints: Vec<u64> = contestants
                .iter_mut()
                .map(|(_, a)| {
                    a.find_pairs(boxes, &mut pairs).expect("valid boxes");
                    pairs.fingerprint()
                })
                .collect();
            assert!(fingerprints.iter().all(|&f| f == fingerprints[0]), "different pairs at {objects} objects");
        }
        let mut group = c.benchmark_group("uniform");
        group.sample_size(if objects >= 100_000 { 10 } else { 50 });
        for (name, algorithm) in &mut contestants {
            let mut frame = 0;
            group.bench_function(BenchmarkId::new(name.as_str(), objects), |b| {
                b.iter(|| {
                    // There and back again, so that consecutive calls always see neighbouring frames.
                    frame = (frame + 1) % (2 * FRAMES - 2);
                    let at = if frame < FRAMES { frame } else { 2 * FRAMES - 2 - frame };
                    algorithm.find_pairs(black_box(&frames[at]), &mut pairs).expect("valid boxes");
                    black_box(pairs.len())
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, peers);
criterion_main!(benches);
