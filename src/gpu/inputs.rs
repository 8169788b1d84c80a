//! What every method on a GPU reads.

/// The buffers that every method reads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inputs<'a> {
    pub(super) params: &'a wgpu::Buffer,
    pub(super) boxes: &'a wgpu::Buffer,
    pub(super) ids: &'a wgpu::Buffer,
    pub(super) header: &'a wgpu::Buffer,
}
