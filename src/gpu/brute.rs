//! Every box against every other; see `shaders/brute.wgsl`.

use super::device::Gpu;
use super::inputs::Inputs;
use super::kernel::{Bound, Kernel, source};
use super::output::Output;
use crate::error::GpuError;

/// Boxes of a tile.
const TILE: u32 = 128;

/// The method on one GPU.
#[derive(Debug)]
pub(super) struct Brute {
    count: Kernel,
    write: Kernel,
    bound: Option<[Bound; 2]>,
}

impl Brute {
    /// The kernel numbers tile pairs in 32 bits.
    pub(super) const MOST_OBJECTS: usize = 1 << 22;

    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            count: Kernel::new(gpu, source::BRUTE, "count")?,
            write: Kernel::new(gpu, source::BRUTE, "write")?,
            bound: None,
        })
    }

    /// Tile pairs of a frame, which takes as many submissions as there are bands of [`band`](Self::band) tile pairs.
    pub(super) fn blocks(objects: u32) -> u64 {
        let tiles = u64::from(objects.div_ceil(TILE));
        tiles * (tiles + 1) / 2
    }

    /// Tile pairs of one submission, at most: with as many tests as the other methods have in one, see [`params`](super::params).
    pub(super) const BAND: u32 = 1 << 16;

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
