//! One method on one GPU, frame by frame: boxes up, kernels, pairs down.

mod ahead;
mod canary;
mod collect;
#[cfg(test)]
mod tests;

use super::brute::Brute;
use super::device::Gpu;
use super::inputs::Inputs;
use super::look::Look;
use super::output::{Output, PAIR};
use super::params::{Header, Params};
use super::sampler::{self, Sampler};
use super::scope::Recording;
use super::sorted::{Kind, MOST_OF_BOX, Sorted};
use super::storage::{Storage, largest};
use super::transfer::Transfer;
use crate::aabb::Aabb;
use crate::error::{GpuError, GpuErrorKind};
use crate::load::SampledBoxes;

/// Bytes of a box.
const BOX: u64 = size_of::<Aabb>() as u64;
/// Where things stand in the upload: parameters, header, boxes and behind them their numbers. Copies begin at multiples of 8.
const HEADER_AT: u64 = 1792;
const BOXES_AT: u64 = 2048;
/// Where pairs begin in the download, behind the header.
const PAIRS_AT: u64 = 48;
/// Bytes of pairs that one download takes. More pairs come in several.
const MOST_DOWNLOAD: u64 = 64 << 20;
/// Pairs beyond those of the frame before that come back with the header. If there are more, a second submission gets them.
const SPARE_PAIRS: u64 = 256;

/// A method on a GPU with all its buffers.
#[derive(Debug)]
pub(super) struct Engine {
    pub(super) gpu: Gpu,
    search: Search,
    /// For boxes that the CPU does not see.
    sampler: Option<Sampler>,
    output: Output,
    params: Storage,
    header: Storage,
    boxes: Storage,
    ids: Storage,
    upload: Transfer,
    download: Transfer,
    /// The buffer of boxes that the kernels are bound to; `None` when they are bound to nothing.
    bound_to: Option<wgpu::Buffer>,
    /// Pairs of the frame before.
    expected: u64,
    /// The number of the last submission that counted.
    submissions: u32,
    frame: Option<Frame>,
    /// The number of a submission that nobody waits for and whose header is on its way.
    unread: Option<u32>,
}

#[derive(Debug)]
enum Search {
    Brute(Brute),
    Sorted(Box<Sorted>),
}

impl Search {
    /// Blocks of the first submission of a frame, and the tile pairs of brute force that are left to further ones.
    fn blocks(&self, objects: u32) -> (u32, u64) {
        match self {
            Self::Brute(_) => {
                let all = Brute::blocks(objects);
                let first = all.min(u64::from(Brute::BAND));
                (first as u32, all - first)
            }
            Self::Sorted(_) => (Sorted::blocks(objects), 0),
        }
    }
}

/// What a frame goes through.
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
    /// Pairs that come back with the header, where there are as many.
    sent: u64,
    /// Tile pairs of brute force that are not counted yet.
    tile_pairs_left: u64,
}

/// Boxes of a frame or a piece, in the memory of the host.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece<'a> {
    pub(super) boxes: &'a [Aabb],
    /// For each box its number in the frame, the highest bit set where this piece owns its pairs. `None`: the whole frame.
    pub(super) ids: Option<&'a [u32]>,
}

impl Engine {
    /// A method by its name.
    pub(super) fn new(gpu: Gpu, method: &str) -> Result<Self, GpuError> {
        let search = match (method, Kind::named(method)) {
            ("brute", _) => Search::Brute(Brute::new(&gpu)?),
            (_, Some(kind)) => Search::Sorted(Box::new(Sorted::new(&gpu, kind)?)),
            (other, None) => {
                return Err(GpuError::new(GpuErrorKind::NotFound, format!("no method {other} runs on GPUs")));
            }
        };
        let uniform = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let header = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST
            | wgpu::BufferUsages::INDIRECT;
        let mut params = Storage::with_usage(&gpu, "parameters", uniform)?;
        params.ensure(&gpu, size_of::<Params>() as u64)?;
        Ok(Self {
            output: Output::new(&gpu)?,
            params,
            header: Storage::with_usage(&gpu, "header", header)?,
            boxes: Storage::new(&gpu, "boxes")?,
            ids: Storage::new(&gpu, "numbers of boxes")?,
            upload: Transfer::upload(&gpu)?,
            download: Transfer::download(&gpu)?,
            gpu,
            search,
            sampler: None,
            bound_to: None,
            expected: 0,
            submissions: 0,
            frame: None,
            unread: None,
        })
    }

    /// As [`new`](Self::new), for boxes that are on the GPU and pairs that stay there.
    pub(super) fn resident(gpu: Gpu, method: &str) -> Result<Self, GpuError> {
        let mut engine = Self::new(gpu, method)?;
        engine.sampler = Some(Sampler::new(&engine.gpu)?);
        engine.download.ensure(&engine.gpu, PAIRS_AT + sampler::BYTES)?;
        Ok(engine)
    }

