//! Sequences of similar frames, for incremental algorithms: every algorithm against the oracle in every frame.

mod common;

use common::{Algorithms, Random, assert_each_finds, naive};
use sapwise::{Aabb, Error, PairOrder, Pairs, Registry};

/// Returns every method on one and on three threads at every SIMD level of this machine.
fn every_algorithm() -> Algorithms {
    let mut all = common::every_algorithm();
    all.retain(|(id, _)| id.contains("@cpu1 ") || id.contains("@cpu3 "));
    all
}

fn assert_all_agree(event: &str, boxes: &[Aabb], algorithms: &mut Algorithms) {
    assert_each_finds(&naive(boxes), algorithms, boxes, &mut Pairs::with_order(PairOrder::Canonical), event);
}

/// Moves each box by up to `step` on each axis.
fn wander(boxes: &mut [Aabb], step: f32, random: &mut Random) {
    for b in boxes {
        for a in 0..3 {
            let by = (random.next() * 2.0 - 1.0) * step;
            b.min[a] += by;
            b.max[a] += by;
        }
    }
}

#[test]
fn events_between_frames_lose_no_pair() {
    let mut algorithms = every_algorithm();
    let mut random = Random(0x5eed);
    let mut boxes = random.cubes(600, [11.0; 3], 0.6);
    for frame in 0..160 {
        let event = format!("frame {frame}");
        match frame % 16 {
            // Long enough between events for pairs to be kept again.
            3 => boxes.extend(random.cubes(25, [11.0; 3], 0.6)),
            5 => boxes.truncate(boxes.len() - 40),
            // Fewer and more again: the same positions hold other boxes.
            6 => boxes.extend(random.cubes(30, [11.0; 3], 0.6)),
            8 => {
                let last = boxes.len() - 1;
                boxes.swap(frame % 100, last);
                boxes.swap_remove(frame % 200);
            }
            // One box jumps through the world, one swells to its size, one shrinks to a point.
            10 => {
                let at = [random.next() * 11.0, random.next() * 11.0, random.next() * 11.0];
                boxes[frame % 50] = Aabb::cube(at, 0.4);
                boxes[frame % 50 + 1] = Aabb::new([-1.0; 3], [12.0; 3]);
                boxes[frame % 50 + 2] = Aabb::cube(at, 0.0);
            }
            11 => boxes[frame % 50 + 1] = Aabb::cube([5.0; 3], 0.5),
            12 => boxes[77] = Aabb::new([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]),
            13 => boxes[77] = Aabb::new([f32::INFINITY; 3], [f32::INFINITY; 3]),
            14 => boxes[77] = Aabb::cube([4.0; 3], 0.6),
            15 if frame > 100 => boxes = random.cubes(500, [11.0; 3], 0.6),
            _ => {}
        }
        // Some frames stand still.
        if frame % 7 != 0 {
            wander(&mut boxes, if frame % 40 == 39 { 3.0 } else { 0.04 }, &mut random);
        }
        assert_all_agree(&event, &boxes, &mut algorithms);
    }
    boxes.clear();
    assert_all_agree("nothing is left", &boxes, &mut algorithms);
}

#[test]
fn scene_far_from_the_origin() {
    let mut algorithms = every_algorithm();
    let mut random = Random(17);
    let mut boxes = random.cubes(400, [9.0; 3], 0.6);
    for b in &mut boxes {
        *b = Aabb::new(b.min.map(|v| v + 1.0e7), b.max.map(|v| v + 1.0e7));
    }
    for frame in 0..40 {
        wander(&mut boxes, 1.0, &mut random);
        assert_all_agree(&format!("frame {frame}"), &boxes, &mut algorithms);
    }
}

