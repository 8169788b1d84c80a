//! A sample of boxes that are on the GPU; see `shaders/sample.wgsl`.

use super::kernel::source;
use super::{Bound, Gpu, Kernel, Storage};
use sapwise::Aabb;
use sapwise::error::GpuError;

/// Bytes of a sample: 256 boxes.
pub(super) const BYTES: u64 = 256 * size_of::<Aabb>() as u64;

/// The kernel, and the buffer for the sampled boxes.
#[derive(Debug)]
pub(super) struct Sampler {
    kernel: Kernel,
    boxes: Storage,
    bound: Option<Bound>,
}

impl Sampler {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let mut boxes = Storage::new(gpu, "sample")?;
        boxes.ensure(gpu, BYTES)?;
        Ok(Self { kernel: Kernel::new(gpu, source::SAMPLE, "sample")?, boxes, bound: None })
    }

    pub(super) fn bind(&mut self, gpu: &Gpu, params: &wgpu::Buffer, boxes: &wgpu::Buffer) -> Result<(), GpuError> {
        self.bound = Some(self.kernel.bind(gpu, &[(0, params), (1, boxes), (4, self.boxes.buffer())])?);
        Ok(())
    }

    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>) {
        if let Some(bound) = &self.bound {
            bound.dispatch(pass, 1);
        }
    }

    /// Copies the sample to `to` from byte `at` on. Returns its bytes.
    pub(super) fn copy(&self, encoder: &mut wgpu::CommandEncoder, to: &wgpu::Buffer, at: u64) -> u64 {
        encoder.copy_buffer_to_buffer(self.boxes.buffer(), 0, to, at, BYTES);
        BYTES
    }
}
