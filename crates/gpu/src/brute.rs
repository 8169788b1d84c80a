//! Every box against every other; see `shaders/brute.wgsl`.

use super::kernel::source;
use super::{Gpu, Inputs, Look, Output, Pairing, Params, Search};
use sapwise::error::GpuError;

/// Boxes of a tile.
const TILE: u32 = 128;

/// The method on one GPU. Its blocks are pairs of tiles.
#[derive(Debug)]
pub(super) struct Brute {
    pairing: Pairing,
}

impl Brute {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self { pairing: Pairing::new(gpu, source::BRUTE)? })
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

    /// Limits the tests of one submission to those of the other methods; see [`params`](super::params).
    fn most_blocks(&self) -> u32 {
        1 << 16
    }

    fn bind(&mut self, gpu: &Gpu, inputs: &Inputs<'_>, output: &Output) -> Result<(), GpuError> {
        self.pairing.bind(gpu, inputs, output, &[(1, inputs.boxes), (2, inputs.ids)])
    }

    fn pairing(&self) -> &Pairing {
        &self.pairing
    }
}
