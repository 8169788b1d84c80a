//! One method on one GPU. A frame is planned, submitted and collected, in one of three ways:
//!
//! | boxes | pairs | submit | collect |
//! |---|---|---|---|
//! | on the host | on the host | `start` | `finish` waits |
//! | on the GPU | on the GPU; the host gets their number | `start_resident` | `finish_resident` waits |
//! | on the GPU | on the GPU | `submit_ahead` | `arrived`, in a later frame, does not wait |

mod ahead;
mod collect;
#[cfg(test)]
mod tests;

use super::brute::Brute;
use super::memberships::Memberships;
use super::sampler::{self, Sampler};
use super::sorted::{Kind, MOST_OF_BOX, Sorted};
use super::transfer::{Transfer, copy};
use super::{Failure, Gpu, Header, Inputs, Look, Output, PAIR, Params, Place, Recording, Search, Storage, largest};
use bytemuck::{bytes_of, cast_slice};
use sapwise::algorithm::FramePlan;
use sapwise::error::{GpuError, GpuErrorKind};
use sapwise::internals::{FilterState, SampledBoxes, Workers};
use sapwise::{Aabb, Filter, Pairs};
use std::sync::OnceLock;

/// Bytes of a box.
const BOX: u64 = size_of::<Aabb>() as u64;
/// Offsets in the upload: the parameters come first, and the numbers of the boxes follow the boxes. Copies begin at
/// multiples of 8.
const HEADER_AT: u64 = 1792;
const BOXES_AT: u64 = 2048;
/// Offset of the pairs, or of the sample, in the download. The header comes first.
const PAIRS_AT: u64 = 48;
/// Most bytes of pairs in one download.
const MOST_DOWNLOAD: u64 = 64 << 20;
/// Pairs that are downloaded with the header beyond the number of the previous frame. If there are more, a second
/// submission downloads them.
const SPARE_PAIRS: u64 = 256;

/// A method on a GPU with all its buffers.
#[derive(Debug)]
pub(super) struct Engine {
    pub(super) gpu: Gpu,
    pub(super) search: Box<dyn Search>,
    home: Home,
    /// With the list of pairs of the previous frame.
    pub(super) output: Output,
    params: Storage,
    /// The [`Header`], which the program's kernels may read.
    pub(super) header: Storage,
    boxes: Storage,
    ids: Storage,
    memberships: Memberships,
    /// The filter of the last list of pairs.
    filter: FilterState,
    upload: Transfer,
    download: Transfer,
    /// The buffer of boxes that the kernels are bound to; `None` if they must be bound again.
    bound_to: Option<wgpu::Buffer>,
    /// Pairs of the previous frame.
    expected: u64,
    /// Number of the last submission that counted.
    submissions: u32,
    pending: Pending,
}

/// Where boxes and pairs are.
#[derive(Debug)]
enum Home {
    Host,
    /// The host plans a frame by a sample of the previous one.
    Device(Sampler),
}

/// The submission for which the download waits.
#[derive(Debug, Default)]
#[expect(clippy::large_enum_variant, reason = "there is one for each engine")]
enum Pending {
    #[default]
    Nothing,
    /// A frame that the caller will wait for.
    Frame(Frame),
    /// The header of the submission with this number, for which nobody waits.
    Ahead(u32),
}

/// The parts of a frame, in the order in which they run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Sort,
    Count,
    Write,
}

/// A frame that was submitted.
#[derive(Debug)]
struct Frame {
    submission: wgpu::SubmissionIndex,
    params: Params,
    /// Most pairs that are downloaded with the header.
    sent: u64,
    /// Blocks left to further submissions.
    blocks_left: u64,
}

impl Engine {
    /// Compiles the kernels of a method, for boxes and pairs on the host.
    pub(super) fn new(gpu: Gpu, method: &str) -> Result<Self, GpuError> {
        use wgpu::BufferUsages as U;
        let search: Box<dyn Search> = match (method, Kind::named(method)) {
            ("brute", _) => Box::new(Brute::new(&gpu)?),
            (_, Some(kind)) => Box::new(Sorted::new(&gpu, kind)?),
            (other, None) => {
                return Err(GpuError::new(GpuErrorKind::NotFound, format!("no method {other} runs on GPUs")));
            }
        };
        let mut params = Storage::with_usage(&gpu, "parameters", U::UNIFORM | U::COPY_DST)?;
        params.ensure(&gpu, size_of::<Params>() as u64)?;
        let usage = U::STORAGE | U::COPY_SRC | U::COPY_DST | U::INDIRECT;
        Ok(Self {
            output: Output::new(&gpu)?,
            params,
            header: Storage::with_usage(&gpu, "header", usage)?,
            boxes: Storage::new(&gpu, "boxes")?,
            ids: Storage::new(&gpu, "numbers of boxes")?,
            memberships: Memberships::new(&gpu)?,
            filter: FilterState::default(),
            upload: Transfer::upload(&gpu)?,
            download: Transfer::download(&gpu)?,
            gpu,
            search,
            home: Home::Host,
            bound_to: None,
            expected: 0,
            submissions: 0,
            pending: Pending::Nothing,
        })
    }

