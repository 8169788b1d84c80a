//! Every algorithm on every GPU of this machine, alone and together, against the naive oracle.
//!
//! Without a GPU the tests print that and pass, unless `SAPWISE_REQUIRE_GPU=1`. The feature `long-tests` adds large
//! frames.

mod common;

use common::{
    Algorithms, METHODS, Random, assert_each_finds, assert_each_names_the_first_invalid, filtered, gpus, naive,
    naive_filtered, scenes, with_gpus,
};
use sapwise::{Aabb, AlgorithmId, BroadPhase, Error, Filter, Membership, PairOrder, Pairs, Registry};
use sapwise_gpu::{Gpus, broad_phase};
use sapwise_scenes::Scenario;

/// Returns the ids of the registry that are on GPUs.
fn on_gpus(registry: &Registry) -> Vec<AlgorithmId> {
    registry.available().into_iter().map(|e| e.id).filter(|id| id.to_string().contains("@gpu")).collect()
}

/// Returns every algorithm of the registry on GPUs, and each method on two devices of the first GPU.
fn every_algorithm(gpus: &Gpus) -> Algorithms {
    let registry = with_gpus(gpus);
    let mut all: Algorithms =
        on_gpus(&registry).iter().map(|id| (id.to_string(), registry.create(id).unwrap())).collect();
    for method in METHODS {
        let devices = vec![gpus.open(0).unwrap(), gpus.open_another(0).unwrap()];
        all.push((format!("{method} on gpu0 twice"), broad_phase(method, devices).unwrap()));
    }
    all
}

fn assert_all_agree(name: &str, boxes: &[Aabb], algorithms: &mut Algorithms) {
    assert_all_find(&naive(boxes), name, boxes, algorithms);
}

fn assert_all_find(expected: &[(u32, u32)], name: &str, boxes: &[Aabb], algorithms: &mut Algorithms) {
    assert_each_finds(expected, algorithms, boxes, &mut Pairs::with_order(PairOrder::Canonical), name);
}

