//! The grid of strips: cells over the two axes across the sweep.

use super::scene_stats::SceneStats;
use crate::Aabb;

/// Mean number of boxes in a strip. Their columns take 28 bytes each: a strip fits the first-level cache, and there are
/// enough strips to reduce the candidates.
const BOXES_PER_STRIP: f64 = 256.0;

/// Most cells on one axis: strip numbers stay below 2^16, and a histogram of all strips fits the second-level cache.
const MOST_CELLS: f64 = 256.0;

/// Longest box across the sweep, in cells. A longer one is oversized: it would stand in too many strips.
const LARGE_CELLS: f64 = 4.0;

/// Longest box on the sweep axis, in usual lengths. A longer one is oversized: it would be a candidate for the whole
/// strip.
const LARGE_LENGTHS: f64 = 16.0;

/// Maps boxes to strips. All choices come from a sample: a bad one costs speed, never a pair.
#[derive(Debug, Clone, Copy, Default)]
pub struct StripGrid {
    /// The sweep axis.
    pub axis: usize,
    /// The two grid axes.
    across: [usize; 2],
    origin: [f32; 2],
    inverse_width: [f32; 2],
    /// The number of cells on the two grid axes.
    pub cells: [u32; 2],
    /// The number of the last cell on each grid axis.
    last: [f32; 2],
    /// Extents above which a box is oversized: on the sweep axis, then on the grid axes.
    large: [f32; 3],
}

/// The strips of a box, packed: the first strip, and the number of further cells on each grid axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StripSpan(u32);

impl StripSpan {
    /// No strip: the box is oversized.
    pub const APART: Self = Self(u32::MAX);
}

/// Most further cells on an axis that fit into a span.
const MOST_MORE: u32 = 0x7f;

impl StripGrid {
    /// Makes a grid for `objects` boxes with these statistics.
    pub fn plan(stats: &SceneStats, objects: usize) -> Self {
        let axis = stats.sweep_axis();
        let across = [(axis + 1) % 3, (axis + 2) % 3];
        let range = across.map(|a| stats.ranges[a]);
        let wanted = (objects as f64 / BOXES_PER_STRIP).max(1.0);
        // 1 for NaN too, of a world without length.
        let held = |cells: f64, most: f64| cells.max(1.0).min(most);
        // Narrower cells than twice the usual box save nothing: most boxes would stand in several.
        let most = [0, 1].map(|d| held(range[d].1 / (2.0 * stats.extent[across[d]]), MOST_CELLS));
        // Square cells. One axis gets the cells that the other can't use, as in a world that is flatter than a cell.
        let square = (range[0].1 * range[1].1 / wanted).sqrt();
        let second = held(wanted / held(range[0].1 / square, most[0]), most[1]);
        let counts = [held(wanted / second, most[0]), second];
        let mut grid = Self { axis, across, ..Self::default() };
        for d in 0..2 {
            let (low, length) = range[d];
            let cells = counts[d].floor();
            // In a world so small that the inverse width overflows, every box would cover every cell.
            let cells = if ((cells / length) as f32).is_finite() { cells } else { 1.0 };
            // One cell needs no width, and a flat axis has none.
            grid.cells[d] = cells as u32;
            grid.last[d] = cells as f32 - 1.0;
            grid.origin[d] = low as f32;
            grid.inverse_width[d] = if cells > 1.0 { (cells / length) as f32 } else { 0.0 };
            grid.large[1 + d] = if cells > 1.0 { (LARGE_CELLS * length / cells) as f32 } else { f32::INFINITY };
        }
        grid.large[0] = if grid.strips() > 1 { (LARGE_LENGTHS * stats.extent[axis]) as f32 } else { f32::INFINITY };
        grid
    }

    /// Returns the number of strips.
    pub fn strips(&self) -> usize {
        (self.cells[0] * self.cells[1]) as usize
    }

    /// Returns the first and the last cell of a box on each grid axis. Cell numbers stay below 2^16, which `f32`
    /// represents exactly.
    pub fn cells_of(&self, b: &Aabb) -> [(f32, f32); 2] {
        let bound =
            |d: usize, v: f32| ((v - self.origin[d]) * self.inverse_width[d]).max(0.0).min(self.last[d]).floor();
        [0, 1].map(|d| (bound(d, b.min[self.across[d]]), bound(d, b.max[self.across[d]])))
    }

    /// Returns the strips of a box.
    #[inline(always)]
    pub fn span(&self, b: &Aabb) -> StripSpan {
        let (axis, [u, v]) = (self.axis, self.across);
        let large = (b.max[axis] - b.min[axis] > self.large[0])
            | (b.max[u] - b.min[u] > self.large[1])
            | (b.max[v] - b.min[v] > self.large[2]);
        let bounds = [b.min[u], b.min[v], b.max[u], b.max[v]];
        let cell = |k: usize| (bounds[k] - self.origin[k % 2]) * self.inverse_width[k % 2];
        let [x, y, x1, y1] = cell_numbers([cell(0), cell(1), cell(2), cell(3)], self.last);
        let (more_x, more_y) = (x1 - x, y1 - y);
        // A box that is not oversized has few further cells, unless its bounds are so far out that cell numbers are
        // rounded.
        if large | (more_x | more_y > MOST_MORE) {
            return StripSpan::APART;
        }
        StripSpan((y * self.cells[0] + x) | more_x << 16 | more_y << 24)
    }

