//! Every algorithm on a few dozen boxes of every kind that come, move and go, and calls on a space: small enough for
//! Miri and valgrind (`tools/sanitize.sh`).

mod common;
#[path = "common/space.rs"]
mod space;

use common::{Random, WORLDS, assert_each_finds, denormals, every_algorithm, lattice, naive_filtered};
use sapwise::{Aabb, BroadPhase, Filter, Membership, PairOrder, Pairs, Space};

/// Boxes of a scene: more than any vector has lanes, and enough for a tree of several levels. Miri takes a second for
/// such a frame.
const BOXES: usize = if cfg!(miri) { 18 } else { 40 };

/// Frames of a scene.
const FRAMES: usize = if cfg!(miri) { 3 } else { 4 };

/// Compares each frame with the double loop, without and with a filter, then moves the boxes, removes two and adds
/// one.
fn assert_frames_agree(name: &str, mut boxes: Vec<Aabb>, algorithms: &mut [(String, Box<dyn BroadPhase>)]) {
    let mut random = Random(41);
    for frame in 0..FRAMES {
        let memberships: Vec<Membership> = (0..boxes.len()).map(|_| random.membership()).collect();
        let mut filters = vec![Vec::new(), memberships];
        // Under Miri frames with and without a filter alternate: some scenes begin with one, others without.
        if cfg!(miri) {
            filters.remove((frame + name.len()) % 2);
        }
        for memberships in filters {
            let expected = naive_filtered(&boxes, &memberships);
            let mut pairs = Pairs::with_order(PairOrder::Canonical);
            pairs.set_filter((!memberships.is_empty()).then(|| Filter::new(memberships)));
            assert_each_finds(&expected, algorithms, &boxes, &mut pairs, &format!("{name}, frame {frame}"));
        }
        // Only one box in four moves, so that keeping pairs pays.
        for b in boxes.iter_mut().step_by(4) {
            let by = (random.next() - 0.5) * (b.max[0] - b.min[0]);
            // Infinite boxes stay.
            if by.is_finite() {
                *b = Aabb::new(b.min.map(|x| x + by), b.max.map(|x| x + by));
            }
        }
        boxes.truncate((boxes.len() - 2).max(1));
        boxes.insert(boxes.len() / 2, boxes[0]);
    }
}

#[test]
fn worlds_of_every_shape() {
    let mut algorithms = every_algorithm();
    let mut random = Random(7);
    for world in WORLDS.into_iter().step_by(if cfg!(miri) { 6 } else { 1 }) {
        let share = world.map(|side| side / 4.0);
        assert_frames_agree("a world", random.cubes(BOXES, share, 0.5), &mut algorithms);
    }
}

fn infinite() -> Vec<Aabb> {
    let inf = f32::INFINITY;
    let mut boxes = Random(3).cubes(BOXES, [5.0; 3], 0.5);
    boxes.insert(0, Aabb::new([-inf; 3], [inf; 3]));
    boxes.push(Aabb::new([5.0, -inf, 5.0], [5.0, inf, inf]));
    boxes.insert(9, Aabb::new([f32::MIN; 3], [f32::MAX; 3]));
    boxes.push(Aabb::cube([3.0e38, 0.0, -1.0e9], 1.0));
    boxes
}

#[test]
fn infinite_boxes() {
    assert_frames_agree("infinite boxes", infinite(), &mut every_algorithm());
}

#[test]
fn equal_boxes() {
    assert_frames_agree("the same box", vec![Aabb::cube([3.0; 3], 1.0); 20], &mut every_algorithm());
}

/// The same algorithms on one scene after another. Under Miri each expensive scene is a test of its own.
#[test]
fn one_scene_after_another() {
    let mut algorithms = every_algorithm();
    let mut random = Random(5);
    if !cfg!(miri) {
        assert_frames_agree("infinite boxes", infinite(), &mut algorithms);
        assert_frames_agree("denormal boxes", denormals(&mut random)[..BOXES].to_vec(), &mut algorithms);
        assert_frames_agree("a lattice", lattice().into_iter().step_by(3).take(BOXES).collect(), &mut algorithms);
        assert_frames_agree("the same box", vec![Aabb::cube([3.0; 3], 1.0); 20], &mut algorithms);
    }
    for count in (2..18).step_by(if cfg!(miri) { 8 } else { 1 }) {
        assert_frames_agree("a few boxes", random.cubes(count, [2.0; 3], 0.5), &mut algorithms);
    }
}

#[test]
fn calls_on_a_space() {
    let mut random = Random(48);
    for _ in 0..if cfg!(miri) { 2 } else { 20 } {
        let bytes: Vec<u8> = (0..if cfg!(miri) { 400 } else { 1000 }).map(|_| (random.next() * 256.0) as u8).collect();
        space::run(&bytes, [Space::new(), Space::new()], Clone::clone);
    }
}
