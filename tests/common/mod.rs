//! Shared by the test programs of the contract.
#![allow(dead_code, reason = "each test program uses a part of this")]

use sapwise::algorithm::{Entry, Load, SimdLevel};
use sapwise::error::BoxDefect;
use sapwise::internals::Pair;
use sapwise::tuning::{AlgorithmCost, CostCurve, CostTerm, Source, Term};
use sapwise::{Aabb, AlgorithmId, BroadPhase, Error, Filter, Membership, PairOrder, Pairs, Registry, Tuning};

/// Algorithms with their names.
pub(crate) type Algorithms = Vec<(String, Box<dyn BroadPhase>)>;

/// Returns a tuning in which each algorithm costs these nanoseconds for a call and for an object, in the revisions of
/// `entries`.
pub(crate) fn tuning(entries: &[Entry], spread_ln: f64, costs: &[(&str, f64, f64)]) -> Tuning {
    let cost = |&(id, call, object): &(&str, f64, f64)| {
        let id: AlgorithmId = id.parse().unwrap();
        let same = |e: &&Entry| e.id.method() == id.method() && e.id.backend().class() == id.backend().class();
        let revision = entries.iter().find(same).map_or(1, |e| e.revision);
        let curve = CostCurve::new(vec![CostTerm::new(Term::Call, call), CostTerm::new(Term::Objects, object)]);
        AlgorithmCost::new(id, revision, curve, spread_ln)
    };
    let loads: Vec<Load> = (0..16).map(|k| Load::of_objects(1 << k)).collect();
    Tuning::from_costs(Source::Measured, "uniform", costs.iter().map(cost).collect(), &loads)
}

/// The oracle: the definition of overlap, in a double loop.
pub(crate) fn naive(boxes: &[Aabb]) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for i in 0..boxes.len() {
        for j in i + 1..boxes.len() {
            if boxes[i].overlaps(&boxes[j]) {
                pairs.push((i as u32, j as u32));
            }
        }
    }
    pairs
}

/// The oracle for frames in which a double loop takes seconds: sorts the boxes by their begin on an axis, and tests
/// each against those that begin before it ends. No NaN.
pub(crate) fn swept(boxes: &[Aabb]) -> Vec<Pair> {
    // On the axis with the fewest tests: on another one all boxes of a tower are candidates.
    let axes = [0, 1, 2].map(|axis| along(boxes, axis));
    let (order, ends) = axes.into_iter().min_by_key(|(_, ends)| ends.iter().sum::<usize>()).unwrap();
    let mut pairs = Vec::new();
    for (k, &i) in order.iter().enumerate() {
        for &j in &order[k + 1..ends[k]] {
            if boxes[i as usize].overlaps(&boxes[j as usize]) {
                pairs.push((i.min(j), i.max(j)));
            }
        }
    }
    pairs.sort_unstable();
    pairs
}

/// Returns the boxes in the order in which they begin on an axis, and for each place how many boxes begin before its
/// box ends.
fn along(boxes: &[Aabb], axis: usize) -> (Vec<u32>, Vec<usize>) {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    order.sort_by(|&a, &b| boxes[a as usize].min[axis].total_cmp(&boxes[b as usize].min[axis]));
    let begin = |j: &u32| boxes[*j as usize].min[axis];
    let ends = order.iter().map(|&i| order.partition_point(|j| begin(j) <= boxes[i as usize].max[axis])).collect();
    (order, ends)
}

/// Returns a registry of that many cores at every SIMD level of this machine.
pub(crate) fn registries(cores: u32) -> impl Iterator<Item = (SimdLevel, Registry)> {
    SimdLevel::ALL.into_iter().filter(|&level| level <= SimdLevel::detected()).map(move |level| {
        let mut registry = Registry::with_cores(cores);
        registry.limit_simd(level);
        (level, registry)
    })
}

/// Returns what `make` returns at every SIMD level, for one core and for two.
pub(crate) fn at_every_level<T>(make: impl Fn(&Registry) -> T) -> Vec<(String, T)> {
    let of = |cores| registries(cores).map(move |(level, registry)| (format!("{level}, {cores} threads"), registry));
    [1, 2].into_iter().flat_map(of).map(|(name, registry)| (name, make(&registry))).collect()
}

/// Returns every method on 1, 2, 3 and 7 threads at every SIMD level of this machine.
pub(crate) fn every_algorithm() -> Algorithms {
    let mut all = Vec::new();
    for (level, registry) in registries(7) {
        let ones = registry.entries().iter().filter(|e| e.id.threads() == 1);
        let methods: Vec<String> = ones.map(|e| e.id.method().to_owned()).collect();
        for method in methods {
            for threads in [1, 2, 3, 7] {
                let id: AlgorithmId = format!("{method}@cpu{threads}").parse().unwrap();
                match registry.create(&id) {
                    Ok(algorithm) => all.push((format!("{id} at {level}"), algorithm)),
                    Err(Error::Unavailable { .. }) if threads > 1 && !cfg!(feature = "parallel") => {}
                    Err(error) => panic!("{id}: {error}"),
                }
            }
        }
    }
    all
}

