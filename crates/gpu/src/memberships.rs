//! The filter on pairs, on a GPU; see `shaders/filter.wgsl`.

use super::{Gpu, Storage};
use sapwise::Filter;
use sapwise::error::GpuError;

/// Memberships uploaded at once: a megabyte.
const TOGETHER: usize = 1 << 16;

#[derive(Debug)]
pub(super) struct Memberships {
    storage: Storage,
    /// Number of memberships; `None` if the kernels test none.
    pub(super) count: Option<u32>,
    words: Vec<[u32; 4]>,
}

impl Memberships {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self { storage: Storage::new(gpu, "memberships")?, count: None, words: Vec::new() })
    }

    /// Uploads a filter, or lifts it. Returns whether the kernels must be bound again.
    ///
    /// # Errors
    /// As [`Storage::ensure`]; the filter is lifted then.
    pub(super) fn set(&mut self, gpu: &Gpu, filter: Option<&Filter>) -> Result<bool, GpuError> {
        let before = self.count.take();
        let Some(Filter { memberships }) = filter else { return Ok(before.is_some()) };
        let grown = self.storage.ensure(gpu, size_of_val(memberships.as_slice()) as u64)?;
        for (k, chunk) in memberships.chunks(TOGETHER).enumerate() {
            self.words.clear();
            self.words.extend(chunk.iter().map(|m| [m.groups, m.mask, m.owner, u32::from(m.fixed)]));
            let (at, words) = ((k * TOGETHER * 16) as u64, bytemuck::cast_slice(&self.words));
            gpu.try_make(|_| gpu.queue().write_buffer(self.storage.buffer(), at, words))?;
        }
        self.count = Some(memberships.len() as u32);
        Ok(grown || before.is_none())
    }

    /// Returns the buffer that kernels test, if they do.
    pub(super) fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.count.map(|_| self.storage.buffer())
    }
}
