use super::*;
use crate::cpu::{Input, Members, Simd, Workers};
use crate::{SceneStats, splitmix};

const INF: f32 = f32::INFINITY;

/// Draws random numbers.
struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        (splitmix::next(&mut self.0) >> 20) % n
    }

    /// Returns a multiple of a quarter, so that boxes, rays and points often touch.
    fn coordinate(&mut self) -> f32 {
        self.below(81) as f32 / 4.0 - 10.0
    }

    fn point(&mut self) -> [f32; 3] {
        [0; 3].map(|_| self.coordinate())
    }

    /// Returns a vector, off the lattice if `odd`.
    fn vector(&mut self, odd: bool) -> [f32; 3] {
        let by = if odd { 0.013 * self.below(77) as f32 } else { 0.0 };
        self.point().map(|v| v + by)
    }

    /// Returns a box, at random flat, long or infinite.
    fn aabb(&mut self) -> Aabb {
        let mut b = Aabb::cube(self.point(), 0.25 * self.below(6) as f32);
        let axis = self.below(3) as usize;
        match self.below(12) {
            0 => b.max[axis] = b.min[axis],
            1 => b.max[axis] += 15.0,
            2 => (b.min[axis], b.max[axis]) = (-INF, INF),
            3 if self.below(4) == 0 => (b.min[axis], b.max[axis]) = (INF, INF),
            4 if self.below(4) == 0 => b.min = [-INF; 3],
            _ => {}
        }
        b
    }
}

/// Returns a tree at every level, and the boxes in it. With `churn` some boxes were removed after the build, and some
/// of those inserted elsewhere.
fn trees(random: &mut Random, len: usize, churn: bool) -> (Vec<Tree>, Vec<Option<Aabb>>) {
    let mut boxes: Vec<Aabb> = (0..len).map(|_| random.aabb()).collect();
    (0..len / 10).for_each(|k| boxes[2 * k + 1] = boxes[2 * k]);
    let mut trees: Vec<Tree> = Simd::every().map(Tree::new).collect();
    let mut present: Vec<Option<Aabb>> = boxes.iter().copied().map(Some).collect();
    for tree in &mut trees {
        let input = Input { workers: &Workers::one(), boxes: &boxes, screen: None };
        tree.build(input, Members::From(0), &SceneStats::of(&boxes)).unwrap();
    }
    if churn {
        let gone: Vec<usize> = (0..len).filter(|k| k % 3 == 0 || (len / 4..len / 2).contains(k)).collect();
        // Every other one comes back elsewhere.
        let back: Vec<u32> = gone.iter().step_by(2).map(|&k| k as u32).collect();
        gone.iter().for_each(|&k| present[k] = None);
        for &k in &back {
            boxes[k as usize] = random.aabb();
            present[k as usize] = Some(boxes[k as usize]);
        }
        for tree in &mut trees {
            for &k in &gone {
                let place = tree.ids().iter().position(|&id| id as usize == k).unwrap();
                tree.remove(place);
            }
            let mut placed = Vec::new();
            tree.insert(&boxes, back.iter().copied(), None, |place, id| placed.push((place, id))).unwrap();
            for (mut place, id) in placed {
                for level in tree.levels_mut().iter_mut().take_while(|level| !level.is_empty()) {
                    level[place / 16].widen(place % 16, &boxes[id as usize]);
                    place /= 16;
                }
            }
        }
    }
    (trees, present)
}

/// Calls `check` for scenes with no box, one leaf, several levels, and more than one node at the top.
fn each_scene(mut check: impl FnMut(&mut Random, &[Tree], &[Option<Aabb>])) {
    let mut random = Random(7);
    for (len, churn) in [(0, false), (1, false), (15, false), (300, false), (300, true), (5000, false), (6000, true)] {
        let (trees, boxes) = trees(&mut random, len, churn);
        check(&mut random, &trees, &boxes);
    }
}

/// Returns the `t` at which a moved box meets another, by the documented formula without infinity times zero.
fn naive_cast(moved: &Aabb, motion: [f32; 3], max: f32, b: &Aabb) -> Option<f32> {
    let (mut enter, mut leave) = (0.0_f32, max.min(f32::MAX));
    for (a, along) in motion.into_iter().enumerate() {
        let inverse = 1.0 / along;
        if inverse.is_infinite() {
            if b.min[a] > moved.max[a] || b.max[a] < moved.min[a] {
                return None;
            }
            continue;
        }
        let (low, high) = ((b.min[a] - moved.max[a]) * inverse, (b.max[a] - moved.min[a]) * inverse);
        let (near, far) = if along > 0.0 { (low, high) } else { (high, low) };
        // Bounds at the same infinity touch: their difference, NaN, is no limit.
        (enter, leave) = (enter.max(near), leave.min(far));
    }
    (enter <= leave).then_some(enter)
}

fn point(at: [f32; 3]) -> Aabb {
    Aabb::new(at, at)
}

/// Returns the boxes that a moved box meets, with the bits of `t`.
fn cast(tree: &Tree, moved: &Aabb, motion: [f32; 3], max: f32) -> Vec<(u32, u32)> {
    let mut found = Vec::new();
    tree.cast_box(moved, motion, max, |id, t| {
        found.push((id, t.to_bits()));
        INF
    });
    found.sort_unstable();
    found
}