    /// As [`new`](Self::new), for boxes and pairs on the GPU.
    pub(super) fn resident(gpu: Gpu, method: &str) -> Result<Self, GpuError> {
        let mut engine = Self::new(gpu, method)?;
        engine.home = Home::Device(Sampler::new(&engine.gpu)?);
        engine.download.ensure(&engine.gpu, PAIRS_AT + sampler::BYTES)?;
        Ok(engine)
    }

    /// Returns the most boxes that fit into the buffers of the GPU.
    pub(super) fn most_objects(&self) -> usize {
        // A sorted box takes more bytes than anything else that each box has.
        let most = largest(&self.gpu, wgpu::BufferUsages::STORAGE) / MOST_OF_BOX;
        usize::try_from(most).unwrap_or(usize::MAX).min(self.search.most_objects())
    }

    /// Returns the parameters of a frame; see [`Search::plan`].
    pub(super) fn plan(&self, objects: u32, look: impl Fn() -> Look) -> Params {
        self.search.plan(objects, &look)
    }

    /// Sets the filter of the next frames, or lifts it.
    ///
    /// # Errors
    /// It does not fit into a buffer, or the GPU refuses memory; then no filter is set.
    pub(super) fn set_filter(&mut self, filter: Option<&Filter>) -> Result<(), GpuError> {
        let bound_to = self.bound_to.take();
        if !self.memberships.set(&self.gpu, filter)? {
            self.bound_to = bound_to;
        }
        Ok(())
    }

    /// Takes over the filter of `pairs` if it has changed. One that does not fit into a buffer is left to the host.
    pub(super) fn filter_for(&mut self, pairs: &Pairs) -> Result<(), GpuError> {
        let state = pairs.filter_state();
        if self.filter != state {
            self.filter = FilterState::default();
            match self.set_filter(pairs.filter()) {
                Err(error) if error.kind() != GpuErrorKind::Limit => return Err(error),
                _ => self.filter = state,
            }
        }
        Ok(())
    }

    /// Makes room for a frame, and binds the kernels again if a buffer was replaced. `external` has the boxes that
    /// are on the GPU already.
    pub(super) fn prepare(
        &mut self,
        params: &Params,
        ids: bool,
        external: Option<&wgpu::Buffer>,
    ) -> Result<(), GpuError> {
        let prepared = self.make_room(params, ids, external);
        if prepared.is_err() {
            // Some buffers may have been replaced, and some destroyed.
            self.bound_to = None;
        }
        prepared
    }

    fn make_room(&mut self, params: &Params, ids: bool, external: Option<&wgpu::Buffer>) -> Result<(), GpuError> {
        self.gpu.check()?;
        let gpu = &self.gpu;
        let n = u64::from(params.objects);
        let mut grown = false;
        if external.is_none() {
            grown |= self.boxes.ensure(gpu, n * BOX)?;
        } else {
            self.upload.ensure(gpu, BOXES_AT)?;
        }
        if ids {
            grown |= self.ids.ensure(gpu, n * 4)?;
        }
        grown |= self.search.ensure(gpu, params)?;
        grown |= self.output.ensure_blocks(gpu, self.first_blocks(params.objects))?;
        // Most scenes have fewer pairs than boxes.
        let wanted = n.max(self.expected + self.expected / 4);
        // If there is no memory for the pairs of the previous frame, there may be enough for those of this one.
        grown |= match self.home {
            Home::Host => self.output.ensure_pairs(gpu, wanted).or_else(|_| self.output.ensure_pairs(gpu, n))?,
            // Commands of the program may still read the previous list.
            Home::Device(_) => self.output.enlarge_pairs(gpu, wanted).or_else(|_| self.output.enlarge_pairs(gpu, n))?,
        };
        self.download.ensure(gpu, PAIRS_AT + self.sendable() * PAIR)?;
        let boxes = external.unwrap_or_else(|| self.boxes.buffer());
        if grown || self.bound_to.as_ref() != Some(boxes) {
            let boxes = boxes.clone();
            self.bind(&boxes)?;
        }
        Ok(())
    }