/// Few boxes; then enough for an error in the part of each of several threads, a third of which remain.
#[test]
fn frame_after_an_error_is_right() {
    for (count, side, step, period) in [(500, 10.0, 0.04, 12), (1500, 15.0, 0.02, 20)] {
        let mut random = Random(23);
        for (id, mut algorithm) in every_algorithm() {
            let mut boxes = random.cubes(count, [side; 3], 0.6);
            let mut pairs = Pairs::with_order(PairOrder::Canonical);
            for frame in 0..60 {
                wander(&mut boxes, step, &mut random);
                if frame % period == 5 {
                    // The error names the lowest of them.
                    let mut wrong = boxes.clone();
                    wrong[124].min[0] = 1.0e9;
                    (70..wrong.len()).step_by(90).for_each(|k| wrong[k].max[1] = f32::NAN);
                    let error = algorithm.find_pairs(&wrong, &mut pairs).unwrap_err();
                    assert!(matches!(error, Error::InvalidBox { index: 70, .. }), "{id}: {error}");
                    boxes.truncate(if period == 20 { boxes.len() / 3 } else { count });
                }
                if frame % period == 9
                    && let Some(limit) = naive(&boxes).len().checked_sub(1)
                {
                    pairs.set_limit(Some(limit));
                    assert_eq!(algorithm.find_pairs(&boxes, &mut pairs), Err(Error::TooManyPairs { limit }), "{id}");
                    pairs.set_limit(None);
                }
                algorithm.find_pairs(&boxes, &mut pairs).unwrap();
                assert!(pairs.as_slice() == naive(&boxes), "{id}, frame {frame}");
            }
        }
    }
}

#[test]
fn few_boxes_jump_in_every_frame() {
    let mut algorithms = every_algorithm();
    let mut random = Random(37);
    let mut boxes = random.cubes(900, [13.0; 3], 0.6);
    for frame in 0..70 {
        for k in 0..9 {
            boxes[(frame * 9 + k) * 7 % 900] = random.cubes(1, [13.0; 3], 0.6)[0];
        }
        assert_all_agree(&format!("frame {frame}"), &boxes, &mut algorithms);
    }
}

/// Too many boxes for the double loop: `grid-sap` is the oracle.
#[test]
fn many_boxes_leave_at_once() {
    let registry = Registry::with_cores(3);
    let create = |id: &str| registry.create(&id.parse().unwrap());
    let mut strips = create("grid-sap@cpu1").unwrap();
    let (mut expected, mut pairs) = (Pairs::new(), Pairs::new());
    for id in ["pair-cache@cpu1", "pair-cache@cpu3"] {
        let Ok(mut algorithm) = create(id) else { continue };
        let mut random = Random(41);
        let mut boxes = random.cubes(60_000, [80.0; 3], 0.6);
        for frame in 0..24 {
            wander(&mut boxes, 0.02, &mut random);
            if frame % 3 == 2 {
                // Consecutive boxes: one task has all the work.
                wander(&mut boxes[frame * 1000..frame * 1000 + 9000], 0.8, &mut random);
            }
            strips.find_pairs(&boxes, &mut expected).unwrap();
            algorithm.find_pairs(&boxes, &mut pairs).unwrap();
            assert_eq!(pairs.fingerprint(), expected.fingerprint(), "{id}, frame {frame}");
        }
    }
}

#[test]
fn too_many_pairs_to_keep_are_found() {
    let mut algorithms = every_algorithm();
    let mut random = Random(29);
    let mut boxes = random.cubes(700, [1.0; 3], 2.0);
    for frame in 0..6 {
        wander(&mut boxes, 0.01, &mut random);
        assert_all_agree(&format!("frame {frame}"), &boxes, &mut algorithms);
    }
}

#[test]
fn infinite_box_joins_kept_pairs() {
    let mut boxes = Random(4).cubes(1000, [12.0; 3], 0.5);
    let mut algorithms = every_algorithm();
    for frame in 0..8 {
        match frame {
            5 => boxes.push(Aabb::new([f32::NEG_INFINITY; 3], [f32::INFINITY; 3])),
            // Finds the infinite box, which must be in the tree.
            6.. => boxes[frame] = Aabb::cube([frame as f32; 3], 0.5),
            _ => {}
        }
        assert_all_agree(&format!("frame {frame}"), &boxes, &mut algorithms);
    }
}
