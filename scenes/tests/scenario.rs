//! The contract of the scenes: the same bits everywhere, always valid, and as dense as their documentation says.

use sapwise::Aabb;
use sapwise_scenes::{Scenario, Scene};

fn pairs_per_object(boxes: &[Aabb]) -> f64 {
    let later = |(i, a): (usize, &Aabb)| boxes[i + 1..].iter().filter(|b| a.overlaps(b)).count();
    boxes.iter().enumerate().map(later).sum::<usize>() as f64 / boxes.len() as f64
}

/// FNV-1a over the bits of all bounds, in order.
fn hash(boxes: &[Aabb]) -> u64 {
    let bounds = boxes.iter().flat_map(|b| b.min.into_iter().chain(b.max));
    bounds.fold(0xCBF2_9CE4_8422_2325, |h, v| (h ^ u64::from(v.to_bits())).wrapping_mul(0x0000_0100_0000_01B3))
}

fn advance(scene: &mut Scene, frames: u64) {
    for _ in 0..frames {
        scene.advance();
    }
}

fn assert_sound(scene: &Scene, what: &str) {
    let bounds = |b: &Aabb| b.min.into_iter().chain(b.max).all(|v| v.abs() < 1e5);
    let bad = scene.boxes().iter().position(|b| b.defect().is_some() || !bounds(b));
    assert_eq!(bad, None, "{what}, frame {}", scene.frame());
    assert!(scene.boxes().len() <= scene.peak_objects(), "{what}, frame {}", scene.frame());
}

#[test]
fn names_are_read_back_and_others_refused_with_a_list() {
    for scenario in Scenario::ALL {
        assert_eq!(scenario.to_string().parse(), Ok(scenario));
        assert!(!scenario.description().is_empty() && !scenario.description().contains('\n'));
    }
    let error = "Uniform".parse::<Scenario>().unwrap_err().to_string();
    assert!(error.contains("\"Uniform\"") && error.contains("uniform, fast,") && error.contains("free-fall"), "{error}");
}

#[test]
fn every_platform_computes_the_same_bits() {
    // Frame 0, then 20, then 300: by then `free-fall` has been dropped again and `fragmentation` has split and merged.
    let golden = [
        (Scenario::Uniform, [0xC779_6697_5446_E185, 0xE9F9_7817_8B43_B575, 0xC8EE_F5A5_1B64_7DBC]),
        (Scenario::Fast, [0xC779_6697_5446_E185, 0x2EE5_C8B9_40C6_7C3B, 0x7FAF_E7EF_1200_A5FD]),
        (Scenario::Clustered, [0x828F_65E4_A866_7A48, 0x4382_7D89_FC2B_4B5F, 0xE4F5_8A6A_638C_0702]),
        (Scenario::Slab, [0x665B_9D0F_C0EC_9E2B, 0x3639_C481_E89D_FFEB, 0x2653_492F_26C4_C944]),
        (Scenario::Mixed, [0x76E3_D3D5_FCE4_1CCB, 0xE9FE_BDF5_C31C_5705, 0x89DE_3D79_9634_00C1]),
        (Scenario::Resting, [0xC779_6697_5446_E185, 0xB5F1_2E75_1868_9FC3, 0x51DD_C3F5_A5A7_855C]),
        (Scenario::Brownian, [0xC779_6697_5446_E185, 0xAC86_3399_9FC3_B993, 0xF531_37E6_CC6D_B30B]),
        (Scenario::FreeFall, [0x1716_B244_58A3_72B2, 0xDD71_36AD_3728_AAD3, 0x9164_3A78_C13D_6C23]),
        (Scenario::Gravity, [0xAEBA_553F_C537_B18E, 0xC75E_3B6D_3284_B2A0, 0x7880_8467_0894_8503]),
        (Scenario::Fragmentation, [0x80C3_727D_20D6_58A7, 0xD2B3_2658_B945_DBBA, 0x9D33_C4BE_6161_68B7]),
    ];
    let found = Scenario::ALL.map(|scenario| {
        let mut scene = scenario.start(1000, 1);
        let hashes = [0, 20, 280].map(|frames| {
            advance(&mut scene, frames);
            hash(scene.boxes())
        });
        (scenario, hashes)
    });
    assert_eq!(found, golden, "found {found:#x?}");
}

#[test]
fn a_seed_repeats_its_scene_and_another_makes_another() {
    for scenario in Scenario::ALL {
        let (mut a, mut b, c) = (scenario.start(300, 5), scenario.start(300, 5), scenario.start(300, 6));
        assert_ne!(hash(a.boxes()), hash(c.boxes()), "{scenario}");
        for _ in 0..300 {
            a.advance();
            b.advance();
        }
        assert_eq!(hash(a.boxes()), hash(b.boxes()), "{scenario}");
        assert_eq!((a.frame(), a.scenario(), a.peak_objects()), (300, scenario, 300));
    }
}

