//! A space-filling curve that knows the shapes of boxes.

use super::codes::{hilbert, spread2, spread3};
use crate::cpu::LANES;
#[cfg(target_arch = "x86_64")]
use crate::cpu::kernel::corners;
use crate::{Aabb, SceneStats};
use std::sync::OnceLock;

/// Bits of a cell's number on each axis, and on the axis with the most cells.
const BITS: u32 = 9;
const MOST_BITS: u32 = 12;

/// The bit of a code that marks an oversized box. Behind it stands the class, then the cell of an oversized box, which
/// has this many bits. The bit above is free.
const OVERSIZED: u32 = 1 << 30;
const OVERSIZED_BITS: u32 = 24;

/// Steps by which oversized edges are told apart on each axis, and the least ratio of two of them.
const STEPS: usize = 3;
const CLASSES: usize = 64;

/// The first class of each shape. The bits of a shape are the axes on which boxes are oversized, so a shape with k
/// bits has 3^k classes.
const SHAPES: [u32; 8] = [0, 1, 4, 7, 16, 19, 28, 37];
const LEAST_STEP: f32 = 4.0;

/// A cell is at most this many times as long on one axis as on another.
const FLATTEST: f32 = 64.0;

/// Along a range this many times as long as on both other axes the order of the curve is that of the range.
const LINE: f32 = 64.0;

/// Coordinates are clamped to this, so that the distance of two is finite.
const MOST: f32 = 1.0e38;

/// A curve through the cells of a range in space.
///
/// A leaf that holds neighbours on the curve has the shape of a few cells, and it meets the fewest boxes if that is
/// the shape of its boxes (minimise the product over the axes of leaf plus box, at a fixed volume of the leaf). So
/// cells are flat if boxes are. A box longer than a leaf should be would widen the leaf, so each shape of oversized
/// boxes has a curve of its own, with few cells on the axes on which they are long. Extended Morton codes (Vinkler,
/// Bittner and Havran, HPG 2017) interleave sizes and positions to the same end.
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

impl Cells {
    /// Makes cells whose numbers have this many bits on each axis.
    fn new([x, y, z]: [f32; 3], bits: [u32; 3]) -> Self {
        // Numbers of cells are converted from `f32` to signed 32 bits; finer cells would separate no more boxes.
        let [last_x, last_y, last_z] = bits.map(|b| ((1_u32 << b.min(30)) - 1) as f32);
        Self { density: [x, y, z, 0.0], last: [last_x, last_y, last_z, 0.0] }
    }
}

impl Curve {
    /// Makes a curve for this many boxes through the range of most of them.
    pub(super) fn over(stats: &SceneStats, boxes: usize) -> Self {
        let ranges = stats.ranges;
        Self::through(ranges.map(|r| r.0 as f32), ranges.map(|r| r.1 as f32), stats.extent.map(|e| e as f32), boxes)
    }

    /// Makes a curve through a dense cell. `None` if all centres are the same.
    pub(super) fn within(cell: &Spread, boxes: usize) -> Option<Self> {
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
        let bits = [0, 1, 2].map(|a| if a == finest { MOST_BITS } else { BITS });
        Self {
            origin: [x, y, z, 0.0],
            cells: Cells::new(density, bits),
            finest,
            hilbert: most < LINE * second,
            lengths,
            steps: [usual, usual * step, usual * step * step],
            classes: OnceLock::new(),
        }
    }

    /// Replaces the codes of these keys by those along this curve.
    pub(super) fn recode(&self, keys: &mut [u64], boxes: &[Aabb]) {
        for key in keys {
            let id = *key as u32;
            *key = u64::from(self.code(&boxes[id as usize]).0) << 32 | u64::from(id);
        }
    }

