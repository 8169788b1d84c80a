//! Sorts boxes along a space-filling curve.

use super::Members;
use crate::aabb::Aabb;
use crate::cpu::columns::ensure;
use crate::cpu::kernel::node::LANES;
use crate::cpu::sort::sort;
use crate::cpu::workers::Workers;
use crate::error::Error;
use crate::filter::Filter;
use crate::load::SceneStats;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Most boxes in a cell of the curve that may stand in any order: two leaves. More are a dense cell.
const CROWDED: usize = 2 * LANES;

/// Boxes of a dense cell that all threads sort together. Smaller dense cells are dealt out to the threads.
const LARGE: usize = 16_384;

/// Cells of the curve on each axis: nine bits of the code for each.
const CELLS: f32 = 512.0;

/// Cells on each axis of the curve through a dense cell.
const FINE_CELLS: f32 = 1024.0;

/// The bit of a code that marks a fixed box, and the lowest bit of the class.
const FIXED: u32 = 1 << 31;
const CLASS: u32 = 27;

/// A box counts as long on an axis if it is this many times as long there as on each of the others.
const LONG: f32 = 4.0;

/// Coordinates are clamped to this, so that the distance of two is finite.
const MOST: f32 = 1.0e38;

/// A curve through the cells of a cube, in Morton order.
pub(super) struct Curve {
    origin: [f32; 3],
    inverse_width: f32,
    cells: f32,
    /// Longest edge of a box of the usual size.
    usual: f32,
}

impl Curve {
    /// Makes a curve through the range of most boxes. Its cells are cubes.
    pub(super) fn over(stats: &SceneStats) -> Self {
        let range = [0, 1, 2].map(|a| stats.range(a));
        let longest = range.iter().map(|r| r.1).fold(0.0, f64::max);
        let edge = stats.extent.iter().copied().fold(0.0, f64::max);
        Self::through(range.map(|r| r.0 as f32), longest as f32, CELLS, 2.0 * edge as f32)
    }

    /// Makes a curve through the centres in a dense cell, which have these bounds. `None` if all centres are the same.
    fn within(bounds: &Aabb) -> Option<Self> {
        let length = (0..3).map(|a| bounds.max[a] - bounds.min[a]).fold(0.0, f32::max);
        let curve = Self::through(bounds.min, length, FINE_CELLS, f32::INFINITY);
        (curve.inverse_width > 0.0).then_some(curve)
    }

    fn through(origin: [f32; 3], length: f32, cells: f32, usual: f32) -> Self {
        let inverse = cells / length;
        Self { origin, inverse_width: if inverse.is_finite() { inverse } else { 0.0 }, cells, usual }
    }

    /// Replaces the codes of these keys by those along this curve.
    fn recode(&self, keys: &mut [u64], boxes: &[Aabb]) {
        for key in keys {
            let id = *key as u32;
            *key = u64::from(self.cell(&boxes[id as usize])) << 32 | u64::from(id);
        }
    }

    /// Returns the cell of the centre of a box on the curve. Outside the cube that is the nearest cell on its surface.
    #[inline]
    fn cell(&self, b: &Aabb) -> u32 {
        let centre = centre(b);
        let cell = |a: usize| ((centre[a] - self.origin[a]) * self.inverse_width).clamp(0.0, self.cells - 1.0) as u32;
        interleave(cell(0)) | interleave(cell(1)) << 1 | interleave(cell(2)) << 2
    }

    /// Returns the sort key of a box: its class, then its cell. Large boxes, and boxes long on an axis, would widen the
    /// leaves that they shared with others.
    #[inline]
    fn code(&self, b: &Aabb) -> u32 {
        let edges = [0, 1, 2].map(|a| b.max[a] - b.min[a]);
        let longest = edges[0].max(edges[1]).max(edges[2]);
        self.cell(b) | if longest > self.usual { class(edges, longest / self.usual) << CLASS } else { 0 }
    }
}

