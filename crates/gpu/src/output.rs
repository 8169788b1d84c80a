//! The counts of the pairs of each block, their positions, and the list of pairs.

use super::kernel::source;
use super::{Bound, Gpu, Kernel, Storage, largest};
use sapwise::error::GpuError;

/// Counts that `positions` reads at once.
const COUNTS: u64 = 4096;

/// Bytes of a pair.
pub(super) const PAIR: u64 = 8;

/// The buffers of counts and pairs, and the kernel that turns counts into positions; see `shaders/scan.wgsl`.
#[derive(Debug)]
pub(super) struct Output {
    positions: Kernel,
    sums: Storage,
    pairs: Storage,
    bound: Option<Bound>,
}

impl Output {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            positions: Kernel::new(gpu, source::SCAN, "positions")?,
            sums: Storage::new(gpu, "counts of pairs")?,
            pairs: Storage::new(gpu, "pairs")?,
            bound: None,
        })
    }

    /// Makes room for the counts of `blocks` blocks. Returns whether the buffer was replaced.
    pub(super) fn ensure_blocks(&mut self, gpu: &Gpu, blocks: u32) -> Result<bool, GpuError> {
        self.sums.ensure(gpu, (u64::from(blocks) + 1).next_multiple_of(COUNTS) * 4)
    }

    /// Makes room for `pairs` pairs, at most for those that the GPU allows in one buffer. Returns whether the buffer
    /// was replaced.
    pub(super) fn ensure_pairs(&mut self, gpu: &Gpu, pairs: u64) -> Result<bool, GpuError> {
        let most = largest(gpu, wgpu::BufferUsages::STORAGE) / PAIR * PAIR;
        self.pairs.ensure(gpu, (pairs * PAIR).min(most))
    }

    /// As [`ensure_pairs`](Self::ensure_pairs), but the old list lives on if someone else holds it.
    pub(super) fn enlarge_pairs(&mut self, gpu: &Gpu, pairs: u64) -> Result<bool, GpuError> {
        let pairs = pairs.min(largest(gpu, wgpu::BufferUsages::STORAGE) / PAIR);
        let grows = pairs > u64::from(self.capacity());
        if grows {
            self.replace_pairs(gpu, pairs)?;
        }
        Ok(grows)
    }

    /// Replaces the list by one for `pairs` pairs. The old list lives on if someone else holds it.
    ///
    /// # Errors
    /// As [`Storage::replace`].
    pub(super) fn replace_pairs(&mut self, gpu: &Gpu, pairs: u64) -> Result<(), GpuError> {
        self.pairs.replace(gpu, pairs * PAIR)
    }

    /// Returns how many pairs the list has room for.
    pub(super) fn capacity(&self) -> u32 {
        u32::try_from(self.pairs.bytes() / PAIR).unwrap_or(u32::MAX)
    }

    pub(super) fn sums(&self) -> &wgpu::Buffer {
        self.sums.buffer()
    }

    pub(super) fn pairs(&self) -> &wgpu::Buffer {
        self.pairs.buffer()
    }

    pub(super) fn bind(&mut self, gpu: &Gpu, params: &wgpu::Buffer, header: &wgpu::Buffer) -> Result<(), GpuError> {
        self.bound = Some(self.positions.bind(gpu, &[(0, params), (3, header), (4, self.sums.buffer())])?);
        Ok(())
    }

    /// Clears the counts of `blocks` blocks.
    pub(super) fn clear(&self, encoder: &mut wgpu::CommandEncoder, blocks: u32) {
        encoder.clear_buffer(self.sums.buffer(), 0, Some(u64::from(blocks) * 4));
    }

    /// Turns the counts into positions.
    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>) {
        if let Some(bound) = &self.bound {
            bound.dispatch(pass, 1);
        }
    }
}