    /// Returns the code of a box, and whether the box is valid.
    ///
    /// The cell of a box is that of its centre. Outside the range that is the nearest cell on its surface.
    #[inline(always)]
    pub(super) fn code(&self, b: &Aabb) -> (u32, bool) {
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
        let [[low], [high]] = corners(b);
        // SAFETY: SSE2 is part of x86-64. The loads read, and the stores write, arrays of four values.
        unsafe {
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

    /// Returns the axes on which the boxes with this code are oversized, one bit each. Codes ascend with this number.
    pub(super) fn long_axes(code: u32) -> u32 {
        let class = code >> OVERSIZED_BITS & (CLASSES as u32 - 1);
        if code & OVERSIZED == 0 { 0 } else { SHAPES.partition_point(|&first| first <= class) as u32 - 1 }
    }

    /// Returns the code of an oversized box: its class, then its cell. The axis with the most cells comes first.
    #[cold]
    fn oversized(&self, b: &Aabb, edges: [f32; 3]) -> u32 {
        let steps = edges.map(|edge| self.steps.iter().filter(|&&step| edge > step).count());
        let index = steps[0] << 4 | steps[1] << 2 | steps[2];
        let long = (0..3).filter(|&a| steps[a] > 0);
        let (shape, class) = long.fold((0, 0), |(shape, class), a| (shape | 1 << a, 3 * class + steps[a] as u32 - 1));
        let class = SHAPES[shape] + class;
        let Class { cells, axes, bits: [_, some, few] } = &self.classes.get_or_init(|| self.classes())[index];
        let cell = self.place(b, cells).0;
        let [x, y, z] = axes.map(|a| cell[a]);
        let below = |v: u32, bits: &u32| v & ((1 << bits) - 1);
        let low = spread3(below(x, few)) | spread3(below(y, few)) << 1 | spread3(below(z, few)) << 2;
        let middle = spread2(below(x, some) >> few) | spread2(below(y, some) >> few) << 1;
        let cell = (x >> some << (2 * (some - few)) | middle) << (3 * few) | low;
        OVERSIZED | class << OVERSIZED_BITS | below(cell, &OVERSIZED_BITS)
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
            Class { cells: Cells::new(density, bits), axes, bits: axes.map(|a| bits[a]) }
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

/// The bounds and the sizes of the boxes of a dense cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    /// The bounds of their centres.
    centres: Aabb,
    /// The sum of their edges on each axis.
    edges: [f32; 3],
}

impl Spread {
    pub(super) const NOTHING: Self = Self { centres: Aabb::new([MOST; 3], [-MOST; 3]), edges: [0.0; 3] };

    pub(super) fn of(keys: &[u64], boxes: &[Aabb]) -> Self {
        keys.iter().fold(Self::NOTHING, |all, &key| {
            let b = &boxes[key as u32 as usize];
            let centre = centre(b);
            all.with(&Self { centres: Aabb::new(centre, centre), edges: [0, 1, 2].map(|a| b.max[a] - b.min[a]) })
        })
    }

    pub(super) fn with(&self, other: &Self) -> Self {
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
    fn codes_ascend_by_shape_and_tell_classes_apart() {
        let curve = Curve::through([0.0; 3], [100.0; 3], [1.0; 3], 1000);
        let [a, b, c] = curve.steps.map(|step| step * 1.5);
        let mut classes = Vec::new();
        for class in 1..CLASSES {
            let edges = [class >> 4, class >> 2 & 3, class & 3].map(|k| [0.1, a, b, c][k]);
            let (code, _) = curve.code(&Aabb::new([50.0; 3], edges.map(|edge| 50.0 + edge)));
            let long = (0..3).fold(0, |long, a| long | u32::from(edges[a] > 1.0) << a);
            assert_eq!(Curve::long_axes(code), long, "{class}");
            classes.push((long, code >> OVERSIZED_BITS));
        }
        classes.sort_unstable();
        assert!(classes.is_sorted_by(|(_, a), (_, b)| a < b));
        assert_eq!(Curve::long_axes(curve.code(&Aabb::cube([50.0; 3], 0.5)).0), 0);
    }

    #[test]
    fn a_leaf_has_room_for_its_boxes() {
        assert!((leaf_edge([10.0; 3], 16) - 10.0).abs() < 1e-4);
        assert!((leaf_edge([100.0; 3], 16_000) - 10.0).abs() < 1e-4);
        assert!((leaf_edge([100.0, 2.0, 100.0], 1600) - 10.0).abs() < 1e-4);
        assert!((leaf_edge([0.0, 100.0, 0.0], 160) - 10.0).abs() < 1e-4);
        assert_eq!(leaf_edge([0.0; 3], 100), 0.0);
    }
}
