//! Queries of a tree beside those of parry3d and obvhs, on one thread: rays, first hit and all hits, and regions.
//!
//! Reports the CPU time of a query in nanoseconds: the median of interleaved rounds. Before, it asserts that all
//! contestants find the same.

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb as Bounds;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray as PeerRay, RayHit};
// `traverse` names it.
use glam::UVec2;
use parry3d::bounding_volume::Aabb as ParryBounds;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhNode};
use parry3d::query::Ray as ParryRay;
use rustix::time::{ClockId, clock_gettime};
use sapwise::Aabb;
use sapwise::internals::{Ray, Tree, splitmix};
use sapwise_scenes::Scenario;
use sapwise_tune::stats::median;
use std::hint::black_box;
use std::time::Duration;

const BOXES: usize = 100_000;
const QUERIES: usize = 10_000;
const ROUNDS: usize = 25;

/// Half the edge of a region, in edges of a box.
const HALF: f32 = 1.5;

/// Number and sum of what was found: ids, or the bits of the first `t` of each ray.
type Found = (u64, u64);

fn count(found: &mut Found, value: u32) {
    found.0 += 1;
    found.1 += u64::from(value);
}

trait Contestant {
    fn name(&self) -> &'static str;
    fn first_hit(&self, ray: &Ray, found: &mut Found);
    fn all_hits(&self, ray: &Ray, found: &mut Found);
    fn region(&self, region: &Aabb, found: &mut Found);

    /// Runs all queries of one kind. Each tree has its own copy of this function: no call of a query is virtual.
    fn run(&self, Queries { rays, regions }: &Queries, kind: Kind) -> Found {
        let mut found = (0, 0);
        match kind {
            Kind::FirstHit => rays.iter().for_each(|ray| self.first_hit(ray, &mut found)),
            Kind::AllHits => rays.iter().for_each(|ray| self.all_hits(ray, &mut found)),
            Kind::Region => regions.iter().for_each(|region| self.region(region, &mut found)),
        }
        found
    }
}

struct Queries {
    rays: Vec<Ray>,
    regions: Vec<Aabb>,
}

#[derive(Clone, Copy)]
enum Kind {
    FirstHit,
    AllHits,
    Region,
}

impl Contestant for Tree {
    fn name(&self) -> &'static str {
        "sapwise"
    }

    fn first_hit(&self, ray: &Ray, found: &mut Found) {
        let mut first = f32::INFINITY;
        self.cast_box(&Aabb::new(ray.origin, ray.origin), ray.direction, ray.max, |_, t| {
            first = t;
            t
        });
        if first < f32::INFINITY {
            count(found, first.to_bits());
        }
    }

    fn all_hits(&self, ray: &Ray, found: &mut Found) {
        self.cast_box(&Aabb::new(ray.origin, ray.origin), ray.direction, ray.max, |id, _| {
            count(found, id);
            f32::INFINITY
        });
    }

    fn region(&self, region: &Aabb, found: &mut Found) {
        self.overlapping(region, |id| count(found, id));
    }
}

/// A tree of parry3d, and the boxes.
struct Parry {
    tree: Bvh,
    bounds: Vec<Bounds>,
}

impl Contestant for Parry {
    fn name(&self) -> &'static str {
        "parry3d Bvh"
    }

    fn first_hit(&self, ray: &Ray, found: &mut Found) {
        let peer = peer_ray(ray);
        let to_box = |id: u32, _| Some(self.bounds[id as usize].intersect_ray(&peer)).filter(|&t| t < f32::INFINITY);
        let ray = ParryRay::new(ray.origin.into(), ray.direction.into());
        if let Some((_, first)) = self.tree.cast_ray(&ray, f32::MAX, to_box) {
            count(found, first.max(0.0).to_bits());
        }
    }

    fn all_hits(&self, ray: &Ray, found: &mut Found) {
        let ray = peer_ray(ray);
        let bounds = |node: &BvhNode| Bounds::new(node.mins().to_array().into(), node.maxs().to_array().into());
        let meets = |node: &BvhNode| bounds(node).intersect_ray(&ray) < f32::INFINITY;
        self.tree.leaves(meets).for_each(|id| count(found, id));
    }

    fn region(&self, region: &Aabb, found: &mut Found) {
        let region = ParryBounds::new(region.min.into(), region.max.into());
        self.tree.intersect_aabb(&region).for_each(|id| count(found, id));
    }
}

/// A tree of obvhs, and the boxes and their ids in the order of its leaves.
struct Obvhs<T> {
    name: &'static str,
    tree: T,
    bounds: Vec<Bounds>,
    ids: Vec<u32>,
}

impl<T> Obvhs<T> {
    fn new(name: &'static str, ids: &[u32], tree: T, bounds: &[Bounds]) -> Self {
        Self { name, tree, bounds: ids.iter().map(|&id| bounds[id as usize]).collect(), ids: ids.to_vec() }
    }
}

fn peer_ray(ray: &Ray) -> PeerRay {
    PeerRay::new_inf(ray.origin.into(), ray.direction.into())
}

/// The methods for rays. Both trees have the functions that they call, but no common trait.
macro_rules! rays {
    () => {
        fn name(&self) -> &'static str {
            self.name
        }

        fn first_hit(&self, ray: &Ray, found: &mut Found) {
            let mut hit = RayHit::none();
            if self.tree.ray_traverse(peer_ray(ray), &mut hit, |ray, at| self.bounds[at].intersect_ray(ray)) {
                count(found, hit.t.max(0.0).to_bits());
            }
        }

        fn all_hits(&self, ray: &Ray, found: &mut Found) {
            self.tree.ray_traverse_anyhit(peer_ray(ray), |ray, at| {
                if self.bounds[at].intersect_ray(ray) < f32::INFINITY {
                    count(found, self.ids[at]);
                }
            });
        }
    };
}

