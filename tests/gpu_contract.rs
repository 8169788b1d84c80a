//! Every algorithm on every GPU of this machine, alone and together, against the naive oracle.
//!
//! Without a GPU the tests say so and pass, unless `SAPWISE_REQUIRE_GPU=1`.

mod common;

use common::{Random, WORLDS, denormals, gpus, large_boxes, lattice, naive, naive_filtered, swept};
use sapwise::gpu::{Gpus, broad_phase};
use sapwise::{Aabb, BoxDefect, BroadPhase, Error, Filter, Membership, PairOrder, Pairs, Registry};
use sapwise_scenes::Scenario;

/// Boxes up to which the oracle is the double loop.
const MOST_FOR_NAIVE: usize = 5000;

/// Every algorithm of the registry on GPUs, and each method on two devices of the first GPU.
fn every_algorithm(gpus: &Gpus) -> Vec<(String, Box<dyn BroadPhase>)> {
    let mut registry = Registry::with_cores(1);
    registry.add_gpus(gpus);
    let ids = registry.available().into_iter().map(|e| e.id).filter(|id| id.to_string().contains("@gpu"));
    let mut all: Vec<(String, Box<dyn BroadPhase>)> =
        ids.map(|id| (id.to_string(), registry.create(&id).unwrap())).collect();
    for method in ["brute", "sap", "grid-sap", "bvh"] {
        let devices = vec![gpus.open(0).unwrap(), gpus.open_another(0).unwrap()];
        all.push((format!("{method} on gpu0 twice"), broad_phase(method, devices).unwrap()));
    }
    all
}

fn assert_all_agree(name: &str, boxes: &[Aabb], algorithms: &mut [(String, Box<dyn BroadPhase>)]) {
    // A double loop over 65 536 boxes takes seconds, and was most of the time of these tests.
    let expected = if boxes.len() > MOST_FOR_NAIVE { swept(boxes) } else { naive(boxes) };
    for (id, algorithm) in algorithms {
        let mut canonical = Pairs::with_order(PairOrder::Canonical);
        algorithm.find_pairs(boxes, &mut canonical).unwrap_or_else(|e| panic!("{id} on {name}: {e}"));
        assert!(canonical.as_slice() == expected, "{id} on {name}: {} pairs, not {}", canonical.len(), expected.len());
    }
}

#[test]
fn the_oracle_of_large_frames_is_the_double_loop() {
    for scenario in Scenario::ALL {
        for objects in [0, 1, 2, 33, MOST_FOR_NAIVE] {
            let boxes = frame(scenario, objects);
            assert!(swept(&boxes) == naive(&boxes), "{scenario} of {objects}");
        }
    }
    assert!(swept(&lattice()) == naive(&lattice()) && swept(&large_boxes()) == naive(&large_boxes()));
}

#[test]
fn random_boxes_of_every_small_count() {
    let Some(gpus) = gpus() else { return };
    let mut algorithms = every_algorithm(&gpus);
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for count in [0, 1, 2, 3, 31, 32, 33, 63, 64, 65, 127, 128, 129, 255, 256, 257, 1000, 1023, 1024, 1025, 2049] {
        assert_all_agree("a cube", &random.cubes(count, [8.0; 3], 0.7), &mut algorithms);
    }
}

/// Every scenario at the sizes where blocks and tiles begin and end. Brute force on a software adapter takes up to a
/// minute at the large ones: those are left to [`every_algorithm_on_every_scenario_at_every_size`].
#[test]
fn every_scenario_at_the_edges_of_blocks() {
    let Some(gpus) = gpus() else { return };
    let mut algorithms = every_algorithm(&gpus);
    for (k, scenario) in Scenario::ALL.into_iter().enumerate() {
        for objects in [0, 1, 2, 31, 32, 33, 1000] {
            assert_all_agree(&format!("{scenario} of {objects}"), &frame(scenario, objects), &mut algorithms);
        }
        // The hard ones, which come last, are quadratic on a GPU: at the sizes of the others a software adapter takes minutes.
        let hard = scenario > Scenario::Fragmentation;
        let large = if hard { 4097 + k } else { [65_535, 65_536, 65_537, 40_961 + 1009 * k][k % 4] };
        let fast = |id: &str| !id.contains("brute");
        let (mut fast, rest): (Vec<_>, Vec<_>) = algorithms.into_iter().partition(|(id, _)| fast(id));
        assert_all_agree(&format!("{scenario} of {large}"), &frame(scenario, large), &mut fast);
        algorithms = fast.into_iter().chain(rest).collect();
    }
}

#[test]
#[ignore = "takes very long on a software adapter; tools/real-gpu.sh runs it on real ones"]
fn every_algorithm_on_every_scenario_at_every_size() {
    let Some(gpus) = gpus() else { return };
    let mut algorithms = every_algorithm(&gpus);
    for scenario in Scenario::ALL {
        for objects in [0, 1, 2, 31, 32, 33, 1000, 65_535, 65_536, 65_537, 54_321] {
            assert_all_agree(&format!("{scenario} of {objects}"), &frame(scenario, objects), &mut algorithms);
        }
        println!("{scenario}: {} algorithms agree with the oracle at 11 sizes", algorithms.len());
    }
}