/// Returns an empty list in canonical order with the filter of these memberships.
pub(crate) fn filtered(memberships: &[Membership]) -> Pairs {
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    pairs.set_filter(Some(Filter::new(memberships.to_vec())));
    pairs
}

/// The oracle with a filter, by its definition.
pub(crate) fn naive_filtered(boxes: &[Aabb], memberships: &[Membership]) -> Vec<Pair> {
    let of = |k: u32| memberships.get(k as usize).copied().unwrap_or_default();
    let mut pairs = naive(boxes);
    pairs.retain(|&(i, j)| {
        let (a, b) = (of(i), of(j));
        let apart = a.owner == 0 || a.owner != b.owner;
        a.groups & b.mask != 0 && b.groups & a.mask != 0 && !(a.fixed && b.fixed) && apart
    });
    pairs
}

/// Asserts that each algorithm finds these pairs, under the filter of `pairs` and in its order, which is canonical.
pub(crate) fn assert_each_finds(
    expected: &[Pair],
    algorithms: &mut [(String, Box<dyn BroadPhase>)],
    boxes: &[Aabb],
    pairs: &mut Pairs,
    what: &str,
) {
    for (id, algorithm) in algorithms {
        // Spoils the list: the previous algorithm left the right answer in it.
        pairs.push(u32::MAX - 1, u32::MAX);
        algorithm.find_pairs(boxes, pairs).unwrap_or_else(|e| panic!("{id}, {what}: {e}"));
        assert!(pairs.as_slice() == expected, "{id}, {what}: {} pairs, not {}", pairs.len(), expected.len());
    }
}

/// Asserts that each algorithm names the first of two invalid boxes among `count`, the second of which is the last,
/// and goes on.
pub(crate) fn assert_each_names_the_first_invalid(algorithms: Algorithms, count: usize, places: &[usize]) {
    let mut random = Random(11);
    for (id, mut algorithm) in algorithms {
        let mut pairs = Pairs::new();
        for &at in places {
            for (defect, bad) in [
                (BoxDefect::NotANumber, Aabb::new([0.0, 0.0, f32::NAN], [1.0; 3])),
                (BoxDefect::NotANumber, Aabb::new([0.0; 3], [f32::NAN, 1.0, 1.0])),
                (BoxDefect::NotANumber, Aabb::new([f32::NAN; 3], [f32::NAN; 3])),
                (BoxDefect::Inverted, Aabb::new([29.0, 0.0, 0.0], [1.0; 3])),
                (BoxDefect::Inverted, Aabb::new([0.0, 2.0, 0.0], [1.0; 3])),
                (BoxDefect::Inverted, Aabb::new([0.0, 0.0, 29.0], [1.0; 3])),
                (BoxDefect::Inverted, Aabb::new([29.0; 3], [1.0; 3])),
            ] {
                let mut boxes = random.cubes(count, [30.0; 3], 0.5);
                (boxes[at], boxes[count - 1]) = (bad, bad);
                let error = algorithm.find_pairs(&boxes, &mut pairs).unwrap_err();
                assert_eq!(error, Error::InvalidBox { index: at, defect }, "{id}");
            }
        }
        let boxes = random.cubes(500, [10.0; 3], 0.5);
        algorithm.find_pairs(&boxes, &mut pairs).unwrap();
        assert_eq!(pairs.len(), naive(&boxes).len(), "{id} after errors");
    }
}

/// Marsaglia's xorshift: the tests use no generator of the library.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Returns a float from 0 to 1.
    pub(crate) fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }

    /// Returns one or two of eight groups and a mask without some of them. One box in four is fixed, three in four
    /// have one of three owners, and one in sixteen is in every group.
    pub(crate) fn membership(&mut self) -> Membership {
        let group = |at: f32| 1 << (at * 8.0) as u32;
        let (groups, mask) = (group(self.next()) | group(self.next()), !(group(self.next()) | group(self.next())));
        let fixed = self.next() < 0.25;
        if self.next() < 1.0 / 16.0 {
            Membership::default()
        } else {
            Membership { groups, mask, fixed, owner: (self.next() * 4.0) as u32 }
        }
    }

    /// Returns cubes of up to 1.1 times this half edge in a world of this size.
    pub(crate) fn cubes(&mut self, count: usize, world: [f32; 3], half: f32) -> Vec<Aabb> {
        (0..count).map(|_| Aabb::cube(world.map(|side| self.next() * side), half * (0.1 + self.next()))).collect()
    }
}

