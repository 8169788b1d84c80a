//! Every box against every other; see `shaders/brute.wgsl`.

use super::device::Gpu;
use super::inputs::Inputs;
use super::kernel::{Bound, Kernel, source};
use super::output::Output;
use crate::error::GpuError;
use crate::hardware::GpuKind;

/// Boxes of a tile.
const TILE: u32 = 128;

/// Tile pairs of one submission. A driver of a desktop gives up on one that takes seconds; these take tens of milliseconds
/// on a GPU of two hundred thousand million tests a second, and seconds on a software adapter.
const MOST_TILE_PAIRS: u32 = 1 << 19;
const MOST_TILE_PAIRS_SOFTWARE: u32 = 1 << 17;

/// The method on one GPU.
#[derive(Debug)]
pub(super) struct Brute {
    count: Kernel,
    write: Kernel,
    bound: Option<[Bound; 2]>,
    most: u32,
}

impl Brute {
    /// The kernel numbers tile pairs in 32 bits.
    pub(super) const MOST_OBJECTS: usize = 1 << 22;

    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let software = gpu.identity().kind == GpuKind::Software;
        Ok(Self {
            count: Kernel::new(gpu, source::BRUTE, "count")?,
            write: Kernel::new(gpu, source::BRUTE, "write")?,
            bound: None,
            most: if software { MOST_TILE_PAIRS_SOFTWARE } else { MOST_TILE_PAIRS },
        })
    }

    /// Tile pairs of a frame, which takes as many submissions as there are bands of [`band`](Self::band) tile pairs.
    pub(super) fn blocks(objects: u32) -> u64 {
        let tiles = u64::from(objects.div_ceil(TILE));
        tiles * (tiles + 1) / 2
    }

    /// Tile pairs of one submission, at most.
    pub(super) fn band(&self) -> u32 {
        self.most
    }

    pub(super) fn bind(&mut self, gpu: &Gpu, inputs: &Inputs<'_>, output: &Output) -> Result<(), GpuError> {
        let common = [(0, inputs.params), (1, inputs.boxes), (2, inputs.ids)];
        let count = [common.as_slice(), &[(3, inputs.header), (4, output.sums())]].concat();
        let write = [common.as_slice(), &[(4, output.sums()), (5, output.pairs())]].concat();
        self.bound = Some([self.count.bind(gpu, &count)?, self.write.bind(gpu, &write)?]);
        Ok(())
    }

    pub(super) fn record_count(&self, pass: &mut wgpu::ComputePass<'_>, blocks: u32) {
        if let Some([count, _]) = &self.bound {
            count.dispatch(pass, blocks);
        }
    }

    pub(super) fn record_write(&self, pass: &mut wgpu::ComputePass<'_>, blocks: u32) {
        if let Some([_, write]) = &self.bound {
            write.dispatch(pass, blocks);
        }
    }
}