/// Returns a frame with that many boxes.
fn frame(scenario: Scenario, objects: usize) -> Vec<Aabb> {
    let mut scene = scenario.start(objects, 42);
    // Fragmentation alone changes its number of boxes, and reaches the largest within a cycle.
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
fn random_boxes_of_every_small_count() {
    let Some(gpus) = gpus() else { return };
    let mut algorithms = every_algorithm(&gpus);
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for count in [0, 1, 2, 3, 31, 32, 33, 63, 64, 65, 127, 128, 129, 255, 256, 257, 1000, 1023, 1024, 1025, 2049] {
        assert_all_agree("a cube", &random.cubes(count, [8.0; 3], 0.7), &mut algorithms);
    }
}

#[test]
fn every_scenario() {
    let Some(gpus) = gpus() else { return };
    let mut algorithms = every_algorithm(&gpus);
    for scenario in Scenario::ALL {
        for objects in [33, 1000] {
            assert_all_agree(&format!("{scenario} of {objects}"), &frame(scenario, objects), &mut algorithms);
        }
    }
}

#[test]
fn boxes_of_every_kind() {
    let Some(gpus) = gpus() else { return };
    let mut algorithms = every_algorithm(&gpus);
    for (name, boxes) in scenes(1500) {
        assert_all_agree(name, &boxes, &mut algorithms);
    }
}

#[test]
fn the_limit_counts_the_pairs_that_pass_the_filter() {
    let Some(gpus) = gpus() else { return };
    let mut random = Random(13);
    // The second scene has more pairs than the first list of a GPU has room for.
    for boxes in [random.cubes(900, [11.0; 3], 0.7), random.cubes(1500, [9.0; 3], 1.2)] {
        // The last five have no membership.
        let memberships: Vec<Membership> = (0..boxes.len() - 5).map(|_| random.membership()).collect();
        let expected = naive_filtered(&boxes, &memberships);
        let limit = expected.len() - 1;
        for (id, mut algorithm) in every_algorithm(&gpus) {
            let mut pairs = filtered(&memberships);
            pairs.set_limit(Some(expected.len()));
            algorithm.find_pairs(&boxes, &mut pairs).unwrap_or_else(|e| panic!("{id}: {e}"));
            assert!(pairs.as_slice() == expected, "{id}: {} pairs, not {}", pairs.len(), expected.len());
            assert_eq!(pairs.overlapping(), expected.len() as u64, "{id}");
            pairs.set_limit(Some(limit));
            assert_eq!(algorithm.find_pairs(&boxes, &mut pairs), Err(Error::TooManyPairs { limit }), "{id}");
        }
    }
}

#[test]
fn filters_change_between_frames() {
    let Some(gpus) = gpus() else { return };
    let mut random = Random(14);
    let mut algorithms = every_algorithm(&gpus);
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    for frame in 0..9 {
        // Frame 3 has fewer boxes than memberships; in frames 5 and 6 there is no filter, or none that tests anything.
        let boxes = random.cubes([900, 900, 1700, 500][frame % 4], [9.0, 12.0, 9.0], 0.7);
        match frame {
            0 | 7 => pairs.set_filter(Some(Filter::new((0..700).map(|_| random.membership()).collect()))),
            5 => pairs.set_filter(None),
            6 => pairs.set_filter(Some(Filter::default())),
            // Two frames have one filter.
            1 | 8 => {}
            _ => {
                let memberships = &mut pairs.filter_mut().unwrap().memberships;
                memberships.push(random.membership());
                (0..50).for_each(|k| memberships[k * 13 + frame] = random.membership());
            }
        }
        let expected = naive_filtered(&boxes, pairs.filter().map_or(&[], |filter| &filter.memberships));
        assert_each_finds(&expected, &mut algorithms, &boxes, &mut pairs, &format!("frame {frame}"));
    }
}

/// Four million pairs overlap, or ten with `long-tests`. Ten are wanted, and a limit allows no more.
#[test]
fn few_of_millions_of_pairs_are_wanted() {
    let Some(gpus) = gpus() else { return };
    let objects = if cfg!(feature = "long-tests") { 4500 } else { 2900 };
    let boxes: Vec<Aabb> = (0..objects).map(|k| Aabb::cube([k as f32 * 1e-4, 0.0, 0.0], 1.0)).collect();
    let of = |groups, mask| Membership { groups, mask, ..Membership::ALL };
    let mut memberships = vec![of(1, 2); objects];
    (0..10).for_each(|k| memberships[k * 277 + 5] = of(4, 8));
    memberships[1234] = of(8, 4);
    let expected = naive_filtered(&boxes, &memberships);
    assert_eq!(expected.len(), 10);
    for (id, mut algorithm) in every_algorithm(&gpus) {
        let mut pairs = filtered(&memberships);
        for (limit, result) in [(10, Ok(())), (9, Err(Error::TooManyPairs { limit: 9 }))] {
            pairs.set_limit(Some(limit));
            assert_eq!(algorithm.find_pairs(&boxes, &mut pairs), result, "{id}");
            assert!(result.is_err() || pairs.as_slice() == expected, "{id}: {} pairs", pairs.len());
        }
    }
}

#[test]
fn the_first_invalid_box_is_named() {
    let Some(gpus) = gpus() else { return };
    assert_each_names_the_first_invalid(every_algorithm(&gpus), 1500, &[0, 127, 1000, 1499]);
}

/// Two million pairs, or twelve with `long-tests`.
#[test]
fn millions_of_pairs_come_whole_and_a_limit_refuses_them() {
    let Some(gpus) = gpus() else { return };
    let objects: u64 = if cfg!(feature = "long-tests") { 5000 } else { 2000 };
    let boxes: Vec<Aabb> = (0..objects).map(|k| Aabb::cube([k as f32 * 1e-4, 0.0, 0.0], 1.0)).collect();
    for (id, mut algorithm) in every_algorithm(&gpus) {
        let mut pairs = Pairs::new();
        pairs.set_limit(Some(1000));
        assert_eq!(algorithm.find_pairs(&boxes, &mut pairs), Err(Error::TooManyPairs { limit: 1000 }), "{id}");
        pairs.set_limit(None);
        for frame in 0..2 {
            algorithm.find_pairs(&boxes, &mut pairs).unwrap();
            assert_eq!(pairs.len() as u64, objects * (objects - 1) / 2, "{id} in frame {frame}");
            let sum: u64 = pairs.iter().map(|&(i, j)| u64::from(j) * u64::from(j > i)).sum();
            assert_eq!(sum, (0..objects).map(|j| j * j).sum::<u64>(), "{id} in frame {frame}");
        }
    }
}

/// Returns boxes of which the last overlaps the one before it and the first of the middle tile, and no others overlap.
fn two_pairs_of_the_last_tile(objects: u32) -> (Vec<Aabb>, [(u32, u32); 2]) {
    let (middle, last) = (objects.div_ceil(128) / 2 * 128, objects - 1);
    let mut boxes: Vec<Aabb> = (0..objects).map(|k| Aabb::cube([k as f32, 9.0, 0.0], 0.2)).collect();
    for k in [middle, last - 1] {
        boxes[k as usize] = Aabb::cube([k as f32, 0.0, 0.0], 0.2);
    }
    boxes[last as usize] = Aabb::new([0.0; 3], [objects as f32, 0.1, 0.1]);
    (boxes, [(middle, last), (last - 1, last)])
}

/// Their number of tile pairs is a power of two beyond a multiple of 4096, the counts that are summed together.
#[test]
fn brute_force_finds_the_pairs_of_the_last_tile() {
    let Some(gpus) = gpus() else { return };
    let sizes: &[u32] =
        if cfg!(feature = "long-tests") { &[16_258, 16_384, 32_642, 32_768] } else { &[16_258, 16_384] };
    for &objects in sizes {
        let (boxes, expected) = two_pairs_of_the_last_tile(objects);
        let mut brute = vec![("brute".to_owned(), broad_phase("brute", vec![gpus.open(0).unwrap()]).unwrap())];
        assert_all_find(&expected, &format!("{objects} boxes"), &boxes, &mut brute);
    }
}

#[test]
fn the_order_is_the_same_in_every_run() {
    let Some(gpus) = gpus() else { return };
    let boxes = frame(Scenario::Clustered, 2000);
    let list = |algorithm: &mut dyn BroadPhase| {
        let mut pairs = Pairs::new();
        algorithm.find_pairs(&boxes, &mut pairs).unwrap();
        pairs.as_slice().to_vec()
    };
    let registry = with_gpus(&gpus);
    // If several GPUs share a frame, the order follows their measured speeds.
    for id in on_gpus(&registry).into_iter().filter(|id| !id.to_string().contains('+')) {
        let first = list(registry.create(&id).unwrap().as_mut());
        for _ in 0..3 {
            assert_eq!(list(registry.create(&id).unwrap().as_mut()), first, "{id}");
        }
    }
}

/// Frames that take a software adapter minutes.
#[cfg(feature = "long-tests")]
mod long {
    use super::*;
    use crate::common::{large_boxes, lattice, swept};

    #[test]
    fn the_oracle_of_large_frames_is_the_double_loop() {
        for scenario in Scenario::ALL {
            for objects in [0, 1, 2, 33, 5000] {
                let boxes = frame(scenario, objects);
                assert!(swept(&boxes) == naive(&boxes), "{scenario} of {objects}");
            }
        }
        assert!(swept(&lattice()) == naive(&lattice()) && swept(&large_boxes()) == naive(&large_boxes()));
    }

    /// The sizes at which blocks and tiles begin and end, without brute force at the large ones.
    #[test]
    fn every_scenario_at_the_edges_of_blocks() {
        let Some(gpus) = gpus() else { return };
        let mut algorithms = every_algorithm(&gpus);
        let (mut fast, mut brute): (Algorithms, Algorithms) =
            algorithms.drain(..).partition(|(id, _)| !id.contains("brute"));
        for (k, scenario) in Scenario::ALL.into_iter().enumerate() {
            for objects in [0, 1, 2, 31, 32, 33] {
                let (name, boxes) = (format!("{scenario} of {objects}"), frame(scenario, objects));
                assert_all_agree(&name, &boxes, &mut fast);
                assert_all_agree(&name, &boxes, &mut brute);
            }
            // The hard scenarios come last. Their pairs are quadratic in the boxes: large ones would take minutes
            // each.
            let hard = scenario > Scenario::Fragmentation;
            let large = if hard { 4097 + k } else { [65_535, 65_536, 65_537, 40_961 + 1009 * k][k % 4] };
            let boxes = frame(scenario, large);
            assert_all_find(&swept(&boxes), &format!("{scenario} of {large}"), &boxes, &mut fast);
        }
    }

    /// For real GPUs: `tools/real-gpu.sh` runs it. A software adapter takes hours.
    #[test]
    #[ignore = "takes hours on a software adapter; tools/real-gpu.sh runs it"]
    fn every_scenario_at_every_size() {
        let Some(gpus) = gpus() else { return };
        let mut algorithms = every_algorithm(&gpus);
        for scenario in Scenario::ALL {
            for objects in [0, 1, 2, 31, 32, 33, 1000, 65_535, 65_536, 65_537, 54_321] {
                let boxes = frame(scenario, objects);
                assert_all_find(&swept(&boxes), &format!("{scenario} of {objects}"), &boxes, &mut algorithms);
            }
            println!("{scenario}: {} algorithms agree with the oracle at 11 sizes", algorithms.len());
        }
    }

    /// More candidates than one submission tests, and than the 65 535 turns after which lavapipe ends a loop silently.
    #[test]
    fn rows_of_very_many_candidates_lose_no_pair() {
        let Some(gpus) = gpus() else { return };
        let mut row: Vec<Aabb> = (0..70_000).map(|k| Aabb::cube([k as f32, (k % 7) as f32 * 3.0, 0.0], 0.4)).collect();
        row.push(Aabb::new([-1.0, -1.0, -1.0], [80_000.0, 2.0, 1.0]));
        let hits = (0..70_000_u32).filter(|k| k % 7 == 0).count();
        // A software adapter on two slow cores takes a second for ten million tests, and counts as lost after a
        // minute.
        let point = [Aabb::cube([1.0; 3], 0.5); 12_000];
        for (id, mut algorithm) in every_algorithm(&gpus).into_iter().filter(|(id, _)| !id.contains("brute")) {
            let mut pairs = Pairs::with_order(PairOrder::Canonical);
            algorithm.find_pairs(&row, &mut pairs).unwrap();
            let right = pairs.iter().all(|&(i, j)| i % 7 == 0 && j == 70_000);
            assert!(right && pairs.len() == hits, "{id}: {} pairs", pairs.len());
            // Quadratic, so once for each method and GPU.
            if !id.contains('+') && !id.contains("twice") {
                pairs.set_limit(Some(1000));
                assert_eq!(algorithm.find_pairs(&point, &mut pairs), Err(Error::TooManyPairs { limit: 1000 }), "{id}");
            }
        }
    }
}