/// A frame with that many boxes.
fn frame(scenario: Scenario, objects: usize) -> Vec<Aabb> {
    let mut scene = scenario.start(objects, 42);
    // Fragmentation alone changes its number, and reaches the largest within a cycle.
    let frames = if scenario == Scenario::Fragmentation { Scenario::FRAGMENTATION_FRAMES } else { 2 };
    for _ in 0..frames {
        scene.advance();
        if scene.frame() > 1 && scene.boxes().len() == objects {
            break;
        }
    }
    scene.boxes().to_vec()
}

#[test]
fn worlds_of_every_shape() {
    let Some(gpus) = gpus() else { return };
    let mut algorithms = every_algorithm(&gpus);
    let mut random = Random(7);
    for world in WORLDS {
        assert_all_agree("a world", &random.cubes(3000, world, 0.5), &mut algorithms);
    }
    assert_all_agree("a world of denormals", &denormals(&mut random), &mut algorithms);
    assert_all_agree("a lattice", &lattice(), &mut algorithms);
}

#[test]
fn large_infinite_and_far_boxes() {
    let Some(gpus) = gpus() else { return };
    let mut algorithms = every_algorithm(&gpus);
    let mut boxes = large_boxes();
    assert_all_agree("large boxes", &boxes, &mut algorithms);
    let inf = f32::INFINITY;
    boxes.push(Aabb::new([-inf; 3], [inf; 3]));
    boxes.insert(0, Aabb::new([-inf, 0.0, 0.0], [inf, 1.0, 1.0]));
    boxes.push(Aabb::new([5.0, -inf, 5.0], [5.0, inf, inf]));
    boxes.push(Aabb::new([inf; 3], [inf; 3]));
    boxes.push(Aabb::new([-inf; 3], [-inf; 3]));
    boxes.push(Aabb::new([f32::MIN; 3], [f32::MAX; 3]));
    boxes.push(Aabb::new([-0.0; 3], [0.0; 3]));
    boxes.push(Aabb::new([0.0; 3], [-0.0; 3]));
    for far in [1.0e6, -1.0e9, 3.0e38] {
        boxes.push(Aabb::cube([far, 0.0, far], 0.5));
        boxes.push(Aabb::cube([0.0, far, 0.0], 1.0));
    }
    assert_all_agree("infinite boxes", &boxes, &mut algorithms);
    let lines: Vec<Aabb> = (0..600).map(|k| Aabb::new([-inf, k as f32, -inf], [inf, k as f32 + 1.0, inf])).collect();
    assert_all_agree("infinite slabs", &lines, &mut algorithms);
    assert_all_agree("identical points", &[Aabb::cube([3.0; 3], 0.0); 700], &mut algorithms);
}

#[test]
fn a_filter_keeps_pairs_out_and_the_limit_counts_the_others() {
    let Some(gpus) = gpus() else { return };
    let mut random = Random(13);
    // Scenes of more pairs than the list of a GPU holds at first, among them.
    let scenes =
        [random.cubes(900, [11.0; 3], 0.7), random.cubes(3000, [9.0; 3], 1.2), vec![Aabb::cube([3.0; 3], 1.0); 700]];
    for (id, mut algorithm) in every_algorithm(&gpus) {
        let mut pairs = Pairs::with_order(PairOrder::Canonical);
        pairs.set_filter(Some(Filter::default()));
        for (scene, boxes) in scenes.iter().enumerate() {
            let memberships: Vec<Membership> = (0..boxes.len() - 5).map(|_| random.membership()).collect();
            let expected = naive_filtered(boxes, &memberships);
            let is_fixed = |id: u32| memberships.get(id as usize).is_some_and(|m| m.fixed);
            let all = naive(boxes).iter().filter(|&&(i, j)| !(is_fixed(i) && is_fixed(j))).count();
            pairs.filter_mut().unwrap().memberships = memberships;
            pairs.set_limit(Some(expected.len()));
            algorithm.find_pairs(boxes, &mut pairs).unwrap_or_else(|e| panic!("{id} on scene {scene}: {e}"));
            assert!(
                pairs.as_slice() == expected,
                "{id} on scene {scene}: {} pairs, not {}",
                pairs.len(),
                expected.len()
            );
            assert_eq!(pairs.overlapping(), all as u64, "{id} on scene {scene}");
            let limit = expected.len() - 1;
            pairs.set_limit(Some(limit));
            let refused = Err(Error::TooManyPairs { limit });
            assert_eq!(algorithm.find_pairs(boxes, &mut pairs), refused, "{id} on scene {scene}");
        }
    }
}

