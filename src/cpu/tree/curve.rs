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
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Most boxes in a cell of the curve that may stand in any order: two leaves. More are a dense cell.
const CROWDED: usize = 2 * LANES;

/// Boxes of a dense cell that all threads sort together. Smaller dense cells are dealt out to the threads.
const LARGE: usize = 16_384;

/// Bits of a cell's number on each axis, and on the axis with the most cells.
const BITS: u32 = 9;
const MOST_BITS: u32 = 12;

/// The bits of a code that mark a fixed and an oversized box. Behind the latter stands the class, then the cell of an
/// oversized box, which has this many bits.
const FIXED: u32 = 1 << 31;
const OVERSIZED: u32 = 1 << 30;
const OVERSIZED_BITS: u32 = 24;

/// Steps by which oversized edges are told apart on each axis, and the least ratio of two of them.
const STEPS: usize = 3;
const CLASSES: usize = 64;
const LEAST_STEP: f32 = 4.0;

/// A cell is at most this many times as long on one axis as on another.
const FLATTEST: f32 = 64.0;

/// Along a range this many times as long as on both other axes the order of the curve is that of the range.
const LINE: f32 = 64.0;

/// Coordinates are clamped to this, so that the distance of two is finite.
const MOST: f32 = 1.0e38;

/// A curve through the cells of a range in space.
///
/// A leaf that holds neighbours on the curve has the shape of a few cells, and it meets the fewest boxes if that is the
/// shape of its boxes (minimise the product over the axes of leaf plus box, at a fixed volume of the leaf). So cells
/// are flat if boxes are. A box longer than a leaf should be would widen the leaf, so each shape of oversized boxes has
/// a curve of its own, with few cells on the axes on which they are long. Extended Morton codes (Vinkler, Bittner and
/// Havran, HPG 2017) interleave sizes and positions to the same end.
#[derive(Debug)]
pub(super) struct Curve {
    /// Start of the range. The fourth value is unused.
    origin: [f32; 4],
    cells: Cells,
    /// The axis with the most cells.
    finest: usize,
    /// Along a line Morton's order is monotone. Hilbert's is not, but has no jumps.
    hilbert: bool,
    lengths: [f32; 3],
    /// An edge longer than the first is oversized.
    steps: [f32; STEPS],
    /// The cells of each class of oversized boxes, from the first such box on.
    classes: OnceLock<[Class; CLASSES]>,
}

/// The cells of a curve. The fourth values are unused.
#[derive(Debug, Clone, Copy)]
struct Cells {
    /// Cells in a unit of length.
    density: [f32; 4],
    /// The last cell on each axis.
    last: [f32; 4],
}

/// Oversized boxes of one shape.
#[derive(Debug, Clone, Copy)]
struct Class {
    cells: Cells,
    /// The axes from the one with the most cells on, and the bits of a cell's number on them.
    axes: [usize; 3],
    bits: [u32; 3],
}

impl Curve {
    /// Makes a curve for this many boxes through the range of most of them.
    pub(super) fn over(stats: &SceneStats, boxes: usize) -> Self {
        let range = [0, 1, 2].map(|a| stats.range(a));
        Self::through(range.map(|r| r.0 as f32), range.map(|r| r.1 as f32), stats.extent.map(|e| e as f32), boxes)
    }

    /// Makes a curve through a dense cell. `None` if all centres are the same.
    fn within(cell: &Spread, boxes: usize) -> Option<Self> {
        let lengths = [0, 1, 2].map(|a| cell.centres.max[a] - cell.centres.min[a]);
        let extent = cell.edges.map(|sum| (sum / boxes as f32).min(MOST));
        let curve = Self::through(cell.centres.min, lengths, extent, boxes);
        curve.cells.density.iter().any(|&d| d > 0.0).then_some(curve)
    }

