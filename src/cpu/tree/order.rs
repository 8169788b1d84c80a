//! Sorts boxes along a space-filling curve.

use super::curve::{Curve, Spread};
use super::{Input, Members};
use crate::cpu::{LANES, Workers, ensure, order_key, sort};
use crate::{Aabb, Error, Screen};
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Most boxes in a cell of the curve that may stand in any order: two leaves. More are a dense cell.
const CROWDED: usize = 2 * LANES;

/// Boxes of a dense cell that all threads sort together. Smaller dense cells are dealt out to the threads.
const LARGE: usize = 16_384;

/// The bit of a code that marks a passive box. Curves leave it free.
const PASSIVE: u32 = 1 << 31;

/// Sorts boxes along the curve.
#[derive(Debug, Default)]
pub(super) struct Order {
    /// Code in the upper half, position of the box in the lower.
    keys: Vec<u64>,
    len: usize,
    scratch: Vec<u64>,
    /// For each shape of the [sorted](Self::sort) boxes, active ones first: the axes on which the boxes are oversized,
    /// one bit each, and their places in the order.
    pub(super) shapes: Vec<(u32, Range<usize>)>,
    /// Code of the first active box of each leaf, ascending.
    pub(super) starts: Vec<u32>,
    /// Dense cells that are not sorted yet: the large ones, and the others.
    large: Vec<Range<usize>>,
    small: Vec<Range<usize>>,
    /// The spread that each task found in its part of a large dense cell.
    spreads: Vec<Spread>,
}

impl Order {
    pub(super) fn reserve(&mut self, objects: usize) -> Result<(), Error> {
        ensure(&mut self.keys, objects, "sort keys")?;
        ensure(&mut self.scratch, objects, "sort keys")
    }

    /// Returns the sorted boxes: their positions are in the lower halves.
    pub(super) fn ids(&self) -> &[u64] {
        &self.keys[..self.len]
    }

    /// Sorts the boxes at these positions by lower bound on an axis. The lower halves of the keys are places in
    /// `members`. Members without a box come last.
    pub(super) fn sort_along(&mut self, input: Input<'_>, members: &[u32], axis: usize) -> Result<(), Error> {
        let Input { workers, boxes, .. } = input;
        self.begin(members.len())?;
        let keys = &mut self.keys[..self.len];
        workers.map(members, keys, |at, &id| {
            let low = boxes.get(id as usize).map_or(u32::MAX, |b| order_key(b.min[axis]));
            u64::from(low) << 32 | at as u64
        });
        sort(workers, keys, &mut self.scratch)
    }

    /// Sorts the members. Returns the number of active boxes; they come first.
    pub(super) fn sort(&mut self, input: Input<'_>, members: Members<'_>, curve: &Curve) -> Result<usize, Error> {
        let len = members.len(input.boxes);
        self.begin(len)?;
        self.code(input, members, 0..len, curve)?;
        self.finish(input)
    }

    /// Begins to sort this many members. [`code`](Self::code) of all of them and [`finish`](Self::finish) follow.
    pub(super) fn begin(&mut self, members: usize) -> Result<(), Error> {
        self.len = members;
        ensure(&mut self.keys, members, "sort keys")
    }

    /// Makes the keys of a part of the members.
    pub(super) fn code(
        &mut self,
        Input { workers, boxes, screen }: Input<'_>,
        members: Members<'_>,
        part: Range<usize>,
        curve: &Curve,
    ) -> Result<(), Error> {
        let keys = &mut self.keys[part.clone()];
        let invalid = AtomicUsize::new(usize::MAX);
        let key = |id: usize, b: &Aabb| {
            let (key, valid) = key(id, b, curve, screen);
            if !valid {
                invalid.fetch_min(id, Relaxed);
            }
            key
        };
        match members {
            Members::From(first) => {
                let first = first + part.start;
                workers.map(&boxes[first..first + part.len()], keys, |k, b| key(first + k, b));
            }
            Members::Of(ids) => workers.map(&ids[part], keys, |_, &id| key(id as usize, &boxes[id as usize])),
        }
        let invalid = invalid.into_inner();
        boxes.get(invalid..).map_or(Ok(()), |rest| Aabb::check(rest, invalid))
    }

    /// Makes the key of a box anew, if all boxes are members.
    pub(super) fn code_again(&mut self, id: u32, boxes: &[Aabb], curve: &Curve, screen: Option<&Screen>) {
        let id = id as usize;
        self.keys[id] = key(id, &boxes[id], curve, screen).0;
    }

