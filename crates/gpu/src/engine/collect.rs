//! Waiting for a frame, downloading its pairs, and going on if one submission was not enough.

use super::{Engine, Frame, PAIRS_AT, Pending, Step};
use crate::{Failure, Header, PAIR, Params, Place};
use sapwise::error::GpuError;
use sapwise::internals::{SampledBoxes, Workers};
use sapwise::{Error, Pairs};
use std::mem::{offset_of, take};
use std::time::Duration;

/// Time for which a wait polls before it sleeps. A thread that slept is woken some 50 µs late, and submits the next
/// frame more slowly.
const POLLED: Duration = Duration::from_millis(1);

impl Engine {
    /// Waits for the frame, and adds its pairs to the list.
    pub(crate) async fn finish(&mut self, pairs: &mut Pairs, workers: &Workers) -> Result<(), Failure> {
        let mut all = 0;
        while let Pending::Frame(mut frame) = take(&mut self.pending) {
            let header = self.header_of(&frame).await?;
            let total = header.total();
            all += total;
            if pairs.is_too_small_for(total, self.memberships.count.is_some()) {
                // More than the caller wants: they stay on the GPU.
                pairs.exceed();
            } else {
                self.fetch(&mut frame, total, pairs, workers).await?;
            }
            if pairs.is_over() {
                break;
            }
            self.go_on(frame, &header, 0)?;
        }
        // Pairs over the limit were not stored, and there may be no memory for them.
        if !pairs.is_over() {
            self.expected = all;
        }
        Ok(())
    }

    /// Waits for the frame. Returns the number of pairs, all of which are in [`Output::pairs`](crate::Output),
    /// and a sample of the boxes.
    pub(crate) async fn finish_resident(&mut self) -> Result<(u32, SampledBoxes), Failure> {
        let mut all = 0_u64;
        let mut sample = None;
        while let Pending::Frame(mut frame) = take(&mut self.pending) {
            let header = self.header_of(&frame).await?;
            // Every submission of a frame has the same sample.
            sample = Some(sample.map_or_else(|| self.sampled(), Ok)?);
            let before = all;
            all += header.total();
            if all > u64::from(u32::MAX) {
                return Err(self.too_many(all, ""));
            }
            if all > u64::from(self.output.capacity()) {
                self.make_room_for_pairs(&mut frame, all, before)?;
                self.rewrite(&frame.params)?;
            }
            // The pairs of the next submission follow those of this one: a window that begins below zero, modulo 2^32.
            self.go_on(frame, &header, (all as u32).wrapping_neg())?;
        }
        self.expected = all;
        Ok((all as u32, sample.unwrap_or_else(|| SampledBoxes::given(&[]))))
    }

    /// Replaces the list of pairs by a larger one with the same first `kept` pairs.
    fn make_room_for_pairs(&mut self, frame: &mut Frame, total: u64, kept: u64) -> Result<(), Failure> {
        let before = self.output.pairs().clone();
        // If anything fails from here on, nothing goes on with the previous list.
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

    fn too_many(&self, pairs: u64, hint: &str) -> Failure {
        let index = self.gpu.identity().index;
        Failure::limit(format!("{pairs} pairs are more than the 2^32 that gpu{index} can number{hint}"))
    }

    /// Waits for a frame and returns its header.
    async fn header_of(&self, frame: &Frame) -> Result<Header, Failure> {
        if !self.download.arrives_within(&self.gpu, POLLED)? {
            self.download.wait(&self.gpu, Some(frame.submission.clone())).await?;
        }
        self.gpu.ends("waiting", Place::Host);
        let header = self.downloaded(frame.params.submission)?;
        match header.invalid() {
            Some((index, defect)) => Err(Error::InvalidBox { index, defect }.into()),
            None => Ok(header),
        }
    }

    /// Returns the header of a submission that has arrived.
    ///
    /// # Errors
    /// The header has the number of another submission: no kernel ran, and the buffers hold what an earlier frame
    /// left. A GPU that hangs or a driver without hardware does that, and is lost from then on.
    pub(super) fn downloaded(&self, submission: u32) -> Result<Header, GpuError> {
        let view = self.download.readable(&self.gpu, 0..PAIRS_AT)?;
        let header: Header = bytemuck::pod_read_unaligned(&view[..size_of::<Header>()]);
        if header.ran == submission { Ok(header) } else { Err(self.gpu.inert()) }
    }

    /// Adds `total` pairs to the list: those that came with the header, then the others in further downloads.
    async fn fetch(
        &mut self,
        frame: &mut Frame,
        total: u64,
        pairs: &mut Pairs,
        workers: &Workers,
    ) -> Result<(), Failure> {
        let mut have = total.min(frame.sent).min(u64::from(frame.params.capacity));
        self.append(have, pairs, workers)?;
        if have == total {
            return Ok(());
        }
        if total > u64::from(u32::MAX) {
            return Err(self.too_many(total, "; set a limit on the pairs"));
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
            self.download.wait(&self.gpu, Some(submission)).await?;
            self.append(count, pairs, workers)?;
            have += count;
        }
        Ok(())
    }

    /// Makes the list of pairs as large as the GPU allows, up to `total`. Its content is lost.
    fn grow(&mut self, frame: &mut Frame, total: u64) -> Result<(), GpuError> {
        let Some(boxes) = self.bound_to.clone() else { return Ok(()) };
        if self.output.ensure_pairs(&self.gpu, total)? {
            self.bind(&boxes)?;
        }
        frame.params.capacity = self.output.capacity();
        Ok(())
    }

    /// Writes the pairs of the window again. They are not counted again.
    fn rewrite(&self, params: &Params) -> Result<(), GpuError> {
        let mut encoder = self.gpu.record();
        self.set(params);
        self.record(&mut encoder, params, Step::Write);
        let submission = self.gpu.submit(encoder)?;
        self.gpu.wait(submission)
    }

    /// Sets the parameters without the upload. This allocates.
    pub(super) fn set(&self, params: &Params) {
        self.gpu.queue().write_buffer(self.params.buffer(), 0, bytemuck::bytes_of(params));
    }

    /// Submits the blocks, or the candidates of rows, that are left, if there are any. `window`: position of the
    /// first pair to write.
    fn go_on(&mut self, frame: Frame, header: &Header, window: u32) -> Result<(), GpuError> {
        let Frame { mut params, mut blocks_left, .. } = frame;
        if blocks_left > 0 {
            params.first += params.blocks;
            params.blocks = blocks_left.min(u64::from(params.blocks)) as u32;
            blocks_left -= u64::from(params.blocks);
        } else if header.more != 0 {
            params.round += 1;
        } else {
            return Ok(());
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
        let sent = self.sendable();
        let submission = self.submit_and_download(encoder, sent)?;
        self.pending = Pending::Frame(Frame { submission, params, sent, blocks_left });
        Ok(())
    }

    /// Adds the first `count` pairs of the download to the list.
    fn append(&self, count: u64, pairs: &mut Pairs, workers: &Workers) -> Result<(), Failure> {
        if count > 0 {
            let view = self.download.readable(&self.gpu, PAIRS_AT..PAIRS_AT + count * PAIR)?;
            let list: &[[u32; 2]] = bytemuck::cast_slice(&view);
            pairs.extend(list, workers, self.memberships.count.is_some())?;
            self.gpu.ends("reading out", Place::Host);
        }
        Ok(())
    }
}
