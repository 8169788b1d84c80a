//! A method on one GPU, from boxes on the GPU to pairs on the GPU.

use super::methods::id;
use super::{Engine, Failure, Gpu, Look, Params, unavailable};
use sapwise::error::BoxDefect;
use sapwise::internals::SampledBoxes;
use sapwise::{Aabb, AlgorithmId, Error, Filter};

/// Finds the pairs of boxes in the memory of a GPU and leaves them there, for engines whose data never leave it.
///
/// No box and no pair crosses the bus. Its times are labelled device-resident and can't be compared with those of a
/// [`BroadPhase`](sapwise::BroadPhase), which begin and end in the memory of the CPU.
#[derive(Debug)]
pub struct Resident {
    id: AlgorithmId,
    engine: Engine,
    /// What an earlier frame looked like, for which the next one is planned.
    look: Option<Look>,
    /// The sample of the last frame. It becomes the look while the GPU works on the next frame.
    sample: Option<SampledBoxes>,
    /// The last submitted frame that has arrived.
    last: Option<SubmittedCounts>,
}

/// The pairs of a frame, on the GPU.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct ResidentPairs<'a> {
    /// `array<vec2<u32>>`: two positions in the input, the lower one first. What follows the first `count` pairs is
    /// undefined.
    pub buffer: &'a wgpu::Buffer,
    /// Number of pairs. Each is there once; the order follows from this frame and the two before it.
    pub count: u32,
}

/// The pairs of a submitted frame and their number, on the GPU.
///
/// The next frame writes to the same buffers or to larger ones. So submit what reads them before the next frame, bind
/// the buffers of each frame anew, and write to neither.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct SubmittedPairs<'a> {
    /// As [`ResidentPairs::buffer`].
    pub pairs: &'a wgpu::Buffer,
    /// Nine words. The buffer has the usage `INDIRECT` too.
    ///
    /// | byte | word |
    /// |---|---|
    /// | 0, 4 | number of pairs, the lower 32 bits first |
    /// | 8 | all ones; or twice the position of the first invalid box, plus 1 if it is inverted: no pair counts then |
    /// | 12 | 1 if pairs are missing, because a box has more candidates than one submission tests; else 0 |
    /// | 16 | number of the submission |
    /// | 20, 24, 28 | for `dispatch_workgroups_indirect`: workgroups of 64 pairs, in rows of at most 65 535 |
    /// | 32 | pairs in the buffer: fewer than there are if it is too small; the next frames have a larger one |
    pub counts: &'a wgpu::Buffer,
}

/// What a submitted frame found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct SubmittedCounts {
    /// Number of the submission: the word at byte 16 of [`SubmittedPairs::counts`].
    pub submission: u32,
    /// Number of pairs.
    pub pairs: u64,
    /// Whether the buffer has all pairs. Otherwise it was too small, and is larger from the next frame on; or a box
    /// had more candidates than one submission tests, a limit that [`Resident::find_pairs`] does not have.
    pub whole: bool,
    /// Position of the first invalid box, and its defect.
    pub invalid: Option<(usize, BoxDefect)>,
}

impl Resident {
    /// The method `brute`, `sap`, `grid-sap` or `bvh` on an open GPU. Compiles its kernels.
    ///
    /// # Errors
    /// [`Error::UnknownAlgorithm`] if `method` is no name; [`Error::Unavailable`] if it does not run on GPUs, a
    /// kernel does not compile or the GPU is out of memory.
    pub fn new(gpu: &Gpu, method: &str) -> Result<Self, Error> {
        let id = id(method, std::slice::from_ref(gpu))?;
        let engine = Engine::resident(gpu.clone(), method).map_err(|error| unavailable(&id, error))?;
        Ok(Self { id, engine, look: None, sample: None, last: None })
    }

    /// Finds the pairs of the first `objects` boxes of a buffer of the same device, six 32-bit floats each: minimum,
    /// maximum.
    ///
    /// The buffer needs the usage `STORAGE`. The call waits for the number of pairs and a sample of 256 boxes. It is
    /// faster with the buffer of the previous frame than with another one, which must be bound.
    ///
    /// # Errors
    /// [`Error::InvalidBox`]; [`Error::Unavailable`] if the buffer is too small or lacks the usage, boxes or pairs
    /// don't fit into the largest buffer of the GPU, or the GPU was lost.
    pub fn find_pairs(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<ResidentPairs<'_>, Error> {
        let count = self.run(boxes, objects).map_err(|failure| failure.of(&self.id))?;
        Ok(ResidentPairs { buffer: self.engine.output.pairs(), count })
    }