    fn bind(&mut self, boxes: &wgpu::Buffer) -> Result<(), GpuError> {
        self.bound_to = None;
        let inputs = Inputs {
            params: self.params.buffer(),
            boxes,
            ids: self.ids.buffer(),
            header: self.header.buffer(),
            memberships: self.memberships.buffer(),
        };
        self.output.bind(&self.gpu, inputs.params, inputs.header)?;
        if let Home::Device(sampler) = &mut self.home {
            sampler.bind(&self.gpu, inputs.params, boxes)?;
        }
        self.search.bind(&self.gpu, &inputs, &self.output)?;
        self.bound_to = Some(boxes.clone());
        Ok(())
    }

    /// Returns the blocks of a frame's first submission.
    fn first_blocks(&self, objects: u32) -> u32 {
        self.search.blocks(objects).min(u64::from(self.search.most_blocks())) as u32
    }

    /// Returns how many pairs are downloaded with the header.
    fn sendable(&self) -> u64 {
        let wanted = self.expected + self.expected / 8 + SPARE_PAIRS;
        match self.home {
            Home::Host => wanted.min(u64::from(self.output.capacity())).min(self.downloadable()),
            Home::Device(_) => 0,
        }
    }

    /// Returns how many pairs one download can take.
    fn downloadable(&self) -> u64 {
        (self.gpu.limits().max_buffer_size - PAIRS_AT).min(MOST_DOWNLOAD) / PAIR
    }

    /// Finds the pairs of a whole frame.
    pub(super) async fn find(
        &mut self,
        plan: &FramePlan,
        boxes: &[Aabb],
        pairs: &mut Pairs,
        workers: &Workers,
    ) -> Result<(), Failure> {
        self.filter_for(pairs)?;
        let look = || Look::of(&SampledBoxes::from(boxes), plan.stats(boxes));
        self.start(boxes, None, |engine| engine.plan(boxes.len() as u32, look), workers).await?;
        self.finish(pairs, workers).await
    }

    /// Submits a frame, or a piece of one, and does not wait: several GPUs work at once.
    ///
    /// `ids` has the number of each box in the frame, with the highest bit set if this piece owns the pairs of the
    /// box. `None`: `boxes` is the whole frame. `plan` runs beside the copies.
    pub(super) async fn start(
        &mut self,
        boxes: &[Aabb],
        ids: Option<&[u32]>,
        plan: impl Fn(&Self) -> Params + Sync,
        workers: &Workers,
    ) -> Result<(), GpuError> {
        let (boxes, numbers): (&[u8], &[u8]) = (cast_slice(boxes), ids.map_or(&[], cast_slice));
        let ids_at = BOXES_AT as usize + boxes.len();
        let end = ids_at + numbers.len();
        self.upload.ensure(&self.gpu, end as u64)?;
        let mut view = self.upload.writable(&self.gpu, end as u64).await?;
        let planned = OnceLock::new();
        let plan = || *planned.get_or_init(|| plan(self));
        copy(boxes, view.slice(BOXES_AT as usize..ids_at), workers, || _ = plan());
        view.slice(ids_at..end).copy_from_slice(numbers);
        let params = plan();
        self.gpu.ends("planning and copying", Place::Host);
        self.prepare(&params, ids.is_some(), None)?;
        let params = Params { piece: u32::from(ids.is_some()), ..params };
        self.submit(view, params, [boxes.len(), numbers.len()].map(|bytes| bytes as u64))
    }

    /// Submits a frame of boxes that are on the GPU, and does not wait.
    pub(super) async fn start_resident(&mut self, boxes: &wgpu::Buffer, params: Params) -> Result<(), GpuError> {
        self.prepare(&params, false, Some(boxes))?;
        let view = self.upload.writable(&self.gpu, BOXES_AT).await?;
        self.submit(view, params, [0; 2])
    }

