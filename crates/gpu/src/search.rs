//! The interface between an engine and a method.

use super::{Gpu, Look, Output, Pairing, Params};
use sapwise::error::GpuError;
use std::fmt::Debug;

/// A method on one GPU: its kernels, and the buffers that no other method has.
///
/// A frame is counted block by block, the counts become positions ([`Output`]), and the pairs are written there.
pub(super) trait Search: Debug + Send + Sync {
    /// Returns the most boxes of a frame that the kernels can number.
    fn most_objects(&self) -> usize;

    /// Returns the power of the number of boxes with which the work grows.
    fn growth(&self) -> f64;

    /// Returns the parameters of a frame. Calls `look` only if the method depends on where the boxes are.
    fn plan(&self, objects: u32, look: &dyn Fn() -> Look) -> Params;

    /// Returns the blocks that a frame has in all. Each has a count of its pairs.
    fn blocks(&self, objects: u32) -> u64;

    /// Returns the most blocks of one submission.
    fn most_blocks(&self) -> u32 {
        u32::MAX
    }

    /// Makes room for a frame. Returns whether a buffer was replaced.
    fn ensure(&mut self, gpu: &Gpu, params: &Params) -> Result<bool, GpuError> {
        let _ = (gpu, params);
        Ok(false)
    }

    /// Binds the kernels to the buffers.
    fn bind(&mut self, gpu: &Gpu, inputs: &Inputs<'_>, output: &Output) -> Result<(), GpuError>;

    /// Clears the counters of the sort. Comes first in a frame.
    fn clear(&self, encoder: &mut wgpu::CommandEncoder, params: &Params) {
        let _ = (encoder, params);
    }

    /// Sorts the boxes, once a frame.
    fn record_sort(&self, pass: &mut wgpu::ComputePass<'_>, params: &Params) {
        let _ = (pass, params);
    }

    /// Returns the kernels that count and write the pairs.
    fn pairing(&self) -> &Pairing;
}

/// The buffers that every method reads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inputs<'a> {
    pub(super) params: &'a wgpu::Buffer,
    pub(super) boxes: &'a wgpu::Buffer,
    pub(super) ids: &'a wgpu::Buffer,
    pub(super) header: &'a wgpu::Buffer,
    /// `None` if there is no filter.
    pub(super) memberships: Option<&'a wgpu::Buffer>,
}