    /// Submits the same frame without waiting. Kernels that follow on the same queue can read the pairs and their
    /// number.
    ///
    /// Only the very first frame waits, for a sample of 256 boxes, and the first with a filter, for its kernels. Later
    /// frames are planned for the [last](Self::last) frame that has arrived, with room for its pairs and a quarter
    /// more.
    ///
    /// `sap` tests at most 32 768 candidates of a box in one submission, and 1024 in a frame of a million boxes. If a
    /// box has more, the frame is not [whole](SubmittedCounts::whole): use `grid-sap` or `bvh`.
    ///
    /// # Errors
    /// As [`find_pairs`](Self::find_pairs), except that invalid boxes are reported in [`SubmittedPairs::counts`].
    /// [`Error::Unavailable`] too if `brute` gets more boxes than one submission takes (46 000).
    pub fn submit(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<SubmittedPairs<'_>, Error> {
        self.run_ahead(boxes, objects).map_err(|failure| failure.of(&self.id))?;
        Ok(SubmittedPairs { pairs: self.engine.output.pairs(), counts: self.engine.header.buffer() })
    }

    /// Sets the filter of the next frames, or lifts it. Uploads 16 bytes for each membership.
    ///
    /// # Errors
    /// [`Error::Unavailable`] if the memberships don't fit into the largest buffer of the GPU, or it refuses memory;
    /// then no filter is set.
    pub fn set_filter(&mut self, filter: Option<&Filter>) -> Result<(), Error> {
        self.engine.set_filter(filter).map_err(|error| unavailable(&self.id, error))
    }

    /// Returns the last frame that had arrived when a frame was last [submitted](Self::submit): usually the previous
    /// one. If the GPU is behind, some frames are never reported. `None` before the first.
    pub fn last(&self) -> Option<SubmittedCounts> {
        self.last
    }

    fn run_ahead(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<(), Failure> {
        self.check(boxes, objects)?;
        if let Some((header, look)) = self.engine.arrived()? {
            let whole = header.more == 0 && header.total() == u64::from(header.held);
            self.last = Some(SubmittedCounts {
                submission: header.ran,
                pairs: header.total(),
                whole,
                invalid: header.invalid(),
            });
            (self.look, self.sample) = (Some(look), None);
        }
        if objects == 0 {
            return Ok(self.engine.submit_nothing()?);
        }
        let params = self.plan(boxes, objects)?;
        Ok(self.engine.submit_ahead(boxes, params)?)
    }

    /// Returns the parameters of a frame that looks like an earlier one. The first waits for a sample.
    fn plan(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<Params, Failure> {
        let look = match self.look {
            Some(look) => look,
            None => *self.look.insert(pollster::block_on(self.engine.look(boxes, objects))?),
        };
        Ok(self.engine.plan(objects, || look))
    }

    fn run(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<u32, Failure> {
        self.check(boxes, objects)?;
        if objects == 0 {
            return Ok(0);
        }
        let params = self.plan(boxes, objects)?;
        pollster::block_on(self.engine.start_resident(boxes, params))?;
        if let Some(sample) = self.sample.take() {
            self.look = Some(Look::at(&sample));
        }
        let (count, sample) = pollster::block_on(self.engine.finish_resident())?;
        self.sample = Some(sample);
        Ok(count)
    }

    /// Checks that the buffer has `objects` boxes, and the GPU room for them.
    fn check(&self, boxes: &wgpu::Buffer, objects: u32) -> Result<(), Failure> {
        let bytes = u64::from(objects) * size_of::<Aabb>() as u64;
        if boxes.size() < bytes || !boxes.usage().contains(wgpu::BufferUsages::STORAGE) {
            let text = format!("{objects} boxes need a buffer of {bytes} bytes with the usage STORAGE, this one has");
            return Err(Failure::limit(format!("{text} {} bytes and {:?}", boxes.size(), boxes.usage())));
        }
        let most = self.engine.most_objects();
        if objects as usize > most {
            return Err(Failure::limit(format!(
                "{objects} boxes are more than the {most} that fit into its largest buffer"
            )));
        }
        Ok(())
    }
}