impl Contestant for Obvhs<Bvh2> {
    rays!();

    fn region(&self, region: &Aabb, found: &mut Found) {
        let region = Bounds::new(region.min.into(), region.max.into());
        self.tree.aabb_traverse(region, |tree, node| {
            let node = &tree.nodes[node as usize];
            for at in (node.first_index as usize..).take(node.prim_count as usize) {
                if region.intersect_aabb(&self.bounds[at]) {
                    count(found, self.ids[at]);
                }
            }
            true
        });
    }
}

impl Contestant for Obvhs<CwBvh> {
    rays!();

    fn region(&self, region: &Aabb, found: &mut Found) {
        let region = Bounds::new(region.min.into(), region.max.into());
        let mut state = self.tree.new_traversal([0.0; 3].into());
        let mut node;
        obvhs::traverse!(self.tree, node, state, node.intersect_aabb(&region, state.oct_inv4), {
            let at = state.primitive_id as usize;
            if region.intersect_aabb(&self.bounds[at]) {
                count(found, self.ids[at]);
            }
        });
    }
}

fn contestants(boxes: &[Aabb]) -> Vec<Box<dyn Contestant>> {
    let bounds: Vec<Bounds> = boxes.iter().map(|b| Bounds::new(b.min.into(), b.max.into())).collect();
    let parry = boxes.iter().map(|b| ParryBounds::new(b.min.into(), b.max.into())).enumerate();
    let parry = Parry { tree: Bvh::from_iter(BvhBuildStrategy::Binned, parry), bounds: bounds.clone() };
    let mut taken = Duration::ZERO;
    // The best trees of obvhs, with up to eight boxes a leaf and with one.
    let best = BvhBuildParams::very_slow_build();
    let few = build_bvh2(&bounds, best, &mut taken);
    let one = build_bvh2(&bounds, BvhBuildParams { max_prims_per_leaf: 1, ..best }, &mut taken);
    let wide = build_cwbvh(&bounds, best, &mut taken);
    vec![
        Box::new(Tree::of(boxes).expect("valid boxes")),
        Box::new(parry),
        Box::new(Obvhs::new("obvhs Bvh2, 8", &few.primitive_indices.clone(), few, &bounds)),
        Box::new(Obvhs::new("obvhs Bvh2, 1", &one.primitive_indices.clone(), one, &bounds)),
        Box::new(Obvhs::new("obvhs CwBvh", &wide.primitive_indices.clone(), wide, &bounds)),
    ]
}

/// The CPU time of the process in nanoseconds.
fn cpu_ns() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 * 1e9 + time.tv_nsec as f64
}

/// Prints the median of each contestant, and ours over the fastest of the peers.
fn race(label: &str, contestants: &[Box<dyn Contestant>], queries: &Queries, kind: Kind) {
    let expected = contestants[0].run(queries, kind);
    for peer in &contestants[1..] {
        assert_eq!(peer.run(queries, kind), expected, "{label}: {}", peer.name());
    }
    let mut taken = vec![Vec::new(); contestants.len()];
    for round in 0..ROUNDS {
        for k in 0..contestants.len() {
            let at = (k + round) % contestants.len();
            let begin = cpu_ns();
            black_box(black_box(&*contestants[at]).run(queries, kind));
            taken[at].push((cpu_ns() - begin) / QUERIES as f64);
        }
    }
    let medians: Vec<f64> = taken.iter().filter_map(|times| median(times)).collect();
    let fastest = medians[1..].iter().copied().fold(f64::INFINITY, f64::min);
    print!("{label}, {:.2} found a query:", expected.0 as f64 / QUERIES as f64);
    contestants.iter().zip(&medians).for_each(|(c, ns)| print!(" {} {ns:.0} ns,", c.name()));
    println!(" {:.2} × the fastest peer", fastest / medians[0]);
}

fn main() {
    for scenario in [Scenario::Uniform, Scenario::Clustered] {
        let scene = scenario.start(BOXES, 1);
        let boxes = scene.boxes();
        let contestants = contestants(boxes);
        let mut state = 1;
        let mut unit = || (splitmix::next(&mut state) >> 40) as f32 / (1 << 24) as f32;
        let low = boxes.iter().fold([f32::INFINITY; 3], |low, b| [0, 1, 2].map(|a| low[a].min(b.min[a])));
        let high = boxes.iter().fold([f32::NEG_INFINITY; 3], |high, b| [0, 1, 2].map(|a| high[a].max(b.max[a])));
        let rays: Vec<Ray> = (0..QUERIES)
            .map(|_| {
                let origin = [0, 1, 2].map(|a| low[a] + unit() * (high[a] - low[a]));
                // Evenly over the sphere.
                let direction = loop {
                    let v = [0; 3].map(|_| 2.0 * unit() - 1.0);
                    let square: f32 = v.iter().map(|v| v * v).sum();
                    if (0.01..1.0).contains(&square) {
                        break v.map(|v| v / square.sqrt());
                    }
                };
                Ray::new(origin, direction)
            })
            .collect();
        let regions: Vec<Aabb> =
            (0..QUERIES).map(|_| Aabb::cube(boxes[(unit() * BOXES as f32) as usize].min, HALF)).collect();
        let queries = Queries { rays, regions };
        for (label, kind) in [("first hit", Kind::FirstHit), ("all hits", Kind::AllHits), ("regions", Kind::Region)] {
            race(&format!("{scenario}, {label}"), &contestants, &queries, kind);
        }
    }
}