#[test]
fn the_first_invalid_box_is_named() {
    let Some(gpus) = gpus() else { return };
    let mut random = Random(11);
    for (id, mut algorithm) in every_algorithm(&gpus) {
        let mut pairs = Pairs::new();
        for at in [0, 1, 127, 1000, 1499] {
            for (defect, bad) in [
                (BoxDefect::NotANumber, Aabb::new([0.0, 0.0, f32::NAN], [1.0; 3])),
                (BoxDefect::NotANumber, Aabb::new([f32::NAN; 3], [f32::NAN; 3])),
                (BoxDefect::Inverted, Aabb::new([0.0, 2.0, 0.0], [1.0; 3])),
                (BoxDefect::Inverted, Aabb::new([29.0; 3], [1.0; 3])),
            ] {
                let mut boxes = random.cubes(1500, [20.0; 3], 0.5);
                boxes[at] = bad;
                boxes[1499] = bad;
                let error = algorithm.find_pairs(&boxes, &mut pairs).unwrap_err();
                assert_eq!(error, Error::InvalidBox { index: at, defect }, "{id}");
            }
        }
        let boxes = random.cubes(500, [10.0; 3], 0.5);
        algorithm.find_pairs(&boxes, &mut pairs).unwrap();
        assert_eq!(pairs.len(), naive(&boxes).len(), "{id} after errors");
    }
}

#[test]
fn ten_million_pairs_come_whole_and_a_limit_refuses_them() {
    let Some(gpus) = gpus() else { return };
    let boxes: Vec<Aabb> = (0..5000).map(|k| Aabb::cube([k as f32 * 1e-4, 0.0, 0.0], 1.0)).collect();
    let all = 5000 * 4999 / 2;
    for (id, mut algorithm) in every_algorithm(&gpus) {
        let mut pairs = Pairs::new();
        pairs.set_limit(Some(1000));
        assert_eq!(algorithm.find_pairs(&boxes, &mut pairs), Err(Error::TooManyPairs { limit: 1000 }), "{id}");
        pairs.set_limit(None);
        for frame in 0..2 {
            algorithm.find_pairs(&boxes, &mut pairs).unwrap();
            assert_eq!(pairs.len() as u64, all, "{id} in frame {frame}");
            let sum: u64 = pairs.iter().map(|&(i, j)| u64::from(j) * u64::from(j > i)).sum();
            assert_eq!(sum, (0..5000_u64).map(|j| j * j).sum::<u64>(), "{id} in frame {frame}");
        }
    }
}

/// More candidates than one submission tests, and than the 65 535 turns after which one driver ends a loop silently. A unit test of the engine
/// has rows that go on in every method.
#[test]
fn rows_of_very_many_candidates_lose_no_pair() {
    let Some(gpus) = gpus() else { return };
    let mut row: Vec<Aabb> = (0..70_000).map(|k| Aabb::cube([k as f32, (k % 7) as f32 * 3.0, 0.0], 0.4)).collect();
    row.push(Aabb::new([-1.0, -1.0, -1.0], [80_000.0, 2.0, 1.0]));
    let hits = (0..70_000_u32).filter(|k| k % 7 == 0).count();
    // No more than that: a software adapter on two slow cores takes a second for ten million tests, and after a minute it counts as lost.
    let point = [Aabb::cube([1.0; 3], 0.5); 12_000];
    for (id, mut algorithm) in every_algorithm(&gpus).into_iter().filter(|(id, _)| !id.contains("brute")) {
        let mut pairs = Pairs::with_order(PairOrder::Canonical);
        algorithm.find_pairs(&row, &mut pairs).unwrap();
        assert!(
            pairs.len() == hits && pairs.iter().all(|&(i, j)| i % 7 == 0 && j == 70_000),
            "{id}: {} pairs",
            pairs.len()
        );
        // Quadratic, so once for each method and GPU.
        if !id.contains('+') && !id.contains("twice") {
            pairs.set_limit(Some(1000));
            assert_eq!(algorithm.find_pairs(&point, &mut pairs), Err(Error::TooManyPairs { limit: 1000 }), "{id}");
        }
    }
}

#[test]
fn the_order_is_the_same_in_every_run() {
    let Some(gpus) = gpus() else { return };
    let boxes = frame(Scenario::Clustered, 3000);
    let list = |algorithm: &mut dyn BroadPhase| {
        let mut pairs = Pairs::new();
        algorithm.find_pairs(&boxes, &mut pairs).unwrap();
        pairs.as_slice().to_vec()
    };
    let mut registry = Registry::with_cores(1);
    registry.add_gpus(&gpus);
    // Where several GPUs share a frame the cuts follow their measured speeds, and the order follows the cuts.
    for id in registry.available().into_iter().map(|e| e.id).filter(|id| id.to_string().contains("@gpu")) {
        if id.to_string().contains('+') {
            continue;
        }
        let first = list(registry.create(&id).unwrap().as_mut());
        for _ in 0..3 {
            assert_eq!(list(registry.create(&id).unwrap().as_mut()), first, "{id}");
        }
    }
}