    /// Makes a curve through a range of these lengths, for boxes of this usual extent.
    fn through([x, y, z]: [f32; 3], lengths: [f32; 3], extent: [f32; 3], boxes: usize) -> Self {
        let longest = extent.into_iter().fold(0.0, f32::max);
        // The cell's edge on each axis over its longest edge.
        let shape = extent.map(|e| if longest > 0.0 { (e / longest).clamp(1.0 / FLATTEST, 1.0) } else { 1.0 });
        let mut cells = [0, 1, 2].map(|a| (a, lengths[a] / shape[a]));
        cells.sort_by(|a, b| b.1.total_cmp(&a.1));
        let [(finest, most), (_, second), _] = cells;
        let scale = ((1 << MOST_BITS) as f32 / most).min((1 << BITS) as f32 / second);
        let density = shape.map(|s| if scale.is_finite() { scale / s } else { 0.0 });
        let usual = 2.0 * longest.min(leaf_edge(lengths, boxes));
        let step = (lengths.into_iter().fold(0.0, f32::max) / usual).cbrt().max(LEAST_STEP);
        let bits = |a: usize| if a == finest { MOST_BITS } else { BITS };
        let last = [0, 1, 2].map(|a| ((1 << bits(a)) - 1) as f32);
        Self {
            origin: [x, y, z, 0.0],
            cells: Cells { density: [density[0], density[1], density[2], 0.0], last: [last[0], last[1], last[2], 0.0] },
            finest,
            hilbert: most < LINE * second,
            lengths,
            steps: [usual, usual * step, usual * step * step],
            classes: OnceLock::new(),
        }
    }

    /// Replaces the codes of these keys by those along this curve.
    fn recode(&self, keys: &mut [u64], boxes: &[Aabb]) {
        for key in keys {
            let id = *key as u32;
            *key = u64::from(self.code(&boxes[id as usize]).0) << 32 | u64::from(id);
        }
    }

    /// Returns the code of a box, and whether the box is valid.
    ///
    /// The cell of a box is that of its centre. Outside the range that is the nearest cell on its surface.
    #[inline(always)]
    fn code(&self, b: &Aabb) -> (u32, bool) {
        let (cell, edges, valid) = self.place(b, &self.cells);
        // NaN, of infinity less infinity, is not oversized.
        if edges[0].max(edges[1]).max(edges[2]) > self.steps[0] {
            return (self.oversized(b, edges), valid);
        }
        let top = cell[self.finest] >> BITS << (3 * BITS);
        let low = cell.map(|c| c & ((1 << BITS) - 1));
        let code = spread3(low[0]) | spread3(low[1]) << 1 | spread3(low[2]) << 2;
        (top | if self.hilbert { hilbert(code) } else { code }, valid)
    }

