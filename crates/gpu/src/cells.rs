//! Counting sort by cell, which also makes the table of the begins of the cells; see `shaders/cells.wgsl`.

use super::kernel::source;
use super::params::CELLS_OF_BLOCK;
use super::{Bound, Gpu, Kernel, Params, Storage};
use sapwise::error::GpuError;

/// Boxes of one workgroup.
const BOXES: u32 = 256;

/// The kernels and buffers of the sort.
#[derive(Debug)]
pub(super) struct Cells {
    add_up: Kernel,
    begin: Kernel,
    put: Kernel,
    /// Cell and reach of each box, in the order of the input. The caller fills them.
    pub(super) keys: Storage,
    /// Rank of each box in its cell. The caller fills them.
    pub(super) ranks: Storage,
    /// Old position of each sorted box.
    pub(super) order: Storage,
    /// Cells of the sorted boxes, which `gather_cells` fills.
    pub(super) sorted_keys: Storage,
    /// Counts of the cells, which the caller fills, then the beginnings of the cells.
    pub(super) table: Storage,
    sums: Storage,
    bound: Option<[Bound; 3]>,
}

impl Cells {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            add_up: Kernel::new(gpu, source::CELLS, "add_up")?,
            begin: Kernel::new(gpu, source::CELLS, "begin")?,
            put: Kernel::new(gpu, source::CELLS, "put")?,
            keys: Storage::new(gpu, "cells of boxes")?,
            ranks: Storage::new(gpu, "ranks in cells")?,
            order: Storage::new(gpu, "order of boxes")?,
            sorted_keys: Storage::new(gpu, "cells in order")?,
            table: Storage::new(gpu, "where cells begin")?,
            sums: Storage::new(gpu, "sums of cells")?,
            bound: None,
        })
    }

    /// Makes room for a frame. Returns whether a buffer was replaced.
    pub(super) fn ensure(&mut self, gpu: &Gpu, params: &Params) -> Result<bool, GpuError> {
        let n = u64::from(params.objects);
        let mut grown = self.keys.ensure(gpu, n * 8)?;
        for list in [&mut self.ranks, &mut self.order, &mut self.sorted_keys] {
            grown |= list.ensure(gpu, n * 4)?;
        }
        // The number of cells is about that of the boxes. It changes with the scene, which must not replace the buffer
        // each time.
        let usual = (params.objects + params.objects / 4).div_ceil(CELLS_OF_BLOCK) + 1;
        let blocks = u64::from(params.cell_blocks.max(usual));
        grown |= self.table.ensure(gpu, blocks * u64::from(CELLS_OF_BLOCK) * 4)?;
        Ok(self.sums.ensure(gpu, blocks * 4)? | grown)
    }

    pub(super) fn bind(&mut self, gpu: &Gpu, params: &wgpu::Buffer) -> Result<(), GpuError> {
        let (table, sums) = (self.table.buffer(), self.sums.buffer());
        let (keys, ranks, order) = (self.keys.buffer(), self.ranks.buffer(), self.order.buffer());
        self.bound = Some([
            self.add_up.bind(gpu, &[(0, params), (1, table), (2, sums)])?,
            self.begin.bind(gpu, &[(0, params), (1, table), (2, sums)])?,
            self.put.bind(gpu, &[(0, params), (3, table), (4, keys), (5, ranks), (6, order)])?,
        ]);
        Ok(())
    }

    /// Clears the counts, before the keys are written.
    pub(super) fn clear(&self, encoder: &mut wgpu::CommandEncoder, params: &Params) {
        let bytes = u64::from(params.cell_blocks) * u64::from(CELLS_OF_BLOCK) * 4;
        encoder.clear_buffer(self.table.buffer(), 0, Some(bytes));
    }

    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>, params: &Params) {
        let Some([add_up, begin, put]) = &self.bound else { return };
        // `begin` reads the sums of the blocks before its own.
        if params.cell_blocks > 1 {
            add_up.dispatch(pass, params.cell_blocks);
        }
        begin.dispatch(pass, params.cell_blocks);
        put.dispatch(pass, params.objects.div_ceil(BOXES));
    }
}
