//! A method on one GPU, from boxes that are on it to pairs that stay on it.

use super::device::Gpu;
use super::engine::Engine;
use super::storage::{Failure, unavailable};
use crate::aabb::Aabb;
use crate::algorithm::{AlgorithmId, Backend, ParseIdError};
use crate::error::Error;
use crate::load::Sample;

/// Finds pairs among boxes in the memory of a GPU and leaves the pairs there, for engines whose data never leave it.
///
/// No box and no pair crosses the bus, so its times can't be compared with those of a [`BroadPhase`](crate::BroadPhase), which
/// begin and end in the memory of the CPU. Figures of it are labelled device-resident wherever they stand.
#[derive(Debug)]
pub struct Resident {
    id: AlgorithmId,
    engine: Engine,
    /// What the last frame looked like: the grid of the next is laid for it.
    sample: Option<Sample>,
}

/// The pairs of a frame, on the GPU.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct ResidentPairs<'a> {
    /// `array<vec2<u32>>`: two positions in the input, the lower one first. Holds more than `count`; the rest is left over.
    pub buffer: &'a wgpu::Buffer,
    /// How many pairs there are. Each stands there once, in an order that is the same whenever the frame is.
    pub count: u32,
}

impl Resident {
    /// The method `brute`, `sap` or `grid-sap` on an open GPU. Compiles its kernels.
    ///
    /// # Errors
    /// [`Error::UnknownAlgorithm`] for another method; [`Error::Unavailable`] when a kernel does not compile or memory is
    /// refused.
    pub fn new(gpu: &Gpu, method: &str) -> Result<Self, Error> {
        let unknown = |e: ParseIdError| Error::UnknownAlgorithm { text: method.to_owned(), hint: e.to_string() };
        let id = AlgorithmId::new(method, Backend::Gpu(vec![gpu.identity().index])).map_err(unknown)?;
        let engine = Engine::resident(gpu.clone(), method);
        match engine {
            Ok(engine) => Ok(Self { id, engine, sample: None }),
            Err(error) => Err(unavailable(&id, error)),
        }
    }

    /// Finds the pairs of the first `objects` boxes of a buffer of the same device, six 32-bit floats each: minimum, maximum.
    ///
    /// The buffer needs the usage `STORAGE`. Waits for the number of pairs, 16 bytes, and for a sample of 256 boxes. Frames from one
    /// buffer bind it once; another buffer is bound again.
    ///
    /// # Errors
    /// [`Error::InvalidBox`]; [`Error::Unavailable`] when the buffer is too small or not for storage, when boxes or pairs don't
    /// fit into the largest buffer of the GPU, when `brute` is asked for more boxes than one submission takes (131 000 on a GPU, 65 000
    /// on a software adapter), when a box
    /// has more than 32 768 candidates, and when the GPU was lost.
    pub fn find_pairs(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<ResidentPairs<'_>, Error> {
        let count = self.run(boxes, objects).map_err(|failure| failure.of(&self.id))?;
        Ok(ResidentPairs { buffer: self.engine.pairs_buffer(), count })
    }

    fn run(&mut self, boxes: &wgpu::Buffer, objects: u32) -> Result<u32, Failure> {
        let bytes = u64::from(objects) * size_of::<Aabb>() as u64;
        if boxes.size() < bytes || !boxes.usage().contains(wgpu::BufferUsages::STORAGE) {
            let text = format!("{objects} boxes need a buffer of {bytes} bytes with the usage STORAGE, this one has");
            return Err(Failure::limit(format!("{text} {} bytes and {:?}", boxes.size(), boxes.usage())));
        }
        if objects as usize > self.engine.most_objects() {
            let most = self.engine.most_objects();
            return Err(Failure::limit(format!(
                "{objects} boxes are more than the {most} that fit into its largest buffer"
            )));
        }
        if objects == 0 {
            return Ok(0);
        }
        let sample = match &self.sample {
            Some(sample) => sample,
            None => self.sample.insert(self.engine.look(boxes, objects)?),
        };
        let params = self.engine.plan(objects, || *sample);
        self.engine.start_resident(boxes, params)?;
        let (count, sample) = self.engine.finish_resident()?;
        self.sample = Some(sample);
        Ok(count)
    }
}