    /// Calls `f` for each strip of a span, with a mask: bit d is set if the strip is the first of this box on grid axis
    /// d.
    ///
    /// On each grid axis, two boxes that share several strips first meet in the cell in which the later of them begins.
    /// So exactly one strip has both bits set in either box: it reports the pair.
    #[inline(always)]
    pub fn each_strip(&self, span: StripSpan, mut f: impl FnMut(usize, u32)) {
        let StripSpan(packed) = span;
        let first = (packed & 0xffff) as usize;
        if packed <= 0xffff {
            // One strip, as for most boxes.
            return f(first, 3);
        }
        if span == StripSpan::APART {
            return;
        }
        let row = self.cells[0] as usize;
        for y in 0..=(packed >> 24) as usize {
            for x in 0..=(packed >> 16 & 0xff) as usize {
                f(first + y * row + x, u32::from(x == 0) | u32::from(y == 0) << 1);
            }
        }
    }
}

/// Returns four cell numbers along two alternating axes: `cells` clamped to 0 and `last`, NaN to 0, without fractions.
///
/// The function is monotonic, which alone makes the strips correct. Bounds outside the grid go to the cells at its
/// border.
#[inline(always)]
fn cell_numbers(cells: [f32; 4], last: [f32; 2]) -> [u32; 4] {
    let mut at = [0.0_f32; 4];
    for k in 0..4 {
        // Comparisons in this order send NaN to 0, and compilers make vectors of them.
        let last = if last[k % 2] < 65_535.0 { last[k % 2] } else { 65_535.0 };
        let cell = if cells[k] > 0.0 { cells[k] } else { 0.0 };
        at[k] = if cell < last { cell } else { last };
    }
    // SAFETY: no value is NaN or above 65 535; `max` excludes values below 0.
    at.map(|cell| unsafe { cell.max(0.0).to_int_unchecked::<i32>() } as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(boxes: &[Aabb]) -> StripGrid {
        StripGrid::plan(&SceneStats::of(boxes), boxes.len())
    }

    /// Returns the cell of a bound on a grid axis, by the definition.
    fn cell(grid: &StripGrid, d: usize, bound: f32) -> u32 {
        // The cast saturates and sends NaN to 0.
        (((bound - grid.origin[d]) * grid.inverse_width[d]) as u32).min(grid.cells[d] - 1)
    }

    /// Returns the cells of a span and the mask in each.
    fn strips(grid: &StripGrid, span: StripSpan) -> Vec<([u32; 2], u32)> {
        let mut strips = Vec::new();
        let row = grid.cells[0];
        grid.each_strip(span, |strip, begins| strips.push(([strip as u32 % row, strip as u32 / row], begins)));
        strips
    }

    #[test]
    fn cells_ascend_with_bounds() {
        let boxes: Vec<Aabb> = (0..10_000)
            .map(|k| Aabb::cube([(k % 100) as f32 * 4.0, (k / 100) as f32, (k * 7 % 100) as f32], 0.5))
            .collect();
        let grid = grid(&boxes);
        assert_eq!(grid.axis, 0);
        assert!(grid.strips() > 20, "{grid:?}");
        let bounds = [f32::NEG_INFINITY, -1.0e30, -5.0, 0.0, 13.0, 50.0, 99.0, 1.0e30, f32::INFINITY];
        let cells = bounds.map(|b| cell(&grid, 0, b));
        assert!(cells.is_sorted(), "{cells:?}");
        assert_eq!((cells[0], cells[8]), (0, grid.cells[0] - 1));
        for low in bounds {
            for high in bounds.into_iter().filter(|&h| h >= low) {
                let b = Aabb::new([1.0, low, low * 0.5], [2.0, high, high * 0.5]);
                let span = grid.span(&b);
                let strips = strips(&grid, span);
                let cells = [0, 1].map(|d| cell(&grid, d, b.min[1 + d])..=cell(&grid, d, b.max[1 + d]));
                let [columns, rows] = &cells;
                let expected = rows.clone().flat_map(|y| columns.clone().map(move |x| [x, y]));
                let first = |d: usize, at: u32| u32::from(at == *cells[d].start()) << d;
                let expected: Vec<_> = expected.map(|at| (at, first(0, at[0]) | first(1, at[1]))).collect();
                assert!(span == StripSpan::APART || strips == expected, "{b:?}: {strips:?}");
            }
        }
    }

    #[test]
    fn degenerate_scenes_get_one_strip() {
        let tiny =
            (0..5000).map(|k| Aabb::cube([(k % 7) as f32 * 1e-39, (k % 11) as f32 * 1e-39, k as f32 * 1e-39], 0.0));
        let point = vec![Aabb::default(); 5000];
        for boxes in [vec![], point, vec![Aabb::cube([f32::INFINITY; 3], 1.0); 5000], tiny.collect()] {
            assert_eq!(grid(&boxes).strips(), 1);
        }
    }

    #[test]
    fn flat_world_is_cut_on_its_other_axis() {
        let flat: Vec<Aabb> =
            (0..10_000).map(|k| Aabb::cube([(k % 1000) as f32, (k / 1000) as f32 * 9.0, 0.0], 0.1)).collect();
        assert!((10..60).contains(&grid(&flat).strips()), "{:?}", grid(&flat));
    }

    #[test]
    fn strip_where_the_later_box_begins_reports_the_pair() {
        let grid = StripGrid { cells: [5, 5], ..StripGrid::default() };
        let span = |x: u32, y: u32, more_x: u32, more_y: u32| {
            strips(&grid, StripSpan((y * 5 + x) | more_x << 16 | more_y << 24))
        };
        let (a, b) = (span(1, 2, 2, 1), span(2, 1, 0, 2));
        let shared = a
            .iter()
            .flat_map(|&(at, begins)| b.iter().filter(move |(other, _)| *other == at).map(move |o| (at, begins | o.1)));
        let owners: Vec<[u32; 2]> = shared.filter(|&(_, begins)| begins == 3).map(|(at, _)| at).collect();
        assert_eq!(owners, [[2, 2]]);
    }
}
