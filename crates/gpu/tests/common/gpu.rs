//! Buffers on a GPU, for the tests of boxes that stay there.

use sapwise::Aabb;
use sapwise_gpu::{Gpu, wgpu30 as wgpu};

/// Uploads boxes to a new buffer.
pub(crate) fn upload(gpu: &Gpu, boxes: &[Aabb], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let size = (size_of_val(boxes) as u64).max(24);
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
    let buffer = gpu.device().create_buffer(&descriptor);
    let bytes: Vec<u8> = boxes.iter().flat_map(|b| [b.min, b.max]).flatten().flat_map(f32::to_le_bytes).collect();
    gpu.queue().write_buffer(&buffer, 0, &bytes);
    buffer
}