    /// Sorts all keys. Returns the number of active boxes; they come first.
    pub(super) fn finish(&mut self, Input { workers, boxes, .. }: Input<'_>) -> Result<usize, Error> {
        let keys = &mut self.keys[..self.len];
        sort(workers, keys, &mut self.scratch)?;
        let active = keys.partition_point(|&key| code(key) < PASSIVE);
        self.starts.clear();
        self.starts.extend(keys[..active].iter().step_by(LANES).map(|&key| code(key)));
        self.shapes.clear();
        for (keys, first) in [(&keys[..active], 0), (&keys[active..], active)] {
            let mut at = 0;
            while at < keys.len() {
                let shape = Curve::long_axes(code(keys[at]));
                let end = at + keys[at..].partition_point(|&key| Curve::long_axes(code(key)) == shape);
                self.shapes.push((shape, first + at..first + end));
                at = end;
            }
        }
        self.sort_dense_cells(workers, boxes)?;
        Ok(active)
    }

    /// Sorts the boxes of each dense cell along a curve through their own bounds, and so on with the dense cells of
    /// that curve.
    fn sort_dense_cells(&mut self, workers: &Workers, boxes: &[Aabb]) -> Result<(), Error> {
        let Self { keys, len, scratch, large, small, spreads, .. } = self;
        let keys = &mut keys[..*len];
        let mut note = |keys: &[u64], first: usize, large: &mut Vec<_>| {
            each_dense_cell(keys, |cell| {
                let cell = first + cell.start..first + cell.end;
                if cell.len() < LARGE { small.push(cell) } else { large.push(cell) }
            });
        };
        note(keys, 0, large);
        while let Some(cell) = large.pop() {
            let (first, keys) = (cell.start, &mut keys[cell]);
            let size = keys.len().div_ceil(workers.tasks());
            spreads.clear();
            spreads.resize(workers.tasks(), Spread::NOTHING);
            workers.each_of(spreads.iter_mut().zip(keys.chunks(size)), |(to, keys)| *to = Spread::of(keys, boxes));
            let all = spreads.iter().fold(Spread::NOTHING, |all, part| all.with(part));
            if let Some(curve) = Curve::within(&all, keys.len()) {
                workers.each_of(keys.chunks_mut(size), |keys| curve.recode(keys, boxes));
                sort(workers, keys, scratch)?;
                if code(keys[0]) != code(keys[keys.len() - 1]) {
                    note(keys, first, large);
                }
            }
        }
        let mut rest = &mut *keys;
        let mut behind = 0;
        // Ascending, so that the keys can be split for them.
        small.sort_unstable_by_key(|cell| cell.start);
        let cells = small.drain(..).map(|cell| {
            let (_, from) = std::mem::take(&mut rest).split_at_mut(cell.start - behind);
            let (keys, after) = from.split_at_mut(cell.len());
            behind = cell.end;
            rest = after;
            keys
        });
        workers.each_of(cells, |keys| sort_dense_cell(keys, boxes));
        Ok(())
    }
}

/// Makes the key of a box. Returns whether the box is valid, too.
#[inline(always)]
fn key(id: usize, b: &Aabb, curve: &Curve, screen: Option<&Screen>) -> (u64, bool) {
    let (code, valid) = curve.code(b);
    let passive = if screen.is_some_and(|s| s.is_passive(id)) { PASSIVE } else { 0 };
    (u64::from(code | passive) << 32 | id as u64, valid)
}

fn code(key: u64) -> u32 {
    (key >> 32) as u32
}

/// Sorts a dense cell, then the dense cells of its own curve.
fn sort_dense_cell(keys: &mut [u64], boxes: &[Aabb]) {
    // Each curve is at least twice as fine as the previous one, so the range of floats ends the recursion.
    let Some(curve) = Curve::within(&Spread::of(keys, boxes), keys.len()) else { return };
    curve.recode(keys, boxes);
    keys.sort_unstable();
    // Long boxes that lie one behind the other may be in one cell of every curve.
    if code(keys[0]) != code(keys[keys.len() - 1]) {
        let runs = keys.chunk_by_mut(|&a, &b| code(a) == code(b));
        runs.filter(|run| run.len() > CROWDED).for_each(|run| sort_dense_cell(run, boxes));
    }
}

