//! Buffers on a GPU, for the tests of boxes and pairs that stay there.

use sapwise::Aabb;
use sapwise_gpu::{Gpu, wgpu30 as wgpu};

/// Uploads boxes to a new buffer.
pub(crate) fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    boxes: &[Aabb],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let size = (size_of_val(boxes) as u64).max(24);
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
    let buffer = device.create_buffer(&descriptor);
    let bytes: Vec<u8> = boxes.iter().flat_map(|b| [b.min, b.max]).flatten().flat_map(f32::to_le_bytes).collect();
    queue.write_buffer(&buffer, 0, &bytes);
    buffer
}

/// Returns the first words of a buffer.
pub(crate) fn words(gpu: &Gpu, from: &wgpu::Buffer, count: u64) -> Vec<u32> {
    if count == 0 {
        return Vec::new();
    }
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let descriptor = wgpu::BufferDescriptor { label: None, size: count * 4, usage, mapped_at_creation: false };
    let copy = gpu.device().create_buffer(&descriptor);
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(from, 0, &copy, 0, count * 4);
    let submission = gpu.queue().submit([encoder.finish()]);
    copy.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.wait(submission).unwrap();
    let view = copy.get_mapped_range(..).unwrap();
    view.chunks(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}
