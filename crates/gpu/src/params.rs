//! The parameters of a frame, as the kernels see them.

use super::Look;
use super::division::{PARTS, Segment};
use super::tree::raises;
use sapwise::error::BoxDefect;
use sapwise::internals::StripGrid;

/// `Params` of `shaders/common.wgsl`, field by field.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Params {
    pub(super) objects: u32,
    pub(super) piece: u32,
    pub(super) axis: u32,
    pub(super) capacity: u32,
    pub(super) first: u32,
    pub(super) blocks: u32,
    pub(super) window: u32,
    pub(super) slots: u32,
    pub(super) cells: [u32; 2],
    pub(super) large_key: u32,
    pub(super) longest: f32,
    pub(super) submission: u32,
    pub(super) round: u32,
    pub(super) budget: u32,
    pub(super) top: u32,
    pub(super) curve_shift: u32,
    pub(super) cell_blocks: u32,
    pub(super) usual: f32,
    pub(super) passes: u32,
    pub(super) curve_bits: u32,
    pub(super) members: u32,
    pub(super) unused: [u32; 2],
    pub(super) curve: [[Segment; PARTS]; 3],
    pub(super) grid: [[Segment; PARTS]; 3],
}

/// `Header` of `shaders/common.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Header {
    pub(super) total_low: u32,
    pub(super) total_high: u32,
    pub(super) invalid: u32,
    pub(super) more: u32,
    pub(super) ran: u32,
    pub(super) groups: [u32; 3],
    pub(super) held: u32,
}

impl Header {
    /// The header before any kernel has run.
    pub(super) const START: Self =
        Self { total_low: 0, total_high: 0, invalid: u32::MAX, more: 0, ran: 0, groups: [0, 1, 1], held: 0 };

    pub(super) fn total(&self) -> u64 {
        u64::from(self.total_high) << 32 | u64::from(self.total_low)
    }

    /// Returns the position of the first invalid box, and its defect.
    pub(super) fn invalid(&self) -> Option<(usize, BoxDefect)> {
        let defect = if self.invalid & 1 == 1 { BoxDefect::Inverted } else { BoxDefect::NotANumber };
        (self.invalid != u32::MAX).then_some(((self.invalid >> 1) as usize, defect))
    }
}

/// Cells of one workgroup of `shaders/cells.wgsl`.
pub(super) const CELLS_OF_BLOCK: u32 = 4096;

/// Most slots of all strips. Their table then takes a small part of the memory of a frame of 2^24 boxes.
const MOST_SLOTS: f64 = 16_777_216.0;

/// A box goes into the tree if it is longer on the sweep axis than this many usual boxes: it would search the whole
/// strip.
const LARGE_LENGTHS: f64 = 16.0;

/// Most tests against candidates and nodes while the rows of one submission are counted. Writing may repeat them. An
/// integrated GPU is assumed to make 10^10 tests a second, so these take a tenth of a second; drivers of desktops give
/// up after 2 to 10 s.
const MOST_TESTS: u32 = 1 << 30;

/// Most tests of one row in a submission. lavapipe ends a loop after 65 535 turns.
const MOST_OF_ROW: u32 = 1 << 15;
/// Fewest tests of one row in a submission, so that a frame ends. From a million rows on, this exceeds `MOST_TESTS`.
const FEWEST_OF_ROW: u32 = 1 << 10;

/// Cells of the curve's grid on one axis, and in the extent of a usual box.
const CURVE_CELLS: f64 = 1024.0;
const CELLS_OF_BOX: f64 = 2.0;

/// Bits of a key for the size of the box, and those beyond the ones that would number the boxes: two more, because
/// cells have unequal numbers of boxes.
const SIZE_BITS: u32 = 2;
const BITS_BEYOND: u32 = SIZE_BITS + 2;

/// Bits of a digit of the radix sort, and passes that sort 32 bits.
const DIGIT_BITS: u32 = 8;
pub(super) const MOST_PASSES: u32 = 4;

