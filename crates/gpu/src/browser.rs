//! A method on WebGPU in a browser, which nothing may block.

use super::adapters::adapters;
use super::methods::id;
use super::{Engine, Failure, Gpu, identity, unavailable};
use sapwise::algorithm::FramePlan;
use sapwise::error::{GpuError, GpuErrorKind};
use sapwise::internals::Workers;
use sapwise::{Aabb, AlgorithmId, Error, Pairs};

impl Gpu {
    /// Opens the GPU that the browser gives a page or worker.
    ///
    /// # Errors
    /// [`GpuErrorKind::NotFound`] if there is none or the browser refuses it.
    pub async fn in_browser() -> Result<Self, GpuError> {
        let Some(adapter) = adapters().await.into_iter().next() else {
            return Err(GpuError::new(GpuErrorKind::NotFound, "the browser gives no GPU to this page"));
        };
        Self::open(&adapter, identity(0, &adapter.get_info())).await
    }
}

/// A method on WebGPU, from boxes in the memory of the module to pairs there.
#[derive(Debug)]
pub struct AsyncBroadPhase {
    id: AlgorithmId,
    engine: Engine,
}

impl AsyncBroadPhase {
    /// Makes the method `brute`, `sap`, `grid-sap` or `bvh` on an open GPU. Compiles its kernels.
    ///
    /// # Errors
    /// As [`broad_phase`](super::broad_phase()).
    pub async fn new(gpu: &Gpu, method: &str) -> Result<Self, Error> {
        let id = id(method, std::slice::from_ref(gpu))?;
        let refused = |error| unavailable(&id, error);
        let engine = Engine::new(gpu.clone(), method).map_err(refused)?;
        gpu.settle().await.map_err(refused)?;
        Ok(Self { id, engine })
    }

    /// Returns the algorithm.
    pub fn id(&self) -> &AlgorithmId {
        &self.id
    }

    /// Finds the pairs of a frame, as [`BroadPhase::find_pairs`](sapwise::BroadPhase::find_pairs) does.
    ///
    /// # Errors
    /// As there. [`Error::Unavailable`] too if the boxes don't fit into one buffer.
    pub async fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        if boxes.len() < 2 {
            Aabb::check(boxes, 0)?;
            return pairs.finish();
        }
        let most = self.engine.most_objects();
        if boxes.len() > most {
            let text = format!("{} boxes are more than the {most} that fit into its largest buffer", boxes.len());
            return Err(Failure::limit(text).of(&self.id));
        }
        let found = self.engine.find(&FramePlan::default(), boxes, pairs, &Workers::one()).await;
        found.map_err(|failure| failure.of(&self.id))?;
        pairs.finish()
    }
}
