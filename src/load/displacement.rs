//! Measures how far boxes move from one frame to the next.

use super::one_of_each;
use crate::Aabb;

/// Boxes watched. The standard error of their mean displacement is an eighth of the standard deviation over all boxes.
const WATCHED: usize = 64;

/// Longest edge: those of infinite boxes are clamped to this, so that every ratio of two lengths is finite.
const MOST_EDGE: f32 = 1.0e30;

/// Slower boxes than this, in edges a frame, count as still.
const STILL: f64 = 0.01;

/// Speeds closer than this may be the same: few boxes are watched.
const SAME_PACE_LN: f64 = 0.25;

/// Returns whether two values of [`Motion::moved`] may stand for the same speed.
pub(crate) fn is_same_pace(one: f64, other: f64) -> bool {
    ((one + STILL) / (other + STILL)).ln().abs() < SAME_PACE_LN
}

/// Share of its mean edge by which a box moves at least to count in [`Motion::moved_share`].
const FAR: f32 = 0.1;

/// How far boxes move in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Mean over a sample of the greatest displacement of a bound since the previous frame, in mean edges of the box,
    /// at most 1 each.
    pub moved: f64,
    /// Share of the sample that moved by more than a tenth of a mean edge, 0 to 1.
    pub moved_share: f64,
}

impl Motion {
    /// The motion if no frame helps with the next.
    pub(crate) const MOST: Self = Self { moved: 1.0, moved_share: 1.0 };
}

/// The positions of a few boxes in the previous frame.
///
/// A box is known by its position in the list: one exchanged for another counts as moved.
#[derive(Debug, Clone)]
pub struct Displacement {
    watched: [(u32, Aabb); WATCHED],
    watching: usize,
    /// Number of calls of [`watch`](Self::watch).
    rounds: u64,
}

impl Default for Displacement {
    /// Watches no box.
    fn default() -> Self {
        Self { watched: [(0, Aabb::default()); WATCHED], watching: 0, rounds: 0 }
    }
}

impl Displacement {
    /// Remembers up to 64 boxes, other ones each time, to compare the next frame with. Allocates nothing.
    pub fn watch(&mut self, boxes: &[Aabb]) {
        self.rounds = self.rounds.wrapping_add(1);
        self.watching = boxes.len().min(WATCHED);
        let ids = one_of_each(boxes.len(), self.watching, self.rounds << 8);
        self.watched.iter_mut().zip(ids).for_each(|(watched, id)| *watched = (id as u32, boxes[id]));
    }

    /// Returns the motion of the watched boxes since. `None` if no watched box is valid and still there.
    ///
    /// Edges are clamped to four times their 0.9 quantile: a box as large as the world moves far when it passes many
    /// others, however small a share of its edge that is.
    pub fn motion(&self, boxes: &[Aabb]) -> Option<Motion> {
        let (mut moves, mut edges) = ([(0.0, 0.0); WATCHED], [0.0; WATCHED]);
        let mut count = 0;
        for (id, before) in &self.watched[..self.watching] {
            // Skips invalid boxes, which could make a ratio negative. The algorithm reports them.
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
        let in_edges = |&(by, edge): &(f32, f32)| if by == 0.0 { 0.0 } else { (by / edge.min(longest)).min(1.0) };
        let moves = moves[..count].iter().map(in_edges);
        let far = moves.clone().filter(|&by| by > FAR).count();
        let count = count as f64;
        Some(Motion { moved: f64::from(moves.sum::<f32>()) / count, moved_share: far as f64 / count })
    }
}

/// Returns the greatest displacement of a bound.
fn greatest(before: &Aabb, now: &Aabb) -> f32 {
    let bound = |a: usize| (now.min[a] - before.min[a]).abs().max((now.max[a] - before.max[a]).abs());
    // An infinite bound that stays yields NaN, which `max` ignores.
    (0..3).map(bound).fold(0.0, f32::max)
}

fn mean_edge(b: &Aabb) -> f32 {
    let mean = (0..3).map(|a| b.max[a] - b.min[a]).sum::<f32>() / 3.0;
    // False for NaN too, the edge of a box at infinity.
    if mean < MOST_EDGE { mean } else { MOST_EDGE }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(count: usize, shift: f32) -> Vec<Aabb> {
        (0..count).map(|k| Aabb::cube([2.0 * k as f32 + shift, 0.0, 0.0], 0.5)).collect()
    }

    fn motion(before: &[Aabb], now: &[Aabb]) -> Option<Motion> {
        let mut displacement = Displacement::default();
        displacement.watch(before);
        displacement.motion(now)
    }

    fn moved(before: &[Aabb], now: &[Aabb]) -> Option<f64> {
        motion(before, now).map(|m| m.moved)
    }

    #[test]
    fn displacements_are_in_edges_and_at_most_1() {
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
    fn boxes_count_as_moved_from_a_tenth_of_an_edge() {
        let share = |count, shift| motion(&row(count, 0.0), &row(count, shift)).unwrap().moved_share;
        for count in [1, 64, 10_000] {
            assert_eq!([0.0, 0.0625, 0.125, 50.0].map(|shift| share(count, shift)), [0.0, 0.0, 1.0, 1.0]);
        }
        // A tenth of the clamped edge: the box as large as the world moves by 8 edges of the others.
        let scene = |shift| {
            let world = Aabb::new([shift, 0.0, 0.0], [shift + 1e6, 1e6, 1e6]);
            row(31, 0.0).into_iter().chain([world]).collect::<Vec<_>>()
        };
        assert_eq!(motion(&scene(0.0), &scene(8.0)).unwrap(), Motion { moved: 1.0 / 32.0, moved_share: 1.0 / 32.0 });
    }

    #[test]
    fn first_frame_has_no_motion() {
        assert_eq!(Displacement::default().motion(&row(9, 0.0)), None);
        assert_eq!(moved(&[], &row(9, 0.0)), None);
        assert_eq!(moved(&row(9, 0.0), &[]), None);
    }

    #[test]
    fn boxes_that_came_or_went_are_not_compared() {
        assert_eq!(moved(&row(500, 0.0), &row(900, 0.0)), Some(0.0));
        assert_eq!(moved(&row(900, 0.0), &row(500, 0.25)), Some(0.25));
    }

    #[test]
    fn every_box_is_watched_in_time() {
        let before = row(640, 0.0);
        let mut now = before.clone();
        now[333] = Aabb::cube([-9.0; 3], 0.5);
        let mut displacement = Displacement::default();
        let mut met = || {
            displacement.watch(&before);
            displacement.motion(&now).unwrap().moved > 0.0
        };
        assert!((5..20).contains(&(0..100).filter(|_| met()).count()));
    }

    #[test]
    fn motion_of_odd_boxes_is_from_0_to_1() {
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
                    let Motion { moved, moved_share } = motion(&scene(a), &scene(b)).unwrap_or(Motion::MOST);
                    assert!((0.0..=1.0).contains(&moved), "{a:?} to {b:?}: {moved}");
                    assert!((moved..=1.0).contains(&moved_share) || moved < 0.5, "{a:?} to {b:?}: {moved_share}");
                }
            }
            if a.defect().is_none() {
                assert_eq!(moved(&[*a], &[*a]), Some(0.0), "{a:?}");
            }
        }
    }
}