    /// Boxes that fit into the largest buffers of the GPU. More have to come in pieces.
    pub(super) fn most_objects(&self) -> usize {
        // A sorted box is the largest thing that there is one of for each box.
        let most = largest(&self.gpu, wgpu::BufferUsages::STORAGE) / MOST_OF_BOX;
        let numbered = match &self.search {
            Search::Brute(_) => Brute::MOST_OBJECTS,
            Search::Sorted(_) => Sorted::MOST_OBJECTS,
        };
        usize::try_from(most).unwrap_or(usize::MAX).min(numbered)
    }

    /// The parameters of a frame of boxes that look like this, at which the method looks only where it needs to.
    pub(super) fn plan(&self, objects: u32, look: impl FnOnce() -> Look) -> Params {
        match &self.search {
            Search::Brute(_) => Params { objects, ..Params::default() },
            Search::Sorted(sorted) => sorted.plan(&look(), objects),
        }
    }

    /// Makes room for the frame, and binds the kernels again where a buffer is another one now. `external`: boxes that are on
    /// the GPU already.
    pub(super) fn prepare(
        &mut self,
        params: &Params,
        ids: bool,
        external: Option<&wgpu::Buffer>,
    ) -> Result<(), GpuError> {
        let prepared = self.make_room(params, ids, external);
        if prepared.is_err() {
            // Some buffers may be new, some given back: everything is bound again before it is used again.
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
            self.upload.ensure(gpu, BOXES_AT + n * (BOX + if ids { 4 } else { 0 }))?;
        } else {
            self.upload.ensure(gpu, BOXES_AT)?;
        }
        if ids {
            grown |= self.ids.ensure(gpu, n * 4)?;
        }
        if let Search::Sorted(sorted) = &mut self.search {
            grown |= sorted.ensure(gpu, params)?;
        }
        let (blocks, _) = self.search.blocks(params.objects);
        grown |= self.output.ensure_blocks(gpu, blocks)?;
        // Most scenes have fewer pairs than objects.
        let wanted = n.max(self.expected + self.expected / 4);
        grown |= if self.sampler.is_none() {
            self.output.ensure_pairs(gpu, wanted)?
        } else {
            // Commands of the program may still read the list of before. Where there is no room for as many as in the frame before, there may be
            // for those of this one.
            self.output.enlarge_pairs(gpu, wanted).or_else(|_| self.output.enlarge_pairs(gpu, n))?
        };
        if self.sampler.is_none() {
            self.download.ensure(gpu, PAIRS_AT + self.sendable() * PAIR)?;
        }
        let boxes = external.unwrap_or_else(|| self.boxes.buffer());
        if grown || self.bound_to.as_ref() != Some(boxes) {
            let boxes = boxes.clone();
            self.bind(&boxes)?;
        }
        Ok(())
    }

    fn bind(&mut self, boxes: &wgpu::Buffer) -> Result<(), GpuError> {
        self.bound_to = None;
        let inputs =
            Inputs { params: self.params.buffer(), boxes, ids: self.ids.buffer(), header: self.header.buffer() };
        self.output.bind(&self.gpu, inputs.params, inputs.header)?;
        if let Some(sampler) = &mut self.sampler {
            sampler.bind(&self.gpu, inputs.params, boxes)?;
        }
        match &mut self.search {
            Search::Brute(brute) => brute.bind(&self.gpu, &inputs, &self.output)?,
            Search::Sorted(sorted) => sorted.bind(&self.gpu, &inputs, &self.output)?,
        }
        self.bound_to = Some(boxes.clone());
        Ok(())
    }

    /// Pairs that are copied back with the header.
    fn sendable(&self) -> u64 {
        let wanted = self.expected + self.expected / 8 + SPARE_PAIRS;
        wanted.min(u64::from(self.output.capacity())).min(self.downloadable())
    }

    /// Pairs that one download can take.
    fn downloadable(&self) -> u64 {
        (self.gpu.limits().max_buffer_size - PAIRS_AT).min(MOST_DOWNLOAD) / PAIR
    }

    /// Submits a piece and does not wait for it: several GPUs work at once.
    pub(super) fn start(&mut self, piece: Piece<'_>, params: Params) -> Result<(), GpuError> {
        self.prepare(&params, piece.ids.is_some(), None)?;
        self.submit(params, Some(piece))
    }

    /// As [`start`](Self::start), with boxes that are on the GPU already, and pairs that stay there.
    pub(super) fn start_resident(&mut self, boxes: &wgpu::Buffer, params: Params) -> Result<(), GpuError> {
        self.prepare(&params, false, Some(boxes))?;
        self.submit(params, None)
    }

