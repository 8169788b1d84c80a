//! A method on one GPU, from boxes that are on it to pairs that stay on it.

use super::device::Gpu;
use super::engine::Engine;
use super::look::Look;
use super::params::Params;
use super::storage::{Failure, unavailable};
use crate::aabb::Aabb;
use crate::algorithm::{AlgorithmId, Backend, ParseIdError};
use crate::error::{BoxDefect, Error};

/// Finds pairs among boxes in the memory of a GPU and leaves the pairs there, for engines whose data never leave it.
///
/// No box and no pair crosses the bus, so its times can't be compared with those of a [`BroadPhase`](crate::BroadPhase), which
/// begin and end in the memory of the CPU. Figures of it are labelled device-resident wherever they stand.
#[derive(Debug)]
pub struct Resident {
    id: AlgorithmId,
    engine: Engine,
    /// What the last frame looked like: the next is planned for it.
    look: Option<Look>,
    /// What became of the last frame that nobody waited for.
    last: Option<SubmittedCounts>,
}

/// The pairs of a frame, on the GPU.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct ResidentPairs<'a> {
    /// `array<vec2<u32>>`: two positions in the input, the lower one first. Holds more than `count`; the rest is left over.
    pub buffer: &'a wgpu::Buffer,
    /// How many pairs there are. Each stands there once, in an order that is the same whenever this frame and the one before are.
    pub count: u32,
}

/// The pairs of a frame that was submitted, on the GPU, and what is known of them there.
///
/// The next frame writes to the same buffers, or to larger ones: whatever reads these is submitted before it, and binds those that it is handed
/// each time. No kernel of the program may write to either.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct SubmittedPairs<'a> {
    /// As [`ResidentPairs::buffer`].
    pub pairs: &'a wgpu::Buffer,
    /// Nine words, with the usage `INDIRECT` too:
    ///
    /// | byte | word |
    /// |---|---|
    /// | 0, 4 | pairs in all, the lower 32 bits first |
    /// | 8 | all ones, or twice the position of the first invalid box, plus 1 if it is inverted: the pairs are then worth nothing |
    /// | 12 | 0, or 1 where a box has more candidates than one submission tests, and pairs are missing |
    /// | 16 | the number of the submission |
    /// | 20, 24, 28 | for `dispatch_workgroups_indirect`: workgroups of 64 pairs, at most 65 535 side by side, the rest in further rows |
    /// | 32 | pairs that the buffer holds: fewer than there are where it is too small, and the next frames have a larger one |
    pub counts: &'a wgpu::Buffer,
}

/// What became of a frame that was submitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct SubmittedCounts {
    /// Which submission it was: the word at byte 16 of [`SubmittedPairs::counts`].
    pub submission: u32,
    /// The pairs that there were.
    pub pairs: u64,
    /// Whether all of them were written. Else the buffer was too small, and is larger from the next frame on, or a box had more candidates than
    /// one submission tests: [`Resident::find_pairs`] has no such bound.
    pub whole: bool,
    /// The position of the first invalid box, and what is wrong with it.
    pub invalid: Option<(usize, BoxDefect)>,
}

impl Resident {
    /// The method `brute`, `sap`, `grid-sap` or `bvh` on an open GPU. Compiles its kernels.
    ///
    /// # Errors
    /// [`Error::UnknownAlgorithm`] for another method; [`Error::Unavailable`] when a kernel does not compile or memory is
    /// refused.
    pub fn new(gpu: &Gpu, method: &str) -> Result<Self, Error> {
        let unknown = |e: ParseIdError| Error::UnknownAlgorithm { text: method.to_owned(), hint: e.to_string() };
        let id = AlgorithmId::new(method, Backend::Gpu(vec![gpu.identity().index])).map_err(unknown)?;
        let engine = Engine::resident(gpu.clone(), method);
        match engine {
            Ok(engine) => Ok(Self { id, engine, look: None, last: None }),
            Err(error) => Err(unavailable(&id, error)),
        }
    }

    /// Finds the pairs of the first `objects` boxes of a buffer of the same device, six 32-bit floats each: minimum, maximum.
    ///
    /// The buffer needs the usage `STORAGE`. Waits for the number of pairs and for a sample of 256 boxes. Frames from one
    /// buffer bind it once; another buffer is bound again.
    ///
    /// # Errors
    /// [`Error::InvalidBox`]; [`Error::Unavailable`] when the buffer is too small or not for storage, when boxes or pairs don't
    /// fit into the largest buffer of the GPU, and when the GPU was lost.
    pub fn find_pairs(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<ResidentPairs<'_>, Error> {
        let count = self.run(boxes, objects).map_err(|failure| failure.of(&self.id))?;
        Ok(ResidentPairs { buffer: self.engine.pairs_buffer(), count })
    }

    /// Submits the same frame and does not wait for it: pairs and their number are for kernels that follow on the same queue.
    ///
    /// Only the first frame of all waits, for a sample of 256 boxes. Later ones are planned for what the last frame that has come back looked
    /// like, and have room for its pairs and a quarter more; [`last`](Self::last) says what it was.
    ///
    /// # Errors
    /// As [`find_pairs`](Self::find_pairs), but for what is wrong with the boxes of this frame, which stands in [`SubmittedPairs::counts`]; and
    /// [`Error::Unavailable`] when `brute` is asked for more boxes than one submission takes (46 000). Where `sap` has more candidates for a box than
    /// one submission tests, 1024 in a frame of a million boxes, the frame is not whole: use `grid-sap` or `bvh`.
    pub fn submit(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<SubmittedPairs<'_>, Error> {
        self.run_ahead(boxes, objects).map_err(|failure| failure.of(&self.id))?;
        Ok(SubmittedPairs { pairs: self.engine.pairs_buffer(), counts: self.engine.header_buffer() })
    }

    /// What became of the last frame that had come back when a frame was last [submitted](Self::submit): as a rule the one before that. While one is on
    /// its way no other is asked for, so that not every frame is heard of where the GPU is behind. `None` before there is one.
    #[must_use]
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
            self.look = Some(look);
        }
        if objects == 0 {
            return Ok(self.engine.submit_nothing()?);
        }
        let params = self.plan(boxes, objects)?;
        Ok(self.engine.submit_ahead(boxes, params)?)
    }

    /// The parameters of a frame like the one before. The first looks at its boxes, and waits for that.
    fn plan(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<Params, Failure> {
        let look = match self.look {
            Some(look) => look,
            None => *self.look.insert(self.engine.look(boxes, objects)?),
        };
        Ok(self.engine.plan(objects, || look))
    }

    fn run(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<u32, Failure> {
        self.check(boxes, objects)?;
        if objects == 0 {
            return Ok(0);
        }
        let params = self.plan(boxes, objects)?;
        self.engine.start_resident(boxes, params)?;
        let (count, look) = self.engine.finish_resident()?;
        self.look = Some(look);
        Ok(count)
    }

    /// Whether the buffer holds that many boxes, and the GPU has room for them.
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