    /// Submits a frame. `boxes` and `ids` are their bytes in `view`, both 0 if the boxes are on the GPU.
    fn submit(
        &mut self,
        mut view: wgpu::BufferViewMut,
        mut params: Params,
        [boxes, ids]: [u64; 2],
    ) -> Result<(), GpuError> {
        let blocks_left = self.number(&mut params);
        for (at, bytes) in [(0, bytes_of(&params)), (HEADER_AT as usize, bytes_of(&Header::START))] {
            view.slice(at..at + bytes.len()).copy_from_slice(bytes);
        }
        drop(view);
        let parts = [
            (0, size_of::<Params>() as u64, self.params.buffer()),
            (HEADER_AT, size_of::<Header>() as u64, self.header.buffer()),
            (BOXES_AT, boxes, self.boxes.buffer()),
            (BOXES_AT + boxes, ids, self.ids.buffer()),
        ];
        self.gpu.ends("preparing", Place::Host);

        let mut encoder = self.gpu.record();
        self.upload.unmap();
        for (at, bytes, to) in parts.into_iter().filter(|(_, bytes, _)| *bytes > 0) {
            encoder.copy_buffer_to_buffer(self.upload.buffer(), at, to, 0, bytes);
        }
        self.record(&mut encoder, &params, Step::Sort);
        let sent = self.sendable();
        let submission = self.submit_and_download(encoder, sent)?;
        self.upload.ask(&self.gpu, self.upload.bytes());
        self.pending = Pending::Frame(Frame { submission, params, sent, blocks_left });
        Ok(())
    }

    /// Fills in what the first submission of a frame is told, and returns the blocks left to others.
    fn number(&mut self, params: &mut Params) -> u64 {
        params.blocks = self.first_blocks(params.objects);
        params.capacity = self.output.capacity();
        params.members = self.memberships.count.unwrap_or(0);
        params.submission = self.next_submission();
        self.search.blocks(params.objects) - u64::from(params.blocks)
    }

    /// Returns the number of the next submission, which its kernels write into the header.
    fn next_submission(&mut self) -> u32 {
        // 0 is what an untouched header holds.
        self.submissions = self.submissions.wrapping_add(1).max(1);
        self.submissions
    }

    /// Records the steps of a frame from `first` on.
    fn record(&self, encoder: &mut wgpu::CommandEncoder, params: &Params, first: Step) {
        if first == Step::Sort {
            self.search.clear(encoder, params);
        }
        if first != Step::Write {
            self.output.clear(encoder, params.blocks);
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        self.gpu.ends("copies before, clears", Place::Pass(&mut pass));
        if first == Step::Sort {
            // Overlaps with the first kernel of the sort.
            self.sample(&mut pass);
            self.search.record_sort(&mut pass, params);
        }
        if first != Step::Write {
            self.search.pairing().record_count(&mut pass, params.blocks);
            self.output.record(&mut pass);
        }
        self.search.pairing().record_write(&mut pass, params.blocks);
    }

    /// Submits, and downloads the header with `pairs` pairs or with a sample of the boxes.
    fn submit_and_download(&mut self, mut encoder: Recording, pairs: u64) -> Result<wgpu::SubmissionIndex, GpuError> {
        let download = self.download.buffer();
        encoder.copy_buffer_to_buffer(self.header.buffer(), 0, download, 0, size_of::<Header>() as u64);
        let bytes = match &self.home {
            Home::Host => pairs * PAIR,
            Home::Device(sampler) => sampler.copy(&mut encoder, download, PAIRS_AT),
        };
        if pairs > 0 {
            encoder.copy_buffer_to_buffer(self.output.pairs(), 0, download, PAIRS_AT, pairs * PAIR);
        }
        self.submit_mapped(encoder, PAIRS_AT + bytes)
    }

    /// Submits, and asks for the first `bytes` of the download.
    fn submit_mapped(&mut self, commands: Recording, bytes: u64) -> Result<wgpu::SubmissionIndex, GpuError> {
        self.pending = Pending::Nothing;
        self.download.unmap();
        let submission = self.gpu.submit(commands)?;
        self.download.ask(&self.gpu, bytes);
        Ok(submission)
    }

    /// Looks at boxes that are on the GPU, and waits for it.
    pub(super) async fn look(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<Look, GpuError> {
        let params = Params { objects, ..Params::default() };
        self.prepare(&params, false, Some(boxes))?;
        let mut encoder = self.gpu.record();
        self.set(&params);
        self.sample(&mut encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default()));
        let submission = self.submit_and_download(encoder, 0)?;
        self.download.wait(&self.gpu, Some(submission)).await?;
        Ok(Look::at(&self.sampled()?))
    }

    /// Takes a sample of boxes that are on the GPU.
    fn sample(&self, pass: &mut wgpu::ComputePass<'_>) {
        if let Home::Device(sampler) = &self.home {
            sampler.record(pass);
        }
    }

    /// Returns the sample that came with the last submission.
    fn sampled(&self) -> Result<SampledBoxes, GpuError> {
        let view = self.download.readable(&self.gpu, PAIRS_AT..PAIRS_AT + sampler::BYTES)?;
        Ok(SampledBoxes::given(cast_slice(&view)))
    }
}
