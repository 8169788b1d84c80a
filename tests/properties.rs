//! Properties that hold for any boxes.

mod common;
#[path = "common/space.rs"]
mod space;

use common::naive;
use proptest::prelude::*;
use sapwise::algorithm::{Displacement, Load};
use sapwise::{Aabb, Adaptive, AlgorithmId, PairOrder, Pairs, Registry, Space};

/// Bounds that meet often, with infinities, zeros of both signs and denormals among them.
fn bound() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => (-20_i32..20).prop_map(|v| v as f32 * 0.5),
        4 => -10.0_f32..10.0,
        1 => prop::sample::select(vec![f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, 1.0e-42, f32::MAX, f32::MIN]),
    ]
}

fn valid_box() -> impl Strategy<Value = Aabb> {
    (prop::array::uniform3(bound()), prop::array::uniform3(bound()))
        .prop_map(|(a, b)| Aabb::new([0, 1, 2].map(|k| a[k].min(b[k])), [0, 1, 2].map(|k| a[k].max(b[k]))))
}

fn registry() -> (Registry, Vec<AlgorithmId>) {
    let registry = Registry::with_cores(2);
    let ids = registry.available().into_iter().map(|e| e.id).collect();
    (registry, ids)
}

/// Returns a space that must go on as the given one: a snapshot if there are snapshots.
fn restored(space: &Space) -> Space {
    #[cfg(feature = "serde")]
    return serde_json::from_str(&serde_json::to_string(space).unwrap()).unwrap();
    #[cfg(not(feature = "serde"))]
    space.clone()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_algorithm_finds_the_overlapping_pairs(boxes in prop::collection::vec(valid_box(), 0..600)) {
        let expected = naive(&boxes);
        let (registry, ids) = registry();
        for id in ids {
            let mut pairs = Pairs::with_order(PairOrder::Canonical);
            registry.create(&id).unwrap().find_pairs(&boxes, &mut pairs).unwrap();
            prop_assert_eq!(pairs.as_slice(), &expected[..], "{}", id);
        }
    }

    #[test]
    fn reused_instances_forget_the_previous_frame(
        sizes in prop::collection::vec(0_usize..700, 1..6),
        seed in any::<u32>(),
    ) {
        let (registry, ids) = registry();
        for id in ids {
            let mut kept = registry.create(&id).unwrap();
            let mut pairs = Pairs::new();
            for (frame, &size) in sizes.iter().enumerate() {
                let boxes: Vec<Aabb> = (0..size as u32)
                    .map(|k| {
                        let mixed = (k ^ seed).wrapping_mul(2_654_435_761).wrapping_add(frame as u32 * 97);
                        Aabb::cube([mixed % 31, mixed / 31 % 29, mixed / 900 % 23].map(|v| v as f32 * 0.5), 0.4)
                    })
                    .collect();
                kept.find_pairs(&boxes, &mut pairs).unwrap();
                let mut fresh = Pairs::new();
                registry.create(&id).unwrap().find_pairs(&boxes, &mut fresh).unwrap();
                prop_assert_eq!(pairs.fingerprint(), fresh.fingerprint(), "{} frame {}", id, frame);
            }
        }
    }

    #[test]
    fn load_of_any_boxes_is_finite(
        boxes in prop::collection::vec(
            (prop::array::uniform3(any::<f32>()), prop::array::uniform3(any::<f32>())),
            0..300,
        ),
    ) {
        let boxes: Vec<Aabb> = boxes.into_iter().map(|(min, max)| Aabb::new(min, max)).collect();
        for pairs in [None, Some(0.0), Some(1.0e6)] {
            let load = Load::estimate(&boxes, pairs, None);
            let all = [load.axis_candidates, load.strip_candidates, load.pairs];
            prop_assert!(all.iter().all(|v| v.is_finite() && *v >= 0.0) && load.moved == 1.0, "{:?}", load);
        }
        let mut displacement = Displacement::default();
        displacement.watch(&boxes);
        let reversed: Vec<Aabb> = boxes.iter().rev().copied().collect();
        for (now, most) in [(&boxes, 0.0), (&reversed, 1.0)] {
            let motion = displacement.motion(now);
            let (moved, share) = motion.map_or((0.0, 0.0), |m| (m.moved, m.moved_share));
            prop_assert!((0.0..=most).contains(&moved), "{}", moved);
            prop_assert!((0.0..=most.ceil()).contains(&share), "{}", share);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn space_is_a_list_with_a_double_loop(
        bytes in prop::collection::vec(any::<u8>(), 0..1500),
        algorithm in prop::sample::select(registry().1),
    ) {
        space::run(&bytes, [Space::new(), Space::with(Adaptive::only(algorithm, &registry().0).unwrap())], restored);
    }
}
