//! Every algorithm, on every SIMD level and several thread counts, against the naive oracle.

mod common;

use common::{Random, WORLDS, denormals, every_algorithm, large_boxes, lattice, naive};
use sapwise::algorithm::SimdLevel;
use sapwise::error::BoxDefect;
use sapwise::{Aabb, BroadPhase, Error, PairOrder, Pairs};
use sapwise_scenes::Scenario;

fn assert_all_agree(name: &str, boxes: &[Aabb], algorithms: &mut [(String, Box<dyn BroadPhase>)]) {
    let expected = naive(boxes);
    for (id, algorithm) in algorithms {
        let mut canonical = Pairs::with_order(PairOrder::Canonical);
        algorithm.find_pairs(boxes, &mut canonical).unwrap();
        assert!(canonical.as_slice() == expected, "{id} on {name}: {} pairs, not {}", canonical.len(), expected.len());
        let mut any = Pairs::new();
        algorithm.find_pairs(boxes, &mut any).unwrap();
        assert_eq!(any.fingerprint(), canonical.fingerprint(), "{id} on {name} in any order");
    }
}

#[test]
fn random_boxes_of_every_small_count() {
    let mut algorithms = every_algorithm();
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for count in (0..70).chain([127, 128, 129, 255, 256, 257, 1000, 1023, 1024, 1025]) {
        assert_all_agree("a cube", &random.cubes(count, [8.0; 3], 0.7), &mut algorithms);
    }
}

#[test]
fn every_scenario_on_several_frames() {
    let mut algorithms = every_algorithm();
    for scenario in Scenario::ALL {
        for objects in [10, 500, if cfg!(feature = "long-tests") { 4000 } else { 2500 }] {
            let mut scene = scenario.start(objects, 42);
            for frame in 0..3 {
                assert_all_agree(&format!("{scenario} frame {frame}"), scene.boxes(), &mut algorithms);
                // Fragmentation begins with ten boxes and grows slowly.
                (0..if scenario == Scenario::Fragmentation { 90 } else { 2 }).for_each(|_| scene.advance());
            }
        }
    }
}

#[test]
fn search_ends_soon_after_the_limit() {
    // 5 * 10^11 pairs: counting all would take minutes.
    let boxes = vec![Aabb::cube([1.0; 3], 0.0); 1 << 20];
    let fastest = SimdLevel::detected().to_string();
    for (id, mut algorithm) in every_algorithm().into_iter().filter(|(id, _)| id.contains(&fastest)) {
        let mut pairs = Pairs::new();
        for limit in [100, 100_000] {
            pairs.set_limit(Some(limit));
            assert_eq!(algorithm.find_pairs(&boxes, &mut pairs), Err(Error::TooManyPairs { limit }), "{id}");
        }
        pairs.set_limit(None);
        algorithm.find_pairs(&boxes[..100], &mut pairs).unwrap();
        assert_eq!(pairs.len(), 4950, "{id} after the errors");
    }
}

#[test]
fn worlds_of_every_shape() {
    let mut algorithms = every_algorithm();
    let mut random = Random(7);
    for world in WORLDS {
        assert_all_agree("a world", &random.cubes(3000, world, 0.5), &mut algorithms);
    }
    assert_all_agree("a world of denormals", &denormals(&mut random), &mut algorithms);
}

#[test]
fn sorted_intervals_on_one_axis() {
    let mut random = Random(13);
    let mut starts: Vec<f32> = (0..3000).map(|_| (random.next() * 456_000.0).floor()).collect();
    starts.sort_unstable_by(f32::total_cmp);
    let mut intervals = vec![Aabb::flat([0.0; 2], [456_000.0, 0.0])];
    intervals.extend(starts.iter().map(|&s| Aabb::flat([s, 0.0], [s + 100.0 + (random.next() * 2900.0).floor(), 0.0])));
    assert_all_agree("intervals", &intervals, &mut every_algorithm());
}

#[test]
fn boxes_on_a_lattice_touch_exactly() {
    let mut algorithms = every_algorithm();
    assert_all_agree("a lattice", &lattice(), &mut algorithms);
}

#[test]
fn large_boxes_among_small_ones() {
    let mut algorithms = every_algorithm();
    assert_all_agree("large boxes", &large_boxes(), &mut algorithms);
}

