//! A method on one or several GPUs, from boxes in host memory to pairs in host memory.

use super::methods::id;
use super::share::{Share, sizes, worst};
use super::{Failure, Gpu, Look, Slabs, unavailable};
use sapwise::algorithm::{FramePlan, usable_cores};
use sapwise::error::GpuError;
use sapwise::internals::{SceneStats, Threads, Workers, check_count};
use sapwise::{Aabb, AlgorithmId, BroadPhase, Error, Pairs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Most boxes of a frame: a GPU has 31 bits for their numbers, and one for the owner.
const MOST_OBJECTS: usize = 1 << 30;

/// Most slabs that a GPU takes one after another. If these do not suffice, the slabs overlap too much for more to
/// help.
const MOST_ROUNDS: usize = 64;

/// Most threads that copy boxes to a GPU and pairs from it. On an NVIDIA H200 more copy no faster.
const MOST_COPIERS: u32 = 4;

/// A method on one or several GPUs.
#[derive(Debug)]
pub(super) struct OnGpus {
    id: AlgorithmId,
    parts: Vec<Share>,
    slabs: Slabs,
    workers: Workers,
    /// Whether one of the parts has exceeded the limit in this frame.
    any_over: Arc<AtomicBool>,
    /// Whether its kernels have run: some drivers finish compiling at the first dispatch.
    warm: bool,
}

/// Makes the method `brute`, `sap`, `grid-sap` or `bvh` on open GPUs, from boxes in host memory to pairs in host
/// memory.
///
/// For programs that have opened a device themselves ([`Gpu::from_parts`]). Several GPUs share each frame; they may
/// be several devices of one adapter.
///
/// # Errors
/// [`Error::UnknownAlgorithm`] without a GPU or for another method; [`Error::Unavailable`] if a kernel does not
/// compile or the GPU is out of memory.
pub fn broad_phase(method: &str, gpus: Vec<Gpu>) -> Result<Box<dyn BroadPhase>, Error> {
    OnGpus::on(&id(method, &gpus)?, gpus)
}

impl OnGpus {
    /// Makes the algorithm `id` on open GPUs, which may be the same one several times.
    pub(super) fn on(id: &AlgorithmId, gpus: Vec<Gpu>) -> Result<Box<dyn BroadPhase>, Error> {
        let parts = gpus.into_iter().map(|gpu| Share::new(gpu, id.method())).collect::<Result<Vec<_>, GpuError>>();
        let parts = parts.map_err(|e| unavailable(id, e))?;
        // Its own pool without pinning: the threads wait for drivers, whose own threads need a core.
        let threads = usable_cores().min(MOST_COPIERS).max(parts.len() as u32);
        let workers = Workers::new("gpu", threads, &Threads::default());
        let (slabs, any_over) = (Slabs::default(), Arc::default());
        Ok(Box::new(Self { id: id.clone(), parts, slabs, workers, any_over, warm: false }))
    }

    /// Finds the pairs slab by slab, `rounds` slabs for each GPU. Returns `false` if a slab is too large for its GPU.
    fn slabs(
        &mut self,
        rounds: usize,
        sample: &SceneStats,
        boxes: &[Aabb],
        pairs: &mut Pairs,
    ) -> Result<bool, Failure> {
        let Self { parts, slabs, workers, any_over, .. } = self;
        any_over.store(false, Ordering::Relaxed);
        let each: Vec<f64> = sizes(parts).iter().flat_map(|s| std::iter::repeat_n(s / rounds as f64, rounds)).collect();
        slabs.plan(sample, boxes, each.into_iter());
        debug_assert_eq!(slabs.count(), parts.len() * rounds);
        let slabs = &*slabs;
        for part in parts.iter_mut() {
            part.pairs.begin_part(pairs, any_over);
            part.begin();
        }
        for round in 0..rounds {
            workers.each(parts, |k, part| part.start(slabs, k * rounds + round, boxes));
            workers.each(parts, |_, part| part.finish(rounds));
            if parts.iter().any(|p| p.full) {
                return Ok(false);
            }
            if let Some(failure) = worst(parts) {
                return Err(failure);
            }
            if any_over.load(Ordering::Relaxed) {
                break;
            }
        }
        parts.iter().for_each(|p| pairs.append(&p.pairs));
        Ok(true)
    }

    /// Finds the pairs in as few slabs as fit into the GPUs.
    fn fitting_slabs(&mut self, sample: &SceneStats, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Failure> {
        let room: usize = self.parts.iter().map(|p| p.engine.most_objects()).sum();
        let mut rounds = boxes.len().div_ceil(room.max(1)).max(1);
        loop {
            pairs.clear();
            match self.slabs(rounds, sample, boxes, pairs) {
                Ok(true) => return Ok(()),
                Ok(false) if rounds < MOST_ROUNDS => rounds *= 2,
                Ok(false) => {
                    let reason = "too many boxes reach through too much of the scene to be cut into pieces";
                    return Err(Failure::limit(reason));
                }
                // A slab knows its own first invalid box, not the first of the frame.
                Err(Failure::Frame(error @ Error::InvalidBox { .. })) => {
                    return Err(Failure::Frame(Aabb::check(boxes, 0).err().unwrap_or(error)));
                }
                Err(failure) => return Err(failure),
            }
        }
    }
}

impl BroadPhase for OnGpus {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.find_pairs_with(&FramePlan::default(), boxes, pairs)
    }

    fn find_pairs_with(&mut self, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        self.warm |= boxes.len() > 1;
        if boxes.len() < 2 {
            Aabb::check(boxes, 0)?;
            return pairs.finish();
        }
        if boxes.len() > MOST_OBJECTS {
            let text = format!("{} boxes are more than the {MOST_OBJECTS} that a GPU can number", boxes.len());
            return Err(Failure::limit(text).of(&self.id));
        }
        // Without helpers, the caller copies alone.
        let _ = self.workers.start();
        let found = match self.parts.as_mut_slice() {
            [part] if boxes.len() <= part.engine.most_objects() => {
                pollster::block_on(part.engine.find(plan, boxes, pairs, &self.workers))
            }
            _ => {
                let found = self.fitting_slabs(&plan.stats(boxes), boxes, pairs);
                self.parts.iter_mut().for_each(|part| part.pairs.end_part());
                found
            }
        };
        match found {
            Ok(()) => pairs.finish_on(&self.workers),
            Err(failure) => Err(failure.of(&self.id)),
        }
    }

    fn prepare(&mut self, objects: usize) {
        let parts = self.parts.len();
        for part in &mut self.parts {
            let share = (objects / parts).min(part.engine.most_objects()) as u32;
            let params = part.engine.plan(share, Look::default);
            // The frame that needs the memory reports a refusal.
            let _ = part.engine.prepare(&params, parts > 1, None);
        }
        if !self.warm {
            let _ = self.find_pairs(&[Aabb::default(); 2], &mut Pairs::new());
        }
    }
}
