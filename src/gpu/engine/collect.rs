//! What an engine does once a frame was submitted: waiting, bringing pairs home, going on where one submission was too few.

use super::{Engine, Frame, PAIRS_AT, Search, Step};
use crate::error::{Error, GpuError};
use crate::gpu::look::Look;
use crate::gpu::output::PAIR;
use crate::gpu::params::{Header, Params};
use crate::gpu::storage::Failure;
use crate::pairs::Pairs;
use std::mem::offset_of;

impl Engine {
    /// Waits for what was started and adds its pairs to the list.
    pub(in crate::gpu) fn finish(&mut self, pairs: &mut Pairs) -> Result<(), Failure> {
        let mut all = 0;
        let mut next = self.frame.take();
        while let Some(mut frame) = next.take() {
            let header = self.header_of(&frame)?;
            let total = header.total();
            all += total;
            if pairs.is_too_small_for(total) {
                // More than the caller wants: they stay where they are.
                pairs.exceed();
            } else {
                self.fetch(&mut frame, total, pairs)?;
            }
            if pairs.is_over() {
                break;
            }
            if frame.tile_pairs_left > 0 || header.more != 0 {
                next = Some(self.go_on(frame, 0)?);
            }
        }
        self.expected = all;
        Ok(())
    }

    /// Waits for what was started and returns the number of pairs, all of which are in [`pairs_buffer`](Self::pairs_buffer), and
    /// what the boxes look like.
    pub(in crate::gpu) fn finish_resident(&mut self) -> Result<(u32, Look), Failure> {
        let mut all = 0_u64;
        let mut look = None;
        let mut next = self.frame.take();
        while let Some(mut frame) = next.take() {
            let header = self.header_of(&frame)?;
            // A sample is taken with the first submission of a frame; every one brings the same back.
            look = Some(look.map_or_else(|| self.seen(), Ok)?);
            let before = all;
            all += header.total();
            if all > u64::from(u32::MAX) {
                let reason = format!("{all} pairs are more than the 2^32 that gpu{} can number", self.index());
                return Err(Failure::limit(reason));
            }
            if all > u64::from(self.output.capacity()) {
                self.make_room_for_pairs(&mut frame, all, before)?;
                self.rewrite(&frame.params)?;
            }
            if frame.tile_pairs_left > 0 || header.more != 0 {
                // The pairs of the next submission stand behind those of this one: a window that begins below zero, modulo 2^32.
                next = Some(self.go_on(frame, (all as u32).wrapping_neg())?);
            }
        }
        self.expected = all;
        Ok((all as u32, look.unwrap_or_default()))
    }

    /// A larger list of pairs that begins with the first `kept` of this one.
    fn make_room_for_pairs(&mut self, frame: &mut Frame, total: u64, kept: u64) -> Result<(), Failure> {
        let before = self.output.pairs().clone();
        // Whatever fails from here on, nothing goes on with the list of before.
        let boxes = self.bound_to.take();
        self.output.replace_pairs(&self.gpu, total)?;
        if kept > 0 {
            let mut encoder = self.gpu.record();
            encoder.copy_buffer_to_buffer(&before, 0, self.output.pairs(), 0, kept * PAIR);
            let submission = self.gpu.submit(encoder)?;
            self.gpu.wait(submission)?;
        }
        if let Some(boxes) = boxes {
            self.bind(&boxes)?;
        }
        frame.params.capacity = self.output.capacity();
        Ok(())
    }

    /// The list of pairs of the frame before.
    pub(in crate::gpu) fn pairs_buffer(&self) -> &wgpu::Buffer {
        self.output.pairs()
    }

    fn index(&self) -> u32 {
        self.gpu.identity().index
    }

    /// Waits for a frame and reads its header.
    fn header_of(&self, frame: &Frame) -> Result<Header, Failure> {
        self.gpu.wait(frame.submission.clone())?;
        let header = self.downloaded(frame.params.submission)?;
        match header.invalid() {
            Some((index, defect)) => Err(Error::InvalidBox { index, defect }.into()),
            None => Ok(header),
        }
    }

    /// The header of the submission of this number, which has come back.
    pub(super) fn downloaded(&self, submission: u32) -> Result<Header, GpuError> {
        let view = self.download.readable(&self.gpu, 0..PAIRS_AT)?;
        let header: Header = bytemuck::pod_read_unaligned(&view[..size_of::<Header>()]);
        drop(view);
        self.check_ran(&header, submission)?;
        Ok(header)
    }

