//! Every algorithm on every GPU of this machine, alone and together, against the naive oracle.
//!
//! Without a GPU the tests say so and pass, unless `SAPWISE_REQUIRE_GPU=1`.

mod common;

use common::{Random, naive};
use sapwise::gpu::{Gpus, broad_phase};
use sapwise::{Aabb, BoxDefect, BroadPhase, Error, PairOrder, Pairs, Registry, Scenario};

/// The GPUs of this machine; `None`, said aloud, where there is none and none is required.
fn gpus() -> Option<Gpus> {
    let gpus = Gpus::find();
    if gpus.is_empty() {
        assert!(
            std::env::var_os("SAPWISE_REQUIRE_GPU").is_none_or(|v| v != "1"),
            "SAPWISE_REQUIRE_GPU=1, and no GPU was found"
        );
        println!("skipped: no GPU was found");
        return None;
    }
    Some(gpus)
}

/// Every algorithm of the registry on GPUs, and each method on two devices of the first GPU.
fn every_algorithm(gpus: &Gpus) -> Vec<(String, Box<dyn BroadPhase>)> {
    let mut registry = Registry::with_cores(1);
    registry.add_gpus(gpus);
    let ids = registry.available().into_iter().map(|(id, _)| id).filter(|id| id.to_string().contains("@gpu"));
    let mut all: Vec<(String, Box<dyn BroadPhase>)> =
        ids.map(|id| (id.to_string(), registry.create(&id).unwrap())).collect();
    for method in ["brute", "sweep", "strips"] {
        let devices = vec![gpus.open(0).unwrap(), gpus.open_another(0).unwrap()];
        all.push((format!("{method} on gpu0 twice"), broad_phase(method, devices).unwrap()));
    }
    all
}

fn assert_all_agree(name: &str, boxes: &[Aabb], algorithms: &mut [(String, Box<dyn BroadPhase>)]) {
    let expected = naive(boxes);
    for (id, algorithm) in algorithms {
        let mut canonical = Pairs::with_order(PairOrder::Canonical);
        algorithm.find_pairs(boxes, &mut canonical).unwrap_or_else(|e| panic!("{id} on {name}: {e}"));
        assert!(canonical.as_slice() == expected, "{id} on {name}: {} pairs, not {}", canonical.len(), expected.len());
    }
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
