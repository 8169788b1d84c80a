//! How far boxes move from one frame to the next.

use crate::aabb::Aabb;
use crate::splitmix::mix;

/// Boxes watched. Their mean displacement is known to about an eighth of the standard deviation over all boxes.
const WATCHED: usize = 64;

/// Edges of infinite boxes count as this, so that every ratio of two lengths is a number.
const MOST_EDGE: f32 = 1.0e30;

/// Boxes that move by less than this share of an edge in a frame are as good as still.
const STILL: f64 = 0.01;

/// How far two paces are apart, each in edges of a box in a frame: the natural logarithm of their ratio, 0 where boxes are as good as still at both.
pub(crate) fn paces_apart_ln(one: f64, other: f64) -> f64 {
    ((one + STILL) / (other + STILL)).ln().abs()
}

/// Paces that are less far apart may be the same: few boxes are watched.
const SAME_PACE_LN: f64 = 0.25;

/// Whether two paces that were [looked at](Displacement::moved) may be the same.
pub(crate) fn is_same_pace(one: f64, other: f64) -> bool {
    paces_apart_ln(one, other) < SAME_PACE_LN
}

/// Where a few boxes were in the frame before.
///
/// Boxes are known by their position in the list: one that is exchanged for another counts as one that moved.
#[derive(Debug, Clone)]
pub struct Displacement {
    watched: [(u32, Aabb); WATCHED],
    watching: usize,
    /// How often boxes were watched.
    rounds: u64,
}

impl Default for Displacement {
    /// Of a frame that has no frame before.
    fn default() -> Self {
        Self { watched: [(0, Aabb::default()); WATCHED], watching: 0, rounds: 0 }
    }
}

impl Displacement {
    /// Remembers where up to 64 boxes are, other ones each time, for the next frame to compare with. Allocates nothing.
    pub fn watch(&mut self, boxes: &[Aabb]) {
        self.rounds = self.rounds.wrapping_add(1);
        self.watching = boxes.len().min(WATCHED);
        let start = |part: usize| (part as u64 * boxes.len() as u64 / self.watching as u64) as usize;
        for (k, watched) in self.watched[..self.watching].iter_mut().enumerate() {
            // One box out of each of 64 equal parts, at a place that differs from part to part and from time to time: boxes that move may
            // follow each other at regular distances, and an even spacing could meet all of them or none.
            let (first, end) = (start(k), start(k + 1));
            let id = first + (mix(self.rounds << 8 | k as u64) % (end - first) as u64) as usize;
            *watched = (id as u32, boxes[id]);
        }
    }

    /// How far the watched boxes have moved since, 0 to 1: the mean over them of the greatest displacement of a bound, in mean
    /// edges of the box and no more than 1. `None` when no valid box was watched that is still there.
    ///
    /// An edge counts as no longer than four times that which nine boxes in ten don't exceed: a box as large as the world
    /// moves far when it passes many others, however small a share of its edge that is.
    #[must_use]
    pub fn moved(&self, boxes: &[Aabb]) -> Option<f64> {
        let (mut moves, mut edges) = ([(0.0, 0.0); WATCHED], [0.0; WATCHED]);
        let mut count = 0;
        for (id, before) in &self.watched[..self.watching] {
            // The algorithm that finds the pairs reports invalid boxes; here they would make a ratio negative.
            let valid = |b: &&Aabb| b.defect().is_none() && before.defect().is_none();
            if let Some(now) = boxes.get(*id as usize).filter(valid) {
                edges[count] = mean_edge(now);
                moves[count] = (greatest(before, now), edges[count]);
                count += 1;
            }
        }
        if count == 0 {
            return None;
        }
        let longest = 4.0 * *edges[..count].select_nth_unstable_by(count * 9 / 10, f32::total_cmp).1;
        let share = |(by, edge): (f32, f32)| if by == 0.0 { 0.0 } else { (by / edge.min(longest)).min(1.0) };
        Some(f64::from(moves[..count].iter().copied().map(share).sum::<f32>()) / count as f64)
    }
}

/// The greatest displacement of a bound.
fn greatest(before: &Aabb, now: &Aabb) -> f32 {
    let bound = |a: usize| (now.min[a] - before.min[a]).abs().max((now.max[a] - before.max[a]).abs());
    // An infinite bound that stays where it is yields NaN, which `max` passes over.
    (0..3).map(bound).fold(0.0, f32::max)
}

