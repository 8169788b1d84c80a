//! Every algorithm, on every SIMD level and several thread counts, against the naive oracle.

mod common;

use common::{
    Algorithms, Random, assert_each_finds, assert_each_names_the_first_invalid, every_algorithm, large_boxes, naive,
    scenes,
};
use sapwise::algorithm::SimdLevel;
use sapwise::{Aabb, BroadPhase, Error, PairOrder, Pairs};
use sapwise_scenes::Scenario;

fn assert_all_agree(name: &str, boxes: &[Aabb], algorithms: &mut Algorithms) {
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
fn boxes_of_every_kind() {
    let mut algorithms = every_algorithm();
    for (name, boxes) in scenes(3000) {
        assert_all_agree(name, &boxes, &mut algorithms);
    }
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
fn the_first_invalid_box_is_named() {
    assert_each_names_the_first_invalid(every_algorithm(), 5000, &[0, 1, 63, 64, 1000, 4999]);
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

/// Leaves the list of pairs as it is.
struct Idle;

impl BroadPhase for Idle {
    fn find_pairs(&mut self, _: &[Aabb], _: &mut Pairs) -> Result<(), Error> {
        Ok(())
    }
}

#[test]
#[should_panic(expected = "idle, two boxes: 2 pairs, not 1")]
fn algorithm_that_writes_nothing_fails_the_contract() {
    let mut algorithms = every_algorithm();
    algorithms.truncate(1);
    algorithms.push(("idle".to_owned(), Box::new(Idle)));
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    assert_each_finds(&[(0, 1)], &mut algorithms, &[Aabb::cube([0.0; 3], 1.0); 2], &mut pairs, "two boxes");
}