    /// Returns the cell of a box, its edges, and whether it is valid.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn place(&self, b: &Aabb, cells: &Cells) -> ([u32; 3], [f32; 3], bool) {
        use std::arch::x86_64::*;
        // SAFETY: SSE2 is part of x86-64. The loads read floats 0 to 3 and 2 to 5 of an `Aabb`, which is `repr(C)`, and
        // arrays of four floats. The stores write arrays of four values.
        unsafe {
            let at = std::ptr::from_ref(b).cast::<f32>();
            let low = _mm_loadu_ps(at);
            let high = _mm_castsi128_ps(_mm_srli_si128::<4>(_mm_castps_si128(_mm_loadu_ps(at.add(2)))));
            let half = _mm_set1_ps(0.5);
            let centre = _mm_add_ps(_mm_mul_ps(low, half), _mm_mul_ps(high, half));
            // As in `centre`.
            let centre = _mm_and_ps(centre, _mm_cmpord_ps(centre, centre));
            let centre = _mm_min_ps(_mm_max_ps(centre, _mm_set1_ps(-MOST)), _mm_set1_ps(MOST));
            let load = |values: &[f32; 4]| _mm_loadu_ps(values.as_ptr());
            let cell = _mm_mul_ps(_mm_sub_ps(centre, load(&self.origin)), load(&cells.density));
            let cell = _mm_cvttps_epi32(_mm_min_ps(_mm_max_ps(cell, _mm_setzero_ps()), load(&cells.last)));
            let (mut numbers, mut edges) = ([0_u32; 4], [0.0_f32; 4]);
            _mm_storeu_si128(numbers.as_mut_ptr().cast(), cell);
            _mm_storeu_ps(edges.as_mut_ptr(), _mm_sub_ps(high, low));
            let ([x, y, z, _], [dx, dy, dz, _]) = (numbers, edges);
            ([x, y, z], [dx, dy, dz], _mm_movemask_ps(_mm_cmple_ps(low, high)) & 7 == 7)
        }
    }

    /// Returns the cell of a box, its edges, and whether it is valid.
    #[cfg(not(target_arch = "x86_64"))]
    #[inline(always)]
    fn place(&self, b: &Aabb, cells: &Cells) -> ([u32; 3], [f32; 3], bool) {
        let centre = centre(b);
        let cell = |a: usize| ((centre[a] - self.origin[a]) * cells.density[a]).clamp(0.0, cells.last[a]) as u32;
        ([0, 1, 2].map(cell), [0, 1, 2].map(|a| b.max[a] - b.min[a]), b.defect().is_none())
    }

    /// Returns the code of an oversized box: its class, then its cell. The axis with the most cells comes first.
    #[cold]
    fn oversized(&self, b: &Aabb, edges: [f32; 3]) -> u32 {
        let steps = edges.map(|edge| self.steps.iter().filter(|&&step| edge > step).count());
        let class = steps[0] << 4 | steps[1] << 2 | steps[2];
        let Class { cells, axes, bits: [_, some, few] } = &self.classes.get_or_init(|| self.classes())[class];
        let cell = self.place(b, cells).0;
        let [x, y, z] = axes.map(|a| cell[a]);
        let below = |v: u32, bits: &u32| v & ((1 << bits) - 1);
        let low = spread3(below(x, few)) | spread3(below(y, few)) << 1 | spread3(below(z, few)) << 2;
        let middle = spread2(below(x, some) >> few) | spread2(below(y, some) >> few) << 1;
        let cell = (x >> some << (2 * (some - few)) | middle) << (3 * few) | low;
        OVERSIZED | (class as u32) << OVERSIZED_BITS | below(cell, &OVERSIZED_BITS)
    }

    /// Returns the cells of each class.
    ///
    /// They are about as long as the boxes on the axes on which these are oversized. On the others they have the shape
    /// of the cells of other boxes, and are as small as the bits allow.
    fn classes(&self) -> [Class; CLASSES] {
        std::array::from_fn(|class| {
            let steps = [class >> 4, class >> 2 & 3, class & 3];
            let own = [0, 1, 2].map(|a| match steps[a] {
                0 => bits_for(self.lengths[a] * self.cells.density[a]),
                k => bits_for(self.lengths[a] / self.steps[k - 1]).min(OVERSIZED_BITS / 3),
            });
            let short = steps.iter().filter(|&&s| s == 0).count().max(1) as i32;
            // Negative if some axes need more bits than are left.
            let finer = (OVERSIZED_BITS as i32 - own.iter().sum::<u32>() as i32).div_euclid(short);
            let bits = [0, 1, 2].map(|a| if steps[a] == 0 { own[a].saturating_add_signed(finer) } else { own[a] });
            let density = [0, 1, 2].map(|a| match steps[a] {
                0 => self.cells.density[a] * 2.0_f32.powi(finer),
                _ => ((1 << bits[a]) as f32 / self.lengths[a]).min(f32::MAX),
            });
            let mut axes = [0, 1, 2];
            axes.sort_by_key(|&a| std::cmp::Reverse(bits[a]));
            let [last_x, last_y, last_z] = bits.map(|b| ((1 << b) - 1) as f32);
            let cells =
                Cells { density: [density[0], density[1], density[2], 0.0], last: [last_x, last_y, last_z, 0.0] };
            Class { cells, axes, bits: axes.map(|a| bits[a]) }
        })
    }
}

/// Returns the edge of a cube with room for a leaf of boxes that are spread evenly over a range. The range counts as
/// flat on an axis on which it is shorter than that.
fn leaf_edge(mut lengths: [f32; 3], boxes: usize) -> f32 {
    lengths.sort_by(|a, b| b.total_cmp(a));
    let mut room = LANES as f64 / boxes.max(1) as f64;
    let mut edge = f32::INFINITY;
    for (axes, length) in (1..).zip(lengths) {
        room *= f64::from(length);
        let even = room.powf(1.0 / f64::from(axes)) as f32;
        if axes > 1 && even >= length {
            break;
        }
        edge = even;
    }
    edge
}