    /// `None`: the boxes are on the GPU.
    fn submit(&mut self, mut params: Params, piece: Option<Piece<'_>>) -> Result<(), GpuError> {
        let (blocks, tile_pairs_left) = self.search.blocks(params.objects);
        params.blocks = blocks;
        params.submission = self.next_submission();
        params.capacity = self.output.capacity();
        params.piece = u32::from(piece.is_some_and(|p| p.ids.is_some()));
        let boxes: &[u8] = piece.map_or(&[], |p| bytemuck::cast_slice(p.boxes));
        let ids: &[u8] = piece.and_then(|p| p.ids).map_or(&[], bytemuck::cast_slice);
        let ids_at = BOXES_AT as usize + boxes.len();
        let mut view = self.upload.writable(&self.gpu, (ids_at + ids.len()) as u64)?;
        view.slice(..size_of::<Params>()).copy_from_slice(bytemuck::bytes_of(&params));
        let header = HEADER_AT as usize;
        view.slice(header..header + size_of::<Header>()).copy_from_slice(bytemuck::bytes_of(&Header::START));
        view.slice(BOXES_AT as usize..ids_at).copy_from_slice(boxes);
        view.slice(ids_at..).copy_from_slice(ids);
        drop(view);

        let mut encoder = self.gpu.record();
        self.upload.unmap();
        let upload = self.upload.buffer();
        encoder.copy_buffer_to_buffer(upload, 0, self.params.buffer(), 0, size_of::<Params>() as u64);
        encoder.copy_buffer_to_buffer(upload, HEADER_AT, self.header.buffer(), 0, size_of::<Header>() as u64);
        if !boxes.is_empty() {
            encoder.copy_buffer_to_buffer(upload, BOXES_AT, self.boxes.buffer(), 0, boxes.len() as u64);
        }
        if !ids.is_empty() {
            encoder.copy_buffer_to_buffer(upload, ids_at as u64, self.ids.buffer(), 0, ids.len() as u64);
        }
        if let Search::Sorted(sorted) = &self.search {
            sorted.clear(&mut encoder, &params);
        }
        self.record(&mut encoder, &params, Step::Sort);
        let sent = if self.sampler.is_none() { self.sendable() } else { 0 };
        self.copy_back(&mut encoder, sent);
        let submission = self.submit_mapped(encoder, PAIRS_AT + (sent * PAIR).max(self.sample_bytes()))?;
        self.upload.ask(&self.gpu, self.upload.bytes());
        self.frame = Some(Frame { submission, params, sent, tile_pairs_left });
        Ok(())
    }

    /// The steps of a frame from `first` on.
    fn record(&self, encoder: &mut wgpu::CommandEncoder, params: &Params, first: Step) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        if let (Step::Sort, Search::Sorted(sorted)) = (first, &self.search) {
            sorted.record_sort(&mut pass, params);
        }
        if first != Step::Write {
            match &self.search {
                Search::Brute(brute) => brute.record_count(&mut pass, params.blocks),
                Search::Sorted(sorted) => sorted.record_count(&mut pass, params),
            }
            self.output.record(&mut pass);
        }
        match &self.search {
            Search::Brute(brute) => brute.record_write(&mut pass, params.blocks),
            Search::Sorted(sorted) => sorted.record_write(&mut pass, params),
        }
    }

    fn copy_back(&self, encoder: &mut wgpu::CommandEncoder, pairs: u64) {
        let download = self.download.buffer();
        encoder.copy_buffer_to_buffer(self.header.buffer(), 0, download, 0, size_of::<Header>() as u64);
        if let Some(sampler) = &self.sampler {
            sampler.record(encoder, download, PAIRS_AT);
        }
        if pairs > 0 {
            encoder.copy_buffer_to_buffer(self.output.pairs(), 0, download, PAIRS_AT, pairs * PAIR);
        }
    }

    /// Bytes of a sample of boxes that are on the GPU.
    fn sample_bytes(&self) -> u64 {
        if self.sampler.is_some() { sampler::BYTES } else { 0 }
    }

    /// Looks at boxes that are on the GPU, without a frame.
    pub(super) fn look(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<Look, GpuError> {
        let params = Params { objects, ..Params::default() };
        self.prepare(&params, false, Some(boxes))?;
        let mut encoder = self.gpu.record();
        self.set(&params);
        self.copy_back(&mut encoder, 0);
        let submission = self.submit_mapped(encoder, PAIRS_AT + sampler::BYTES)?;
        self.gpu.wait(submission)?;
        self.seen()
    }

    /// What the sampler of the last submission saw.
    fn seen(&self) -> Result<Look, GpuError> {
        let view = self.download.readable(&self.gpu, PAIRS_AT..PAIRS_AT + sampler::BYTES)?;
        Ok(Look::at(&SampledBoxes::given(bytemuck::cast_slice(&view))))
    }

    /// Submits, and asks for the first `bytes` of the download.
    fn submit_mapped(&mut self, commands: Recording, bytes: u64) -> Result<wgpu::SubmissionIndex, GpuError> {
        self.unread = None;
        self.download.unmap();
        let submission = self.gpu.submit(commands)?;
        self.download.ask(&self.gpu, bytes);
        Ok(submission)
    }
}