impl Params {
    /// Parameters of rows that are swept along an axis.
    fn rows(look: &Look, objects: u32, axis: usize) -> Self {
        let turned = [axis, (axis + 1) % 3, (axis + 2) % 3];
        let longest = look.sample.extent.iter().copied().fold(0.0, f64::max);
        // If most boxes are points, the usual extent is a small part of the world.
        let world = look.sample.ranges.map(|r| r.1).into_iter().fold(0.0, f64::max) / f64::from(objects.max(1)).cbrt();
        let usual = (1.0 / longest.max(world / 8.0)) as f32;
        let curve =
            turned.map(|a| look.parts[a].divide(|width, share| curve_cells(width, share, look.sample.extent[a])));
        Self {
            objects,
            axis: axis as u32,
            budget: (MOST_TESTS / objects.max(1)).clamp(FEWEST_OF_ROW, MOST_OF_ROW),
            top: 3 * raises(objects),
            usual: if usual.is_finite() { usual } else { 1.0 },
            curve_bits: 3 * curve.map(|axis| axis.cells.next_power_of_two().ilog2()).into_iter().max().unwrap_or(0),
            curve: curve.map(|axis| axis.segments),
            ..Self::default()
        }
    }

    /// Sweeps along the axis on which the fewest pairs of the sample overlap.
    pub(super) fn sap(look: &Look, objects: u32) -> Self {
        Self { passes: MOST_PASSES, ..Self::rows(look, objects, look.sample.sweep_axis()) }
    }

    /// Makes a tree over the boxes in the order of the curve.
    pub(super) fn bvh(look: &Look, objects: u32) -> Self {
        let rows = Self::rows(look, objects, 0);
        let bits = rows.curve_bits + SIZE_BITS;
        let passes = bits.min(objects.max(2).ilog2() + BITS_BEYOND).div_ceil(DIGIT_BITS);
        Self { passes, curve_shift: bits.saturating_sub(passes * DIGIT_BITS), ..rows }
    }

    /// Divides space into strips with about as many slots as boxes. A bad choice costs speed, never a pair.
    pub(super) fn grid_sap(look: &Look, objects: u32) -> Self {
        let sample = &look.sample;
        let plan = StripGrid::plan(sample, objects as usize);
        let [a, u, v] = [0, 1, 2].map(|k| (plan.axis + k) % 3);
        let across = |axis: usize, cells: u32| {
            // As in the plan, cells at least two boxes wide: in narrower ones most boxes would be in several.
            look.parts[axis]
                .divide(|width, share| (share * f64::from(cells)).round().min(width / (2.0 * sample.extent[axis])))
        };
        let [cells_u, cells_v] = plan.cells;
        let (across_u, across_v) = (across(u, cells_u), across(v, cells_v));
        let strips = f64::from(across_u.cells) * f64::from(across_v.cells);
        let wanted = (f64::from(objects) / strips).ceil().min((MOST_SLOTS / strips).floor());
        let along = look.parts[a].divide(|_, share| share * wanted);
        let (slots, strips) = (along.cells, across_u.cells * across_v.cells);
        let large_key = strips * slots;
        let rows = Self::rows(look, objects, a);
        // Oversized boxes are few: they get one cell for every eight boxes.
        let curve_bits = (objects.max(2).ilog2() - 1).saturating_sub(2).clamp(5, 16);
        let table = large_key + (1 << curve_bits) + 1;
        Self {
            slots,
            cells: [across_u.cells, across_v.cells],
            large_key,
            longest: (LARGE_LENGTHS * sample.extent[a]) as f32,
            grid: [along.segments, across_u.segments, across_v.segments],
            curve_shift: (rows.curve_bits + SIZE_BITS).saturating_sub(curve_bits),
            cell_blocks: table.div_ceil(CELLS_OF_BLOCK),
            ..rows
        }
    }
}

/// Returns the cells of the curve's grid in a part of an axis. They follow the part's share of the boxes, so a cluster
/// keeps its cells in a world a million times its size. No cell is much shorter than a usual box: otherwise tiny
/// offsets across a tower would weigh the same as the place along it.
fn curve_cells(width: f64, share: f64, extent: f64) -> f64 {
    (width * CELLS_OF_BOX / extent).min(share * (CURVE_CELLS - PARTS as f64))
}
