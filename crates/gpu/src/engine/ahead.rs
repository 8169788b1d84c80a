//! Frames that nobody waits for. Boxes, pairs and their number stay on the GPU; the host hears of them in a later
//! frame.

use super::{Engine, Pending, Step};
use crate::{Header, Look, Params};
use bytemuck::bytes_of;
use sapwise::error::{GpuError, GpuErrorKind};

impl Engine {
    /// Submits a frame of boxes that are on the GPU.
    pub(crate) fn submit_ahead(&mut self, boxes: &wgpu::Buffer, mut params: Params) -> Result<(), GpuError> {
        if self.search.blocks(params.objects) > u64::from(self.search.most_blocks()) {
            let text = format!(
                "brute takes several submissions for {} boxes, and waits between them: use bvh",
                params.objects
            );
            return Err(GpuError::new(GpuErrorKind::Limit, text));
        }
        self.prepare(&params, false, Some(boxes))?;
        self.number(&mut params);
        let mut encoder = self.gpu.record();
        self.set(&params);
        self.gpu.queue().write_buffer(self.header.buffer(), 0, bytes_of(&Header::START));
        self.record(&mut encoder, &params, Step::Sort);
        if matches!(self.pending, Pending::Ahead(_)) {
            // The GPU is behind, and its last answer still on its way.
            self.gpu.submit(encoder)?;
        } else {
            self.submit_and_download(encoder, 0)?;
            self.pending = Pending::Ahead(params.submission);
        }
        Ok(())
    }

    /// Returns the header and the sample of a frame that was submitted ahead, if they have arrived.
    pub(crate) fn arrived(&mut self) -> Result<Option<(Header, Look)>, GpuError> {
        let Pending::Ahead(submission) = self.pending else { return Ok(None) };
        if !self.download.arrived(&self.gpu)? {
            if !self.download.is_on_its_way() {
                // It could not be mapped, and will never arrive.
                self.pending = Pending::Nothing;
            }
            return Ok(None);
        }
        self.pending = Pending::Nothing;
        let header = self.downloaded(submission)?;
        self.expected = header.total();
        Ok(Some((header, Look::at(&self.sampled()?))))
    }

    /// Submits a frame without boxes.
    pub(crate) fn submit_nothing(&self) -> Result<(), GpuError> {
        let encoder = self.gpu.record();
        self.gpu.queue().write_buffer(self.header.buffer(), 0, bytes_of(&Header::START));
        self.gpu.submit(encoder).map(drop)
    }
}