#[test]
fn clusters_and_outliers() {
    let mut algorithms = every_algorithm();
    let mut random = Random(5);
    let mut boxes = Vec::new();
    for _ in 0..6 {
        let at = [random.next() * 500.0, random.next() * 500.0, random.next() * 500.0];
        boxes.extend(
            random
                .cubes(500, [8.0; 3], 0.5)
                .iter()
                .map(|b| Aabb::new([0, 1, 2].map(|a| b.min[a] + at[a]), [0, 1, 2].map(|a| b.max[a] + at[a]))),
        );
    }
    for far in [1.0e6, -1.0e9, 3.0e38] {
        boxes.push(Aabb::cube([far, 0.0, far], 0.5));
        boxes.push(Aabb::cube([0.0, far, 0.0], 1.0));
    }
    assert_all_agree("clusters", &boxes, &mut algorithms);
}

/// Fewer boxes do not keep seven threads busy.
#[test]
fn scenes_for_seven_threads() {
    let mut algorithms = every_algorithm();
    for scenario in [Scenario::Uniform, Scenario::Clustered, Scenario::Mixed] {
        assert_all_agree(&format!("a large {scenario}"), scenario.start(7500, 3).boxes(), &mut algorithms);
    }
    let mut random = Random(17);
    assert_all_agree("a flat world", &random.cubes(7500, [400.0, 1.0, 1.0], 0.2), &mut algorithms);
    let mut boxes = large_boxes();
    boxes.extend(random.cubes(4000, [60.0, 50.0, 40.0], 0.3));
    assert_all_agree("many large boxes", &boxes, &mut algorithms);
}

#[test]
fn infinite_and_empty_boxes_are_legal() {
    let mut algorithms = every_algorithm();
    let mut random = Random(3);
    let inf = f32::INFINITY;
    let mut boxes = random.cubes(1500, [20.0; 3], 0.5);
    boxes.push(Aabb::new([-inf; 3], [inf; 3]));
    boxes.insert(0, Aabb::new([-inf, 0.0, 0.0], [inf, 1.0, 1.0]));
    boxes.push(Aabb::new([5.0, -inf, 5.0], [5.0, inf, inf]));
    boxes.push(Aabb::new([inf; 3], [inf; 3]));
    boxes.push(Aabb::new([-inf; 3], [-inf; 3]));
    boxes.push(Aabb::new([f32::MIN; 3], [f32::MAX; 3]));
    boxes.push(Aabb::new([-0.0; 3], [0.0; 3]));
    boxes.push(Aabb::new([0.0; 3], [-0.0; 3]));
    boxes.extend((0..50).map(|k| Aabb::cube([k as f32 * 0.25; 3], 0.0)));
    assert_all_agree("infinite boxes", &boxes, &mut algorithms);
    let lines: Vec<Aabb> = (0..600).map(|k| Aabb::new([-inf, k as f32, -inf], [inf, k as f32 + 1.0, inf])).collect();
    assert_all_agree("infinite slabs", &lines, &mut algorithms);
}

#[test]
fn identical_boxes_all_pair() {
    let mut algorithms = every_algorithm();
    assert_all_agree("identical boxes", &[Aabb::cube([3.0; 3], 1.0); 700], &mut algorithms);
    assert_all_agree("identical points", &[Aabb::cube([3.0; 3], 0.0); 700], &mut algorithms);
}

#[test]
fn the_first_invalid_box_is_named() {
    let mut random = Random(11);
    for (id, mut algorithm) in every_algorithm() {
        let mut pairs = Pairs::new();
        for at in [0, 1, 63, 64, 1000, 4999] {
            for (defect, bad) in [
                (BoxDefect::NotANumber, Aabb::new([0.0, 0.0, f32::NAN], [1.0; 3])),
                (BoxDefect::NotANumber, Aabb::new([0.0; 3], [f32::NAN, 1.0, 1.0])),
                (BoxDefect::Inverted, Aabb::new([0.0, 2.0, 0.0], [1.0; 3])),
            ] {
                let mut boxes = random.cubes(5000, [30.0; 3], 0.5);
                boxes[at] = bad;
                boxes[4999] = bad;
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
fn one_pair_beyond_the_limit_is_an_error() {
    let boxes = [Aabb::cube([3.0; 3], 1.0); 2000];
    for (id, mut algorithm) in every_algorithm() {
        let mut pairs = Pairs::new();
        for limit in [0, 1000, 1_998_999] {
            pairs.set_limit(Some(limit));
            assert_eq!(algorithm.find_pairs(&boxes, &mut pairs), Err(Error::TooManyPairs { limit }), "{id}");
        }
        pairs.set_limit(Some(1_999_000));
        algorithm.find_pairs(&boxes, &mut pairs).unwrap();
        assert_eq!(pairs.len(), 1_999_000, "{id}");
    }
}
