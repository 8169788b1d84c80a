//! The parameters of a frame, as the kernels see them.

use crate::load::{Sample, StripGrid};

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
    pub(super) longest: u32,
    pub(super) origin: [f32; 4],
    pub(super) inverse: [f32; 4],
}

/// `Header` of `shaders/common.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Header {
    pub(super) total_low: u32,
    pub(super) total_high: u32,
    pub(super) invalid: u32,
    pub(super) more: u32,
}

impl Header {
    /// Before any kernel has run.
    pub(super) const START: Self = Self { total_low: 0, total_high: 0, invalid: u32::MAX, more: 0 };

    pub(super) fn total(&self) -> u64 {
        u64::from(self.total_high) << 32 | u64::from(self.total_low)
    }

    /// Position of the first invalid box, and whether it is inverted rather than not a number.
    pub(super) fn invalid(&self) -> Option<(usize, bool)> {
        (self.invalid != u32::MAX).then_some(((self.invalid >> 1) as usize, self.invalid & 1 == 1))
    }
}

/// Most slots in all, so that their table stays a small share of the memory of a frame of as many boxes.
const MOST_SLOTS: f64 = 16_777_216.0;

/// A box longer on the sweep axis than this many times the usual length is kept apart: it would search all the strip.
const LARGE_LENGTHS: f64 = 16.0;

impl Params {
    /// Sweeping along the axis on which the fewest pairs of a sample overlap.
    pub(super) fn sap(sample: &Sample, objects: u32) -> Self {
        Self { objects, axis: sample.sweep_axis() as u32, ..Self::default() }
    }

    /// Strips for boxes that look like the sample, with about as many slots as there are boxes. All choices cost speed at
    /// worst, never a pair.
    pub(super) fn grid_sap(sample: &Sample, objects: u32) -> Self {
        let grid = StripGrid::plan(sample, objects as usize);
        let a = grid.axis;
        let strips = grid.strips() as f64;
        let (low, length) = sample.range(a);
        let slots = (f64::from(objects) / strips).ceil().clamp(1.0, (MOST_SLOTS / strips).floor());
        // A world so small that the inverse of a slot overflows would put every box into every slot.
        let slots = if ((slots / length) as f32).is_finite() { slots } else { 1.0 };
        let per_length = if slots > 1.0 { slots / length } else { 0.0 };
        let (cells, origin, inverse) = grid.across_sweep();
        Self {
            objects,
            axis: a as u32,
            slots: slots as u32,
            cells,
            large_key: (strips * slots) as u32,
            longest: (LARGE_LENGTHS * sample.extent[a] * per_length).clamp(16.0, MOST_SLOTS) as u32,
            origin: [low as f32, origin[0], origin[1], 0.0],
            inverse: [per_length as f32, inverse[0], inverse[1], 0.0],
            ..Self::default()
        }
    }

    /// Bits of the largest sort key.
    pub(super) fn key_bits(&self) -> u32 {
        u32::BITS - self.large_key.leading_zeros()
    }
}
