//! Every box against every other; see `shaders/brute.wgsl`.

use super::device::Gpu;
use super::kernel::{Bound, Kernel, source};
use super::look::Look;
use super::output::Output;
use super::params::Params;
use super::search::{Inputs, Search};
use sapwise::error::GpuError;

/// Boxes of a tile.
const TILE: u32 = 128;

/// The method on one GPU. Its blocks are pairs of tiles.
#[derive(Debug)]
pub(super) struct Brute {
    count: Kernel,
    write: Kernel,
    bound: Option<[Bound; 2]>,
}

impl Brute {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            count: Kernel::new(gpu, source::BRUTE, "count")?,
            write: Kernel::new(gpu, source::BRUTE, "write")?,
            bound: None,
        })
    }
}

impl Search for Brute {
    fn most_objects(&self) -> usize {
        // The kernel numbers tile pairs in 32 bits.
        1 << 22
    }

    fn growth(&self) -> f64 {
        2.0
    }

    fn plan(&self, objects: u32, _: &dyn Fn() -> Look) -> Params {
        Params { objects, ..Params::default() }
    }

    fn blocks(&self, objects: u32) -> u64 {
        let tiles = u64::from(objects.div_ceil(TILE));
        tiles * (tiles + 1) / 2
    }

    /// As many tests in one submission as the other methods have; see [`params`](super::params).
    fn most_blocks(&self) -> u32 {
        1 << 16
    }

    fn bind(&mut self, gpu: &Gpu, inputs: &Inputs<'_>, output: &Output) -> Result<(), GpuError> {
        let common = [(0, inputs.params), (1, inputs.boxes), (2, inputs.ids)];
        let count = [common.as_slice(), &[(3, inputs.header), (4, output.sums())]].concat();
        let write = [common.as_slice(), &[(4, output.sums()), (5, output.pairs())]].concat();
        self.bound = Some([self.count.bind(gpu, &count)?, self.write.bind(gpu, &write)?]);
        Ok(())
    }

    fn record_count(&self, pass: &mut wgpu::ComputePass<'_>, params: &Params) {
        if let Some([count, _]) = &self.bound {
            count.dispatch(pass, params.blocks);
        }
    }

    fn record_write(&self, pass: &mut wgpu::ComputePass<'_>, params: &Params) {
        if let Some([_, write]) = &self.bound {
            write.dispatch(pass, params.blocks);
        }
    }
}
