//! Frames that nobody waits for: boxes, pairs and their number stay on the GPU, and the CPU hears of them in a later frame.

use super::{Engine, PAIRS_AT, Search, Step};
use crate::error::{GpuError, GpuErrorKind};
use crate::gpu::look::Look;
use crate::gpu::params::{Header, Params};
use crate::gpu::sampler;
use bytemuck::bytes_of;

impl Engine {
    /// Submits a frame of boxes that are on the GPU, and leaves nothing to finish.
    pub(in crate::gpu) fn submit_ahead(&mut self, boxes: &wgpu::Buffer, mut params: Params) -> Result<(), GpuError> {
        let (blocks, tile_pairs_left) = self.search.blocks(params.objects);
        if tile_pairs_left > 0 {
            let text = format!(
                "brute takes several submissions for {} boxes, and waits between them: use bvh",
                params.objects
            );
            return Err(GpuError::new(GpuErrorKind::Limit, text));
        }
        self.prepare(&params, false, Some(boxes))?;
        (params.blocks, params.capacity) = (blocks, self.output.capacity());
        params.submission = self.next_submission();
        let mut encoder = self.gpu.record();
        self.set(&params);
        self.gpu.queue().write_buffer(self.header.buffer(), 0, bytes_of(&Header::START));
        if let Search::Sorted(sorted) = &self.search {
            sorted.clear(&mut encoder, &params);
        }
        self.record(&mut encoder, &params, Step::Sort);
        if self.unread.is_some() {
            // The GPU is behind, and so is what the CPU knows of it.
            self.gpu.submit(encoder)?;
        } else {
            self.copy_back(&mut encoder, 0);
            self.submit_mapped(encoder, PAIRS_AT + sampler::BYTES)?;
            self.unread = Some(params.submission);
        }
        Ok(())
    }

    /// What a frame left that nobody waited for, once it has come back.
    pub(in crate::gpu) fn arrived(&mut self) -> Result<Option<(Header, Look)>, GpuError> {
        let Some(submission) = self.unread else { return Ok(None) };
        if !self.download.arrived(&self.gpu)? {
            // What could not be mapped never comes.
            self.unread = self.unread.filter(|_| self.download.is_on_its_way());
            return Ok(None);
        }
        self.unread = None;
        let header = self.downloaded(submission)?;
        self.expected = header.total();
        Ok(Some((header, self.seen()?)))
    }

    /// What the kernels write beside the pairs, for those on the GPU who read them.
    pub(in crate::gpu) fn header_buffer(&self) -> &wgpu::Buffer {
        self.header.buffer()
    }

    /// A frame without boxes.
    pub(in crate::gpu) fn submit_nothing(&self) -> Result<(), GpuError> {
        let encoder = self.gpu.record();
        self.gpu.queue().write_buffer(self.header.buffer(), 0, bytes_of(&Header::START));
        self.gpu.submit(encoder).map(drop)
    }
}