    /// Brings `total` pairs into the list: those that came with the header, then the rest in as many steps as it takes.
    fn fetch(&mut self, frame: &mut Frame, total: u64, pairs: &mut Pairs) -> Result<(), Failure> {
        let mut have = total.min(frame.sent).min(u64::from(frame.params.capacity));
        self.append(have, pairs)?;
        if have == total {
            return Ok(());
        }
        if total > u64::from(u32::MAX) {
            let reason = format!("{total} pairs are more than the 2^32 that gpu{} can number", self.index());
            return Err(Failure::limit(format!("{reason}; set a limit on the pairs, and no filter")));
        }
        self.download.ensure(&self.gpu, PAIRS_AT + total.min(self.downloadable()) * PAIR)?;
        if total > u64::from(self.output.capacity()) {
            self.grow(frame, total)?;
            self.rewrite(&frame.params)?;
        }
        while have < total {
            let Params { window, capacity, .. } = frame.params;
            let end = u64::from(window) + u64::from(capacity);
            if have == end {
                frame.params.window = have as u32;
                frame.params.capacity = capacity.min(u32::MAX - frame.params.window);
                self.rewrite(&frame.params)?;
                continue;
            }
            let count = (total.min(end) - have).min((self.download.bytes() - PAIRS_AT) / PAIR);
            let mut encoder = self.gpu.record();
            let from = (have - u64::from(window)) * PAIR;
            encoder.copy_buffer_to_buffer(self.output.pairs(), from, self.download.buffer(), PAIRS_AT, count * PAIR);
            let submission = self.submit_mapped(encoder, PAIRS_AT + count * PAIR)?;
            self.gpu.wait(submission)?;
            self.append(count, pairs)?;
            have += count;
        }
        Ok(())
    }

    /// A larger list of pairs, if the GPU has one.
    fn grow(&mut self, frame: &mut Frame, total: u64) -> Result<(), GpuError> {
        let Some(boxes) = self.bound_to.clone() else { return Ok(()) };
        if self.output.ensure_pairs(&self.gpu, total)? {
            self.bind(&boxes)?;
        }
        frame.params.capacity = self.output.capacity();
        Ok(())
    }

    /// Writes the window of `params` into the list of pairs. Nothing is counted again.
    fn rewrite(&self, params: &Params) -> Result<(), GpuError> {
        let mut encoder = self.gpu.record();
        self.set(params);
        self.record(&mut encoder, params, Step::Write);
        let submission = self.gpu.submit(encoder)?;
        self.gpu.wait(submission)
    }

    /// Sets the parameters without the upload: this allocates, but frames that come here are rare.
    pub(super) fn set(&self, params: &Params) {
        self.gpu.queue().write_buffer(self.params.buffer(), 0, bytemuck::bytes_of(params));
    }

    /// Goes on with the tile pairs, or the candidates of rows, that are left. `window`: where the pairs that are wanted begin.
    fn go_on(&mut self, frame: Frame, window: u32) -> Result<Frame, GpuError> {
        let mut params = frame.params;
        match &self.search {
            Search::Brute(_) => {
                params.first += params.blocks;
                params.blocks = frame.tile_pairs_left.min(u64::from(params.blocks)) as u32;
            }
            Search::Sorted(_) => params.round += 1,
        }
        params.submission = self.next_submission();
        params.window = window;
        params.capacity = self.output.capacity();
        let mut encoder = self.gpu.record();
        self.set(&params);
        for field in [offset_of!(Header, total_low), offset_of!(Header, total_high), offset_of!(Header, more)] {
            encoder.clear_buffer(self.header.buffer(), field as u64, Some(4));
        }
        self.record(&mut encoder, &params, Step::Count);
        let sent = if self.sampler.is_none() { self.sendable() } else { 0 };
        self.copy_back(&mut encoder, sent);
        let submission = self.submit_mapped(encoder, PAIRS_AT + (sent * PAIR).max(self.sample_bytes()))?;
        let tile_pairs_left = frame.tile_pairs_left.saturating_sub(u64::from(params.blocks));
        Ok(Frame { submission, params, sent, tile_pairs_left })
    }

    /// Adds the first `count` pairs of the download to the list.
    fn append(&self, count: u64, pairs: &mut Pairs) -> Result<(), Failure> {
        if count > 0 {
            let view = self.download.readable(&self.gpu, PAIRS_AT..PAIRS_AT + count * PAIR)?;
            let list: &[[u32; 2]] = bytemuck::cast_slice(&view);
            pairs.extend(list)?;
        }
        Ok(())
    }
}
