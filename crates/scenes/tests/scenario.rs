//! The contract of the scenes: repeatable, always valid, and as dense as their documentation says. That they have the
//! same bits everywhere is tested by `tests/golden.rs` of the workspace.

use sapwise::Aabb;
use sapwise_scenes::{Scenario, Scene};

fn pairs_per_object(boxes: &[Aabb]) -> f64 {
    let later = |(i, a): (usize, &Aabb)| boxes[i + 1..].iter().filter(|b| a.overlaps(b)).count();
    boxes.iter().enumerate().map(later).sum::<usize>() as f64 / boxes.len() as f64
}

fn advance(scene: &mut Scene, frames: u64) {
    for _ in 0..frames {
        scene.advance();
    }
}

fn assert_sound(scene: &Scene, what: &str) {
    let bounds = |b: &Aabb| b.min.into_iter().chain(b.max).all(|v| v.abs() < 1e7);
    let bad = scene.boxes().iter().position(|b| b.defect().is_some() || !bounds(b));
    assert_eq!(bad, None, "{what}, frame {}", scene.frame());
    assert!(scene.boxes().len() <= scene.peak_objects(), "{what}, frame {}", scene.frame());
}

#[test]
fn names_are_read_back_and_others_refused_with_a_list() {
    for scenario in Scenario::ALL {
        assert_eq!(scenario.to_string().parse(), Ok(scenario));
    }
    let error = "Uniform".parse::<Scenario>().unwrap_err().to_string();
    let all = Scenario::ALL.map(Scenario::as_str).join(", ");
    assert_eq!(error, format!("\"Uniform\" is no scenario; use one of {all}"));
}