/// Calls `found` for every run of more than [`CROWDED`] keys with one code. The keys ascend.
fn each_dense_cell(keys: &[u64], mut found: impl FnMut(Range<usize>)) {
    let mut at = 0;
    // Each of these runs has a key at a multiple of `CROWDED`, and half as many keys before or behind that one.
    while at < keys.len() {
        let this = code(keys[at]);
        let is_this = |k: usize| keys.get(k).is_some_and(|&key| code(key) == this);
        let mut next = at + CROWDED;
        if is_this(at + CROWDED / 2) || is_this(at.wrapping_sub(CROWDED / 2)) {
            let first = at.saturating_sub(CROWDED);
            let start = first + keys[first..at].partition_point(|&key| code(key) < this);
            if is_this(start + CROWDED) {
                let end = at + keys[at..].partition_point(|&key| code(key) == this);
                found(start..end);
                next = end.next_multiple_of(CROWDED);
            }
        }
        at = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Threads;
    use crate::{SceneStats, mix};

    /// Returns a small box in the unit cube, scaled and moved.
    fn at(k: u64, scale: f32, by: [f32; 3]) -> Aabb {
        let unit = |a: u64| (mix(3 * k + a) >> 40) as f32 / (1 << 24) as f32;
        Aabb::cube([0, 1, 2].map(|a| unit(a) * scale + by[a as usize]), scale / 200.0)
    }

    fn ordered(boxes: &[Aabb], threads: u32, screen: Option<&Screen>) -> (Vec<u32>, usize) {
        let workers = Workers::new("tree", threads, &Threads::default());
        let mut order = Order::default();
        let curve = Curve::over(&SceneStats::of(boxes), boxes.len());
        let moving = order.sort(Input { workers: &workers, boxes, screen }, Members::From(0), &curve).unwrap();
        (order.ids().iter().map(|&key| key as u32).collect(), moving)
    }

    /// Returns the mean over the leaves of the longest edge of their bounds.
    fn longest_edge(boxes: &[Aabb], ids: &[u32]) -> f64 {
        let edge = |leaf: &[u32]| {
            let all = leaf.iter().map(|&id| boxes[id as usize]).reduce(|a, b| a.union(&b)).unwrap();
            (0..3).map(|a| f64::from(all.max[a]) - f64::from(all.min[a])).fold(0.0, f64::max)
        };
        ids.chunks(LANES).map(edge).sum::<f64>() / ids.len().div_ceil(LANES) as f64
    }

    #[test]
    fn leaves_of_world_long_boxes_meet_few_others() {
        const COUNT: usize = 8192;
        let unit = |k: u64| (mix(k) >> 40) as f32 / (1 << 24) as f32;
        // The half edges of each box, in a world of edge 100.
        let rods = |k: usize| [0, 1, 2].map(|a| if k % 3 == a { 100.0 } else { 0.01 });
        let sheets = |_| [60.0, 60.0, 0.0];
        let floors = |_| [10.0, 10.0, 0.0];
        let walls = |k: usize| if k.is_multiple_of(50) { rods(k).map(|h| 100.0 - h) } else { [0.3; 3] };
        let beams = |k: usize| [unit(k as u64).powi(4) * 60.0, unit(!k as u64).powi(4) * 60.0, 0.01];
        let cubes = |_| [1.0_f32; 3];
        let mut met = Vec::new();
        for of in [&cubes as &dyn Fn(usize) -> [f32; 3], &rods, &sheets, &floors, &walls, &beams] {
            let boxes: Vec<Aabb> = (0..COUNT)
                .map(|k| {
                    let (centre, half) = ([0, 1, 2].map(|a| unit((3 * k + a + 7) as u64) * 100.0), of(k));
                    Aabb::new([0, 1, 2].map(|a| centre[a] - half[a]), [0, 1, 2].map(|a| centre[a] + half[a]))
                })
                .collect();
            let (ids, _) = ordered(&boxes, 1, None);
            let bounds = |leaf: &[u32]| leaf.iter().map(|&k| boxes[k as usize]).reduce(|a, b| a.union(&b)).unwrap();
            let leaves: Vec<Aabb> = ids.chunks(LANES).map(bounds).collect();
            let pairs = (0..leaves.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
            met.push(pairs.filter(|&(i, j)| leaves[i].overlaps(&leaves[j])).count() as f64 / leaves.len() as f64);
        }
        assert!(met.iter().all(|&m| m < 6.0 * met[0]), "{met:?}");
    }

    #[test]
    fn dense_cells_are_the_long_runs() {
        for k in 0..200 {
            let mut keys: Vec<u64> = (0..500).map(|at| (mix(k) % (4 + k % 40) * at / 300) << 32 | at).collect();
            keys.sort_unstable();
            let runs = keys.chunk_by(|&a, &b| code(a) == code(b)).scan(0, |start, run| {
                *start += run.len();
                Some(*start - run.len()..*start)
            });
            let mut found = Vec::new();
            each_dense_cell(&keys, |cell| found.push(cell));
            assert_eq!(found, runs.filter(|run| run.len() > CROWDED).collect::<Vec<_>>());
        }
    }

    #[test]
    fn neighbours_in_space_are_neighbours_in_the_order() {
        let most = if cfg!(feature = "parallel") { 3 } else { 1 };
        let one = |k: u64| at(k, 100.0, [0.0; 3]);
        // Many equal worlds on a line, a million edges apart, so that each is a dense cell; worlds in one corner, each
        // a thousand times smaller than the last; and a world with a large dense cell far away.
        let row = |k: u64| at(k, 100.0, [1.0e8 * (k % 40) as f32, 0.0, 0.0]);
        let nested = |k: u64| at(k, 100.0 * 1.0e-3_f32.powi((k % 5) as i32), [0.0; 3]);
        let pooled = |k: u64| if k.is_multiple_of(2) { one(k) } else { at(k, 100.0, [3.0e9, -8.0e9, 5.0e9]) };
        let count = 40_000;
        let evenly: Vec<Aabb> = (0..count).map(one).collect();
        let even = longest_edge(&evenly, &ordered(&evenly, 1, None).0);
        for (name, of) in [("row", &row as &dyn Fn(u64) -> Aabb), ("nested", &nested), ("pooled", &pooled)] {
            let boxes: Vec<Aabb> = (0..count).map(of).collect();
            let (ids, moving) = ordered(&boxes, 1, None);
            let mut all = ids.clone();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..count as u32) && moving == count as usize, "{name}");
            assert_eq!(ordered(&boxes, most, None).0, ids, "{name} on {most} threads");
            // Boxes in fewer worlds lie closer, and only a few leaves span two worlds.
            let mut edges: Vec<f64> = ids.chunks(LANES).map(|leaf| longest_edge(&boxes, leaf)).collect();
            edges.sort_unstable_by(f64::total_cmp);
            let middle = edges[edges.len() / 2];
            assert!(middle < 4.0 * even, "{name}: {middle}, evenly spread {even}");
            let astray = edges.iter().filter(|&&edge| edge > 400.0).count();
            assert!(astray <= 80, "{name}: {astray} leaves of {}", edges.len());
        }
    }

    #[test]
    fn degenerate_boxes_are_ordered_once() {
        let inf = f32::INFINITY;
        let odd = [
            Aabb::cube([1.0; 3], 0.0),
            Aabb::new([-inf; 3], [inf; 3]),
            Aabb::new([inf; 3], [inf; 3]),
            Aabb::new([-inf, 0.0, 0.0], [3.0, 1.0, 1.0]),
            Aabb::new([f32::MIN; 3], [f32::MAX; 3]),
            Aabb::cube([1.0e-40; 3], 1.0e-44),
        ];
        for pad in [0, 60, 20_000] {
            for of in &odd {
                let mut boxes = vec![*of; 20_000];
                boxes.extend((0..pad).map(|k| odd[k % odd.len()]));
                let (mut ids, _) = ordered(&boxes, 1, None);
                ids.sort_unstable();
                assert!(ids.into_iter().eq(0..boxes.len() as u32), "{of:?}");
            }
        }
    }

    #[test]
    fn large_and_long_boxes_share_no_leaf_and_fixed_ones_come_last() {
        let boxes: Vec<Aabb> = (0..4096)
            .map(|k| {
                let mut b = at(k, 100.0, [0.0; 3]);
                match k % 64 {
                    0 => b.max[0] += 40.0,
                    1 => b.max[2] += 40.0,
                    2 => b = Aabb { min: b.min, max: b.max.map(|v| v + 300.0) },
                    _ => {}
                }
                b
            })
            .collect();
        let membership = |k: u32| crate::Membership { fixed: k.is_multiple_of(3), ..crate::Membership::ALL };
        let screen = Screen::new(crate::Filter::new((0..4096).map(membership).collect()));
        let (ids, moving) = ordered(&boxes, 1, Some(&screen));
        assert!(moving == 2730 && (0..4096).all(|k| ids[k].is_multiple_of(3) == (k >= moving)));
        let (ids, _) = ordered(&boxes, 1, None);
        let kind = |id: u32| (id % 64).min(3);
        let mixed = ids.chunks(LANES).filter(|leaf| leaf.iter().any(|&id| kind(id) != kind(leaf[0]))).count();
        assert!(mixed <= 4, "{mixed} leaves with boxes of several kinds");
    }
}