/// Sizes of flat, thin, deep, empty and plain worlds.
pub(crate) const WORLDS: [[f32; 3]; 7] = [
    [400.0, 1.0, 1.0],
    [1.0, 300.0, 2.0],
    [60.0, 60.0, 0.0],
    [2.0, 50.0, 50.0],
    [40.0, 40.0, 0.0],
    [0.0; 3],
    [16.0; 3],
];

/// Returns a world with denormal bounds.
pub(crate) fn denormals(random: &mut Random) -> Vec<Aabb> {
    let shrunk = |v: [f32; 3]| v.map(|x| (x - 8.0) * 1.0e-39);
    let plain = random.cubes(3000, [16.0; 3], 0.5);
    plain.iter().map(|b| Aabb::new(shrunk(b.min), shrunk(b.max))).collect()
}

/// Returns cubes that touch their neighbours exactly.
pub(crate) fn lattice() -> Vec<Aabb> {
    (0..2744).map(|k| Aabb::cube([(k % 14) as f32, (k / 14 % 14) as f32, (k / 196) as f32], 0.5)).collect()
}

/// Returns small boxes, and among them plates, rods and world-sized boxes.
pub(crate) fn large_boxes() -> Vec<Aabb> {
    let mut random = Random(99);
    let mut boxes = random.cubes(4000, [60.0, 50.0, 40.0], 0.3);
    for k in 0..40 {
        let size = [[50.0, 50.0, 0.1], [0.1, 80.0, 0.1], [0.1, 0.1, 80.0], [100.0; 3], [90.0, 0.2, 0.2]][k % 5];
        let at = [random.next() * 60.0 - 20.0, random.next() * 50.0 - 20.0, random.next() * 40.0 - 20.0];
        boxes.insert(k * 97, Aabb::new(at, [at[0] + size[0], at[1] + size[1], at[2] + size[2]]));
    }
    boxes
}

/// Returns scenes with their names: worlds of every shape with `count` boxes, and boxes of every kind that is legal.
pub(crate) fn scenes(count: usize) -> Vec<(&'static str, Vec<Aabb>)> {
    let mut random = Random(7);
    let mut scenes: Vec<_> = WORLDS.map(|world| ("a world", random.cubes(count, world, 0.5))).into();
    let inf = f32::INFINITY;
    let mut starts: Vec<f32> = (0..3000).map(|_| (random.next() * 456_000.0).floor()).collect();
    starts.sort_unstable_by(f32::total_cmp);
    let mut intervals = vec![Aabb::flat([0.0; 2], [456_000.0, 0.0])];
    intervals.extend(starts.iter().map(|&s| Aabb::flat([s, 0.0], [s + 100.0 + (random.next() * 2900.0).floor(), 0.0])));
    let mut clusters = Vec::new();
    for _ in 0..6 {
        let at = [0; 3].map(|_| random.next() * 500.0);
        let moved = |of: [f32; 3]| [0, 1, 2].map(|a| of[a] + at[a]);
        let cubes = random.cubes(500, [8.0; 3], 0.5);
        clusters.extend(cubes.iter().map(|b| Aabb::new(moved(b.min), moved(b.max))));
    }
    let mut infinite = large_boxes();
    infinite.insert(0, Aabb::new([-inf, 0.0, 0.0], [inf, 1.0, 1.0]));
    infinite.extend([
        Aabb::new([-inf; 3], [inf; 3]),
        Aabb::new([5.0, -inf, 5.0], [5.0, inf, inf]),
        Aabb::new([inf; 3], [inf; 3]),
        Aabb::new([-inf; 3], [-inf; 3]),
        Aabb::new([f32::MIN; 3], [f32::MAX; 3]),
        Aabb::new([-0.0; 3], [0.0; 3]),
        Aabb::new([0.0; 3], [-0.0; 3]),
    ]);
    infinite.extend((0..50).map(|k| Aabb::cube([k as f32 * 0.25; 3], 0.0)));
    for far in [1.0e6, -1.0e9, 3.0e38] {
        let two = [Aabb::cube([far, 0.0, far], 0.5), Aabb::cube([0.0, far, 0.0], 1.0)];
        infinite.extend(two);
        clusters.extend(two);
    }
    let slab = |k: i32| Aabb::new([-inf, k as f32, -inf], [inf, k as f32 + 1.0, inf]);
    scenes.extend([
        ("a world of denormals", denormals(&mut random)),
        ("a lattice", lattice()),
        ("sorted intervals", intervals),
        ("clusters and outliers", clusters),
        ("large boxes", large_boxes()),
        ("infinite boxes", infinite),
        ("infinite slabs", (0..600).map(slab).collect()),
        ("identical boxes", vec![Aabb::cube([3.0; 3], 1.0); 700]),
        ("identical points", vec![Aabb::cube([3.0; 3], 0.0); 700]),
    ]);
    scenes
}