#[test]
fn a_seed_repeats_its_scene_and_another_makes_another() {
    for scenario in Scenario::ALL {
        let (mut a, mut b, c) = (scenario.start(300, 5), scenario.start(300, 5), scenario.start(300, 6));
        assert_ne!(a.boxes(), c.boxes(), "{scenario}");
        advance(&mut a, 300);
        advance(&mut b, 300);
        assert_eq!(a.boxes(), b.boxes(), "{scenario}");
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
            let began = scene.boxes().to_vec();
            for _ in 0..100 {
                advance(&mut scene, 1000);
                assert_sound(&scene, &format!("{scenario} with {objects}"));
                let far = |(now, then): (&Aabb, &Aabb)| (0..3).any(|a| (now.min[a] - then.min[a]).abs() > 100.0);
                let any_far = scene.boxes().iter().zip(&began).any(far);
                assert!(!any_far, "{scenario} with {objects}, frame {}", scene.frame());
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
            Scenario::Stations => (0.07, 0.12),
            Scenario::Layers => (0.0, f64::MIN_POSITIVE),
            Scenario::StaticWorld => (10.0, 11.0),
            Scenario::Tower => (0.999, 1.0),
            Scenario::Rods => (0.06, 0.12),
            Scenario::Sheets => (0.07, 0.14),
            Scenario::LongRods => (0.65, 0.85),
            Scenario::Beams => (0.1, 0.4),
            Scenario::City => (0.75, 1.15),
            Scenario::Parked | Scenario::Plates | Scenario::Asleep | Scenario::Aliased | Scenario::Teleport => {
                (0.06, 0.13)
            }
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
fn those_that_never_move_are_named() {
    for scenario in Scenario::ALL {
        let mut scene = scenario.start(2000, 4);
        let began = scene.boxes().to_vec();
        let mut moved = vec![false; scene.peak_objects()];
        for _ in 0..620 {
            scene.advance();
            // In `fragmentation` the number of objects changes, and with it the object at an index.
            for (moved, (now, then)) in moved.iter_mut().zip(scene.boxes().iter().zip(&began)) {
                *moved |= now != then;
            }
        }
        let still = (0..2000).filter(|&k| scene.is_fixed(k)).count();
        let expected = match scenario {
            Scenario::Mixed => 4,
            Scenario::StaticWorld => 1900,
            Scenario::Parked | Scenario::Asleep => 40,
            Scenario::City => 1900,
            _ => 0,
        };
        assert_eq!(still, expected, "{scenario}");
        let wrong = (0..began.len()).find(|&k| moved[k] == scene.is_fixed(k));
        assert_eq!(wrong, None, "{scenario}");
        assert!(!scene.is_fixed(2000), "{scenario}");
    }
}

#[test]
fn few_pairs_of_fixed_worlds_have_a_moving_member() {
    for (scenario, band) in [(Scenario::StaticWorld, 0.01..0.12), (Scenario::City, 0.02..0.08)] {
        let mut scene = scenario.start(2000, 2);
        for _ in 0..20 {
            let boxes = scene.boxes();
            let moving = |(i, j): &(usize, usize)| !(scene.is_fixed(*i) && scene.is_fixed(*j));
            let all = (0..2000).flat_map(|i| (i + 1..2000).map(move |j| (i, j)));
            let wanted = all.filter(moving).filter(|&(i, j)| boxes[i].overlaps(&boxes[j])).count() as f64 / 2000.0;
            assert!(band.contains(&wanted), "{scenario}, frame {}: {wanted}", scene.frame());
            advance(&mut scene, 30);
        }
    }
}

#[test]
fn cities_have_two_thousand_movers() {
    for (objects, movers) in [(10, 0), (1000, 50), (40_000, 2000), (100_000, 2000)] {
        let scene = Scenario::City.start(objects, 3);
        assert_eq!((0..objects).filter(|&k| !scene.is_fixed(k)).count(), movers, "{objects}");
    }
}

#[test]
fn churn_replaces_one_object_in_a_hundred() {
    for (objects, replaced) in [(1, 1), (30, 1), (2000, 20)] {
        let mut scene = Scenario::Churn.start(objects, 4);
        let mut moved = 0;
        for _ in 0..20 {
            let before = scene.boxes().to_vec();
            scene.advance();
            let near = |a: &Aabb, b: &Aabb| (0..3).all(|k| (a.min[k] - b.min[k]).abs() <= 0.0501);
            let stayed = &scene.boxes()[..objects - replaced];
            assert!(stayed.iter().all(|now| before.iter().any(|then| near(now, then))), "{objects}");
            // A gap is filled with the last object.
            let filled = stayed.iter().zip(&before).filter(|(now, then)| !near(now, then)).count();
            assert!(filled <= replaced, "{objects}: {filled}");
            moved += filled + scene.boxes().iter().zip(&before).skip(stayed.len()).filter(|(a, b)| !near(a, b)).count();
        }
        assert!(moved > 10 * replaced, "{objects}: {moved}");
    }
}

#[test]
fn sheets_and_long_rods_cross_the_world() {
    for scenario in [Scenario::Sheets, Scenario::LongRods] {
        let mut scene = scenario.start(2000, 3);
        advance(&mut scene, 100);
        let (low, high) = scene.boxes().iter().fold((f32::MAX, f32::MIN), |(low, high), b| {
            (low.min(b.min[0]).min(b.min[1]), high.max(b.max[0]).max(b.max[1]))
        });
        for b in scene.boxes() {
            let wide = (0..3).filter(|&a| b.max[a] - b.min[a] > 0.99 * (high - low)).count();
            let thin = (0..3).filter(|&a| b.max[a] - b.min[a] < 0.001 * (high - low)).count();
            assert_eq!((wide, thin), if scenario == Scenario::Sheets { (2, 1) } else { (1, 2) }, "{scenario}");
        }
    }
}

#[test]
fn plates_do_not_touch_each_other_and_layers_not_their_neighbours() {
    for objects in [1000, 50_000] {
        let mut scene = Scenario::Plates.start(objects, 3);
        for _ in 0..10 {
            let mut plates: Vec<&Aabb> = scene.boxes().iter().filter(|b| b.max[0] - b.min[0] > 2.0).collect();
            assert!((objects * 28 / 1000..objects * 32 / 1000).contains(&plates.len()), "{}", plates.len());
            plates.sort_by(|a, b| a.min[2].total_cmp(&b.min[2]));
            assert!(plates.windows(2).all(|w| w[0].max[2] < w[1].min[2]), "{objects}, frame {}", scene.frame());
            let cubes = scene.boxes().iter().filter(|b| b.max[0] - b.min[0] < 2.0);
            let beside = |c: &Aabb| plates.iter().any(|p| c.min[0] < p.min[0] || c.max[1] > p.max[1]);
            assert!(!cubes.clone().any(beside), "plates are as wide as the world");
            advance(&mut scene, 30);
        }
    }
}

#[test]
fn far_objects_are_where_they_should_be_in_space_and_in_the_list() {
    let far = |scenario: Scenario, objects: usize| -> Vec<usize> {
        let scene = scenario.start(objects, 3);
        let world = 2.0 * (5.0 * objects as f32).cbrt();
        (0..objects).filter(|&k| scene.boxes()[k].min.iter().any(|v| v.abs() > 2.0 * world)).collect()
    };
    let aliased: Vec<usize> = (0..1 << 17).filter(|k| k % 512 == 256).collect();
    // Few of them are less than two worlds away.
    let found = far(Scenario::Aliased, 1 << 17);
    assert!(found.len() > 250 && found.iter().all(|k| aliased.contains(k)), "{found:?}");
    for scenario in [Scenario::Parked, Scenario::Asleep] {
        let found = far(scenario, 5000);
        assert_eq!(found.len(), 100, "{scenario}");
        // Each run of fifty has one, at changing places in it.
        assert!(found.iter().enumerate().all(|(k, at)| at / 50 == k), "{scenario}");
        assert!(found.iter().any(|at| at % 50 < 10) && found.iter().any(|at| at % 50 >= 40), "{scenario}");
    }
    let scene = Scenario::Stations.start(5000, 3);
    assert_eq!(scene.boxes().iter().filter(|b| b.min[0] > 0.0).count(), 2500);
    assert_eq!(far(Scenario::Stations, 5000).len(), 5000);
}

#[test]
fn teleport_jumps_in_every_thirtieth_frame_alone() {
    let mut scene = Scenario::Teleport.start(1000, 4);
    for _ in 0..90 {
        let before = scene.boxes().to_vec();
        scene.advance();
        let far = |(now, then): &(&Aabb, &Aabb)| (0..3).any(|a| (now.min[a] - then.min[a]).abs() > 0.051);
        let jumped = scene.boxes().iter().zip(&before).filter(far).count();
        let frame = scene.frame();
        assert!(if frame.is_multiple_of(30) { jumped > 980 } else { jumped == 0 }, "frame {frame}: {jumped}");
    }
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