fn check_casts(trees: &[Tree], boxes: &[Option<Aabb>], moved: &Aabb, motion: [f32; 3], max: f32) {
    let hit = |(id, b): (u32, &Option<Aabb>)| Some((id, naive_cast(moved, motion, max, b.as_ref()?)?.to_bits()));
    let expected: Vec<(u32, u32)> = (0..).zip(boxes).filter_map(hit).collect();
    let first = expected.iter().map(|&(_, t)| f32::from_bits(t)).min_by(f32::total_cmp);
    for tree in trees {
        assert_eq!(cast(tree, moved, motion, max), expected, "{:?} {moved:?} {motion:?} {max}", tree.simd);
        let (mut last, mut calls) = (None, 0);
        tree.cast_box(moved, motion, max, |_, t| {
            assert!(last.is_none_or(|last| t <= last));
            last = Some(t);
            t
        });
        assert_eq!(last, first, "{:?} {moved:?} {motion:?} {max}", tree.simd);
        tree.cast_box(moved, motion, max, |_, _| {
            calls += 1;
            -1.0
        });
        assert_eq!(calls, usize::from(first.is_some()));
    }
}

#[test]
fn rays_meet_what_the_double_loop_finds() {
    each_scene(|random, trees, boxes| {
        for k in 0..120 {
            let mut direction = random.vector(k % 2 == 0);
            // Parallel to a plane or an axis, with zeros of both signs.
            (0..3).filter(|a| k >> (2 + a) & 1 == 1).for_each(|a| direction[a] *= 0.0);
            if k % 17 == 0 {
                direction[k % 3] = 1.0e-42;
            }
            let max = if k % 3 == 0 { INF } else { 0.05 * random.below(30) as f32 - 0.1 };
            check_casts(trees, boxes, &point(random.vector(k % 4 == 0)), direction, max);
        }
    });
}

#[test]
fn moved_boxes_meet_what_the_double_loop_finds() {
    each_scene(|random, trees, boxes| {
        for k in 0..80 {
            let moved = random.aabb();
            let mut motion = random.vector(k % 2 == 0);
            (0..3).filter(|a| k >> (2 + a) & 1 == 1).for_each(|a| motion[a] = 0.0);
            check_casts(trees, boxes, &moved, motion, if k % 3 == 0 { INF } else { 0.5 });
            // It meets the boxes that it overlaps at once.
            for tree in trees {
                let mut overlapping = Vec::new();
                let looked = tree.overlapping(&moved, |id| overlapping.push((id, 0)));
                assert!(looked as usize <= tree.levels.iter().map(Vec::len).sum(), "each node is looked at once");
                overlapping.sort_unstable();
                assert_eq!(cast(tree, &moved, motion, 0.0), overlapping);
            }
        }
    });
}

#[test]
fn nearest_are_those_of_the_sorted_list() {
    each_scene(|random, trees, boxes| {
        let mut nearest = Vec::new();
        for k in 0..80 {
            let point = random.vector(k % 2 == 0);
            // Of those at the same distance, the one with the highest position comes first.
            let name = |id: u32| (k % 3 > 0 || !id.is_multiple_of(5)).then_some(!id);
            let distance = |b: &Aabb| {
                let [x, y, z] = [0, 1, 2].map(|a| (b.min[a] - point[a]).max(point[a] - b.max[a]).max(0.0));
                (x * x + y * y + z * z).sqrt()
            };
            let max = if k % 4 == 0 { random.below(8) as f32 } else { INF };
            let mut expected: Vec<Near> = (0..)
                .zip(boxes)
                .filter_map(|(id, b)| Some(Near::new(distance(b.as_ref()?), name(id)?)))
                .filter(|near| near.distance() <= max)
                .collect();
            expected.sort_unstable();
            for count in [0, 1, 7, 100, 10_000] {
                for tree in trees {
                    tree.nearest(point, count, max, name, &mut nearest);
                    assert_eq!(nearest, expected[..count.min(expected.len())], "{:?} {point:?} {count}", tree.simd);
                }
            }
            let capacity = nearest.capacity();
            trees[0].nearest(point, 100, max, name, &mut nearest);
            assert_eq!(nearest.capacity(), capacity);
        }
    });
}

/// A ray meets a box whose face it lies in, or whose edge or corner it touches.
#[test]
fn touching_rays_meet_the_box() {
    let boxes = [Aabb::new([1.0; 3], [2.0; 3])];
    let tree = Tree::of(&boxes).unwrap();
    let first = |origin, direction, max| {
        let mut first = None;
        tree.cast_box(&point(origin), direction, max, |_, t| *first.insert(t));
        first
    };
    assert_eq!(first([0.0, 1.0, 1.5], [2.0, 0.0, 0.0], INF), Some(0.5), "in a face");
    assert_eq!(first([0.0, 2.0, 1.0], [-0.0, 0.0, 0.0], INF), None, "no direction, outside");
    assert_eq!(first([0.0, 0.0, 1.5], [1.0, 1.0, 0.0], INF), Some(1.0), "through an edge");
    assert_eq!(first([0.0, 3.0, 2.0], [1.0, -1.0, 0.0], INF), Some(1.0), "at a corner");
    assert_eq!(first([2.0, 2.0, 2.0], [1.0, 1.0, 1.0], INF), Some(0.0), "begins on a corner");
    assert_eq!(first([0.0, 1.5, 1.5], [1.0, 0.0, 0.0], 1.0), Some(1.0), "ends on a face");
    assert_eq!(first([0.0, 1.5, 1.5], [1.0, 0.0, 0.0], 0.999_999), None, "ends before it");
    assert_eq!(first([0.0, 1.5, 1.5], [-1.0, 0.0, 0.0], INF), None, "leads away");
    assert_eq!(first([0.0, 0.999_999, 1.5], [1.0, 0.0, 0.0], INF), None, "passes by");
}