/// Returns the bits of a number below a ratio.
fn bits_for(ratio: f32) -> u32 {
    // The exponent of a float, which is 127 for 1.
    (ratio.to_bits() >> 23).saturating_sub(126)
}

/// Puts two zeros between any two of the lower ten bits.
#[inline]
fn spread3(v: u32) -> u32 {
    let v = (v | v << 16) & 0x0300_00ff;
    let v = (v | v << 8) & 0x0300_f00f;
    let v = (v | v << 4) & 0x030c_30c3;
    (v | v << 2) & 0x0924_9249
}

/// Puts a zero between any two of the lower 16 bits.
#[inline]
fn spread2(v: u32) -> u32 {
    let v = (v | v << 8) & 0x00ff_00ff;
    let v = (v | v << 4) & 0x0f0f_0f0f;
    let v = (v | v << 2) & 0x3333_3333;
    (v | v << 1) & 0x5555_5555
}

/// States of Hilbert's curve in space: 8 corners at which it enters a cube times 3 directions in which it crosses it.
const STATES: usize = 24;
/// Octants of octants of octants: the curve is looked up in three steps at once.
const LOOKED_UP: usize = 512;

/// For each state and the three steps of a Morton code: the three steps of the Hilbert code, and the next state above.
static HILBERT: [u16; STATES * LOOKED_UP] = {
    let mut table = [0; STATES * LOOKED_UP];
    let mut at = 0;
    while at < table.len() {
        let (mut state, mut code, mut shift) = (at / LOOKED_UP, 0, 9);
        while shift > 0 {
            shift -= 3;
            let (rank, next) = hilbert_step(state, at >> shift & 7);
            (code, state) = (code << 3 | rank, next);
        }
        table[at] = (state << 9 | code) as u16;
        at += 1;
    }
    table
};

/// Returns the rank of an octant on Hilbert's curve through a cube in this state, and the state in the octant.
///
/// After Hamilton, Compact Hilbert Indices (Dalhousie University, CS-2006-07): a state is three times the entry corner
/// plus the direction.
const fn hilbert_step(state: usize, octant: usize) -> (usize, usize) {
    const fn rotated(corner: usize, by: usize) -> usize {
        (corner << (by % 3) | corner >> (3 - by % 3)) & 7
    }
    let (entry, direction) = (state / 3, state % 3);
    let gray = rotated(octant ^ entry, 2 - direction);
    let rank = gray ^ gray >> 1 ^ gray >> 2;
    if rank == 0 {
        return (rank, entry * 3 + (direction + 1) % 3);
    }
    let even = (rank - 1) & !1;
    let turn =
        if rank.is_multiple_of(2) { (!(rank - 1)).trailing_zeros() } else { (!rank).trailing_zeros() } as usize % 3;
    (rank, (entry ^ rotated(even ^ even >> 1, direction + 1)) * 3 + (direction + 1 + turn) % 3)
}