#[test]
fn boxes_are_valid_at_every_size() {
    for scenario in Scenario::ALL {
        for objects in [0, 1, 2, 3, 10, 17, 1000, 100_000] {
            let mut scene = scenario.start(objects, 3);
            for _ in 0..if objects > 1000 { 4 } else { 300 } {
                assert_sound(&scene, &format!("{scenario} with {objects}"));
                if scenario != Scenario::Fragmentation {
                    assert_eq!(scene.boxes().len(), objects, "{scenario}");
                }
                advance(&mut scene, if objects > 1000 { 90 } else { 3 });
            }
        }
    }
}

#[test]
fn nothing_drifts_away_in_a_hundred_thousand_frames() {
    for scenario in Scenario::ALL {
        for objects in [1, 30] {
            let mut scene = scenario.start(objects, 9);
            for _ in 0..100 {
                advance(&mut scene, 1000);
                assert_sound(&scene, &format!("{scenario} with {objects}"));
                let far = scene.boxes().iter().flat_map(|b| b.min).any(|v| v.abs() > 100.0);
                assert!(!far, "{scenario} with {objects}, frame {}", scene.frame());
            }
        }
    }
}

#[test]
fn pairs_per_object_stay_in_the_documented_band() {
    for scenario in Scenario::ALL {
        let (low, high) = match scenario {
            Scenario::Clustered => (2.9, 4.2),
            Scenario::Mixed => (4.8, 5.3),
            Scenario::Brownian => (0.38, 0.55),
            Scenario::FreeFall => (0.05, 1.3),
            Scenario::Gravity => (5.0, 7.0),
            Scenario::Fragmentation => (0.15, 2.6),
            _ => (0.4, 0.55),
        };
        let mut scene = scenario.start(2000, 2);
        while scene.frame() < 600 {
            let pairs = pairs_per_object(scene.boxes());
            let few = scenario == Scenario::Fragmentation && scene.boxes().len() < 100;
            assert!(few || (low..high).contains(&pairs), "{scenario}, frame {}: {pairs}", scene.frame());
            advance(&mut scene, 15);
        }
    }
}

#[test]
fn blobs_keep_their_width() {
    let mut scene = Scenario::Clustered.start(1000, 4);
    advance(&mut scene, 100_000);
    let pairs = pairs_per_object(scene.boxes());
    assert!((2.5..4.2).contains(&pairs), "{pairs}");
}

#[test]
fn one_object_in_twenty_moves_in_resting_and_each_has_its_turn() {
    let mut scene = Scenario::Resting.start(1000, 4);
    let mut moved = vec![0; 1000];
    let mut before = scene.boxes().to_vec();
    for _ in 0..600 {
        scene.advance();
        let awake: Vec<usize> = (0..1000).filter(|&i| scene.boxes()[i] != before[i]).collect();
        assert_eq!(awake.len(), 50, "frame {}", scene.frame());
        awake.iter().for_each(|&i| moved[i] += 1);
        before.copy_from_slice(scene.boxes());
    }
    assert!(moved.iter().all(|&frames| frames == 30), "{moved:?}");
}

#[test]
fn free_fall_comes_to_rest_and_starts_again() {
    let mut scene = Scenario::FreeFall.start(500, 4);
    let top = scene.boxes()[7].max[2];
    advance(&mut scene, 140);
    let rest = scene.boxes().to_vec();
    assert!(rest[7].max[2] < top && rest.iter().all(|b| b.min[2] >= 0.0));
    advance(&mut scene, 99);
    assert_eq!(scene.boxes(), rest);
    scene.advance();
    assert!(scene.boxes().iter().zip(&rest).all(|(now, then)| now.min[2] > then.min[2]));
}

#[test]
fn fragmentation_runs_from_ten_to_the_peak_and_back() {
    for peak in [100, 5000, 40_000] {
        let mut scene = Scenario::Fragmentation.start(peak, 8);
        let counts: Vec<usize> = (0..2 * Scenario::FRAGMENTATION_FRAMES)
            .map(|_| {
                let count = scene.boxes().len();
                scene.advance();
                count
            })
            .collect();
        let (first, second) = counts.split_at(Scenario::FRAGMENTATION_FRAMES as usize);
        assert_eq!(first, second);
        assert_eq!((first.iter().min(), first.iter().max()), (Some(&10), Some(&peak)));
        assert_eq!((first[0], first[599]), (10, 10));
        // A border anywhere between is crossed at least twice each way.
        for share in [0.1, 0.3, 0.5, 0.7, 0.95] {
            let border = 10.0 * (peak as f64 / 10.0).powf(share);
            let up = counts.windows(2).filter(|w| (w[0] as f64) < border && w[1] as f64 >= border).count();
            let down = counts.windows(2).filter(|w| w[0] as f64 >= border && (w[1] as f64) < border).count();
            assert!(up >= 4 && down >= 4, "{peak}: {border} is crossed {up} times up, {down} down");
        }
    }
}

#[test]
fn fragmentation_below_ten_objects_keeps_them() {
    for peak in [0, 1, 9, 10] {
        let mut scene = Scenario::Fragmentation.start(peak, 8);
        for _ in 0..700 {
            assert_eq!(scene.boxes().len(), peak);
            scene.advance();
        }
    }
}