/// Returns the class, 1 to 15, of an unusually large box: by size in steps of four, and in the lower three steps by the
/// axis on which it is long.
#[cold]
fn class(edges: [f32; 3], ratio: f32) -> u32 {
    // NaN, of infinity over infinity, is in the largest class.
    let step =
        [4.0, 16.0, 64.0, 256.0, 1024.0].iter().take_while(|&&limit| ratio > limit || ratio.is_nan()).count() as u32;
    if step > 2 {
        return 10 + step;
    }
    let long = |a: usize| (0..3).all(|other| other == a || edges[a] > LONG * edges[other]);
    1 + 4 * step + (0..3).find(|&a| long(a)).map_or(0, |a| 1 + a as u32)
}

/// Puts two zeros between any two of the lower ten bits.
#[inline]
fn interleave(v: u32) -> u32 {
    let v = (v | v << 16) & 0x0300_00ff;
    let v = (v | v << 8) & 0x0300_f00f;
    let v = (v | v << 4) & 0x030c_30c3;
    (v | v << 2) & 0x0924_9249
}

/// Sorts boxes along the curve.
#[derive(Debug, Default)]
pub(super) struct Order {
    /// Code in the upper half, position of the box in the lower.
    keys: Vec<u64>,
    len: usize,
    scratch: Vec<u64>,
    /// Dense cells that are not sorted yet: the large ones, and the others.
    large: Vec<Range<usize>>,
    small: Vec<Range<usize>>,
    /// The bounds that each task found in its part of a large dense cell.
    bounds: Vec<Aabb>,
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

    /// Sorts the members. Returns the number of boxes that may move; they come first.
    pub(super) fn sort(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        members: Members<'_>,
        curve: &Curve,
        filter: Option<&Filter>,
    ) -> Result<usize, Error> {
        self.len = match members {
            Members::All => boxes.len(),
            Members::Of(ids) => ids.len(),
        };
        ensure(&mut self.keys, self.len, "sort keys")?;
        let keys = &mut self.keys[..self.len];
        let invalid = AtomicUsize::new(usize::MAX);
        let key = |id: usize, b: &Aabb| {
            if b.defect().is_some() {
                invalid.fetch_min(id, Relaxed);
            }
            let fixed = if filter.is_some_and(|f| f.is_fixed(id)) { FIXED } else { 0 };
            u64::from(curve.code(b) | fixed) << 32 | id as u64
        };
        match members {
            Members::All => workers.map(boxes, keys, key),
            Members::Of(ids) => workers.map(ids, keys, |_, &id| key(id as usize, &boxes[id as usize])),
        }
        let invalid = invalid.into_inner();
        boxes.get(invalid..).map_or(Ok(()), |rest| Aabb::check(rest, invalid))?;
        sort(workers, keys, &mut self.scratch)?;
        let moving = keys.partition_point(|&key| code(key) < FIXED);
        self.sort_dense_cells(workers, boxes)?;
        Ok(moving)
    }