fn mean_edge(b: &Aabb) -> f32 {
    let mean = (0..3).map(|a| b.max[a] - b.min[a]).sum::<f32>() / 3.0;
    // False for NaN too: a box that lies at infinity has such an edge.
    if mean < MOST_EDGE { mean } else { MOST_EDGE }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(count: usize, shift: f32) -> Vec<Aabb> {
        (0..count).map(|k| Aabb::cube([2.0 * k as f32 + shift, 0.0, 0.0], 0.5)).collect()
    }

    fn moved(before: &[Aabb], now: &[Aabb]) -> Option<f64> {
        let mut displacement = Displacement::default();
        displacement.watch(before);
        displacement.moved(now)
    }

    #[test]
    fn displacements_are_in_edges_of_the_box_and_end_at_one() {
        for count in [1, 7, 64, 65, 10_000] {
            assert_eq!(moved(&row(count, 0.0), &row(count, 0.0)), Some(0.0));
            assert_eq!(moved(&row(count, 0.0), &row(count, 0.25)), Some(0.25));
            assert_eq!(moved(&row(count, 0.0), &row(count, 50.0)), Some(1.0));
        }
        // The second of two boxes is twice as large.
        let scene = |shift| [Aabb::cube([0.0; 3], 0.5), Aabb::cube([shift, 0.0, 0.0], 1.0)];
        assert_eq!(moved(&scene(5.0), &scene(5.5)), Some(0.125));
    }

    #[test]
    fn a_frame_without_one_before_tells_nothing() {
        assert_eq!(Displacement::default().moved(&row(9, 0.0)), None);
        assert_eq!(moved(&[], &row(9, 0.0)), None);
        assert_eq!(moved(&row(9, 0.0), &[]), None);
    }

    #[test]
    fn boxes_that_came_or_went_are_not_compared() {
        assert_eq!(moved(&row(500, 0.0), &row(900, 0.0)), Some(0.0));
        assert_eq!(moved(&row(900, 0.0), &row(500, 0.25)), Some(0.25));
    }

    #[test]
    fn boxes_that_move_at_regular_distances_are_met_by_their_share() {
        let before = row(64 * 400, 0.0);
        let met = |first: usize| {
            let mut now = before.clone();
            now.iter_mut().skip(first).step_by(20).for_each(|b| *b = Aabb::cube([-9.0; 3], 0.5));
            moved(&before, &now).unwrap()
        };
        let shares: Vec<f64> = (0..20).map(met).collect();
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        assert!(shares.iter().all(|&s| s < 0.2), "{shares:?}");
    }

    #[test]
    fn in_time_every_box_is_watched() {
        let before = row(640, 0.0);
        let mut now = before.clone();
        now[333] = Aabb::cube([-9.0; 3], 0.5);
        let mut displacement = Displacement::default();
        let mut met = || {
            displacement.watch(&before);
            displacement.moved(&now) > Some(0.0)
        };
        assert!((5..20).contains(&(0..100).filter(|_| met()).count()));
    }

    #[test]
    fn infinite_and_invalid_boxes_leave_a_share() {
        let inf = f32::INFINITY;
        let odd = [
            Aabb::new([-inf; 3], [inf; 3]),
            Aabb::new([inf; 3], [inf; 3]),
            Aabb::new([f32::MIN; 3], [f32::MAX; 3]),
            Aabb::cube([1.0; 3], 0.0),
            Aabb::cube([f32::NAN; 3], 1.0),
            Aabb::new([3.0; 3], [-3.0; 3]),
            Aabb::cube([2.0; 3], 0.5),
        ];
        for a in &odd {
            for b in &odd {
                for pad in [0, 3, 100] {
                    let scene = |b: &Aabb| -> Vec<Aabb> { row(pad, 0.0).into_iter().chain([*b; 20]).collect() };
                    let share = moved(&scene(a), &scene(b)).unwrap_or(1.0);
                    assert!((0.0..=1.0).contains(&share), "{a:?} to {b:?}: {share}");
                }
            }
            if a.defect().is_none() {
                assert_eq!(moved(&[*a], &[*a]), Some(0.0), "{a:?}");
            }
        }
    }
}