/// Returns the number on Hilbert's curve of a cell with this Morton code.
#[inline]
fn hilbert(morton: u32) -> u32 {
    let (mut code, mut state) = (0, 0);
    for shift in [18, 9, 0] {
        let entry = u32::from(HILBERT[(state << 9 | morton >> shift & 511) as usize]);
        code = code << 9 | entry & 511;
        state = entry >> 9;
    }
    code
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
    /// What each task found in its part of a large dense cell.
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

    /// Sorts the members. Returns the number of boxes that may move; they come first.
    pub(super) fn sort(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        members: Members<'_>,
        curve: &Curve,
        filter: Option<&Filter>,
    ) -> Result<usize, Error> {
        self.len = members.len(boxes);
        ensure(&mut self.keys, self.len, "sort keys")?;
        let keys = &mut self.keys[..self.len];
        let invalid = AtomicUsize::new(usize::MAX);
        let key = |id: usize, b: &Aabb| {
            let (code, valid) = curve.code(b);
            if !valid {
                invalid.fetch_min(id, Relaxed);
            }
            let fixed = if filter.is_some_and(|f| f.is_fixed(id)) { FIXED } else { 0 };
            u64::from(code | fixed) << 32 | id as u64
        };
        match members {
            Members::From(first) => workers.map(&boxes[first..], keys, |k, b| key(first + k, b)),
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
        let Self { keys, len, scratch, large, small, spreads } = self;
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

/// Where the boxes of a dense cell lie, and how large they are.
#[derive(Debug, Clone, Copy)]
struct Spread {
    /// The bounds of their centres.
    centres: Aabb,
    /// The sum of their edges on each axis.
    edges: [f32; 3],
}

impl Spread {
    const NOTHING: Self = Self { centres: Aabb::new([MOST; 3], [-MOST; 3]), edges: [0.0; 3] };

    fn of(keys: &[u64], boxes: &[Aabb]) -> Self {
        keys.iter().fold(Self::NOTHING, |all, &key| {
            let b = &boxes[key as u32 as usize];
            let centre = centre(b);
            all.with(&Self { centres: Aabb::new(centre, centre), edges: [0, 1, 2].map(|a| b.max[a] - b.min[a]) })
        })
    }

    fn with(&self, other: &Self) -> Self {
        let edges = [0, 1, 2].map(|a| self.edges[a] + other.edges[a]);
        Self { centres: self.centres.union(&other.centres), edges }
    }
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
        let curve = Curve::over(&SceneStats::of(boxes), boxes.len());
        let moving = order.sort(&workers, boxes, Members::From(0), &curve, filter).unwrap();
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
    fn hilbert_steps_to_a_neighbour() {
        let mut cells: Vec<(u32, [u32; 3])> = (0..1 << 15)
            .map(|k| [k & 31, k >> 5 & 31, k >> 10])
            .map(|c| (hilbert(spread3(c[0]) | spread3(c[1]) << 1 | spread3(c[2]) << 2), c))
            .collect();
        cells.sort_unstable();
        for (k, two) in cells.windows(2).enumerate() {
            let apart: u32 = (0..3).map(|a| two[0].1[a].abs_diff(two[1].1[a])).sum();
            assert_eq!((two[0].0, apart), (k as u32, 1));
        }
    }

    #[test]
    fn cells_are_flat_where_boxes_are_and_cubes_where_space_is() {
        let curve = |extent, lengths| Curve::through([0.0; 3], lengths, extent, 1000);
        let per_edge = |c: &Curve| [0, 1, 2].map(|a| c.cells.density[a] / c.cells.density[0]);
        assert_eq!(per_edge(&curve([3.0; 3], [50.0, 100.0, 20.0])), [1.0; 3]);
        assert_eq!(per_edge(&curve([8.0, 8.0, 1.0], [100.0; 3])), [1.0, 1.0, 8.0]);
        assert_eq!(per_edge(&curve([8.0, 2.0, 0.0], [100.0; 3])), [1.0, 4.0, FLATTEST]);
        assert_eq!(per_edge(&curve([0.0; 3], [100.0, 0.0, 0.0])), [1.0; 3]);
        let line = curve([1.0; 3], [0.0, 0.0, 4096.0]);
        assert!(line.finest == 2 && line.cells.density[2] == 1.0 && !line.hilbert);
        assert_eq!(curve([1.0; 3], [0.0; 3]).cells.density, [0.0; 4]);
    }

    #[test]
    fn a_leaf_has_room_for_its_boxes() {
        assert!((leaf_edge([10.0; 3], 16) - 10.0).abs() < 1e-4);
        assert!((leaf_edge([100.0; 3], 16_000) - 10.0).abs() < 1e-4);
        assert!((leaf_edge([100.0, 2.0, 100.0], 1600) - 10.0).abs() < 1e-4);
        assert!((leaf_edge([0.0, 100.0, 0.0], 160) - 10.0).abs() < 1e-4);
        assert_eq!(leaf_edge([0.0; 3], 100), 0.0);
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