    /// Sorts the boxes of each dense cell along a curve through their own bounds, and so on with the dense cells of
    /// that curve.
    fn sort_dense_cells(&mut self, workers: &Workers, boxes: &[Aabb]) -> Result<(), Error> {
        let Self { keys, len, scratch, large, small, bounds } = self;
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
            bounds.clear();
            bounds.resize(workers.tasks(), Aabb::default());
            workers
                .each_of(bounds.iter_mut().zip(keys.chunks(size)), |(bounds, keys)| *bounds = bounds_of(keys, boxes));
            let all = bounds[..keys.len().div_ceil(size)].iter().fold(bounds[0], |all, b| all.union(b));
            if let Some(curve) = Curve::within(&all) {
                workers.each_of(keys.chunks_mut(size), |keys| curve.recode(keys, boxes));
                sort(workers, keys, scratch)?;
                note(keys, first, large);
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

fn code(key: u64) -> u32 {
    (key >> 32) as u32
}

/// Sorts a dense cell, then the dense cells of its own curve.
fn sort_dense_cell(keys: &mut [u64], boxes: &[Aabb]) {
    // Each curve is a thousand times finer than the previous one: the range of floats ends the recursion after 28 of
    // them.
    let Some(curve) = Curve::within(&bounds_of(keys, boxes)) else { return };
    curve.recode(keys, boxes);
    keys.sort_unstable();
    let runs = keys.chunk_by_mut(|&a, &b| code(a) == code(b));
    runs.filter(|run| run.len() > CROWDED).for_each(|run| sort_dense_cell(run, boxes));
}

/// Calls `found` for every run of more than [`CROWDED`] keys with one code.
fn each_dense_cell(keys: &[u64], mut found: impl FnMut(Range<usize>)) {
    let mut at = 0;
    while at + CROWDED < keys.len() {
        // Most runs are short: one look ahead shows that.
        let same = code(keys[at]);
        if code(keys[at + CROWDED]) == same {
            let end = at + keys[at..].partition_point(|&key| code(key) == same);
            found(at..end);
            at = end;
        } else {
            at += 1;
        }
    }
}

/// Returns the bounds of the centres of boxes.
fn bounds_of(keys: &[u64], boxes: &[Aabb]) -> Aabb {
    let nothing = Aabb::new([MOST; 3], [-MOST; 3]);
    keys.iter().fold(nothing, |all, &key| {
        let centre = centre(&boxes[key as u32 as usize]);
        all.union(&Aabb::new(centre, centre))
    })
}

/// Returns the centre of a box, clamped to [`MOST`].
#[inline]
fn centre(b: &Aabb) -> [f32; 3] {
    [0, 1, 2].map(|a| {
        let centre = b.min[a] * 0.5 + b.max[a] * 0.5;
        // NaN, of infinity less infinity, becomes 0.
        if centre.is_nan() { 0.0 } else { centre.clamp(-MOST, MOST) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Threads;
    use crate::splitmix::mix;

    /// Returns a small box in the unit cube, scaled and moved.
    fn at(k: u64, scale: f32, by: [f32; 3]) -> Aabb {
        let unit = |a: u64| (mix(3 * k + a) >> 40) as f32 / (1 << 24) as f32;
        Aabb::cube([0, 1, 2].map(|a| unit(a) * scale + by[a as usize]), scale / 200.0)
    }

    fn ordered(boxes: &[Aabb], threads: u32, filter: Option<&Filter>) -> (Vec<u32>, usize) {
        let workers = Workers::new("tree", threads, &Threads::default()).unwrap();
        let mut order = Order::default();
        let curve = Curve::over(&SceneStats::of(boxes));
        let moving = order.sort(&workers, boxes, Members::All, &curve, filter).unwrap();
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
    fn neighbours_in_space_are_neighbours_in_the_order() {
        let most = if cfg!(feature = "parallel") { 3 } else { 1 };
        let one = |k: u64| at(k, 100.0, [0.0; 3]);
        // Many equal worlds on a line, a million edges apart, so that each is a dense cell; worlds in one corner, each
        // a thousand times smaller than the last; and a world with a large dense cell far away.
        let row = |k: u64| at(k, 100.0, [1.0e8 * (k % 40) as f32, 0.0, 0.0]);
        let nested = |k: u64| at(k, 100.0 * 1.0e-3_f32.powi((k % 5) as i32), [0.0; 3]);
        let pooled = |k: u64| if k.is_multiple_of(2) { one(k) } else { at(k, 100.0, [3.0e9, -8.0e9, 5.0e9]) };
        let count = 40_000;
        let even = longest_edge(
            &(0..count).map(one).collect::<Vec<_>>(),
            &ordered(&(0..count).map(one).collect::<Vec<_>>(), 1, None).0,
        );
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
        let filter = Filter::new((0..4096).map(membership).collect());
        let (ids, moving) = ordered(&boxes, 1, Some(&filter));
        assert!(moving == 2730 && (0..4096).all(|k| ids[k].is_multiple_of(3) == (k >= moving)));
        let (ids, _) = ordered(&boxes, 1, None);
        let kind = |id: u32| (id % 64).min(3);
        let mixed = ids.chunks(LANES).filter(|leaf| leaf.iter().any(|&id| kind(id) != kind(leaf[0]))).count();
        assert!(mixed <= 4, "{mixed} leaves with boxes of several kinds");
    }
}
