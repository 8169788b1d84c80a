//! A method on one or several GPUs, from boxes in host memory to pairs in host memory.

use super::adapters::Gpus;
use super::engine::{Engine, Piece};
use super::look::Look;
use super::slabs::{Members, Slabs};
use super::storage::{Failure, unavailable};
use crate::aabb::Aabb;
use crate::algorithm::{AlgorithmId, Backend, ParseIdError};
use crate::broad_phase::{BroadPhase, check_count};
use crate::cpu::{Threads, Workers};
use crate::error::{Error, GpuError};
use crate::load::{FramePlan, SampledBoxes, SceneStats};
use crate::pairs::Pairs;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Most boxes in a frame: the numbers of boxes have 31 bits on a GPU, and one more says who owns a pair.
const MOST_OBJECTS: usize = 1 << 30;

/// Slabs that a GPU takes one after the other, at most. Where the halo of a slab is most of the frame, more don't help.
const MOST_ROUNDS: usize = 64;

/// How fast the measured speed of a GPU follows its last frame.
const SPEED_FOLLOWS: f64 = 0.25;

/// The smallest share of the boxes that a GPU gets, so that its speed goes on being measured.
const SMALLEST_SHARE: f64 = 0.02;

/// Boxes to the power of the method's exponent: below, a frame takes as long as a GPU takes to answer, and its time says nothing
/// about how the GPU works.
const SMALLEST_WORK: f64 = 20_000.0;

/// See the module.
#[derive(Debug)]
pub(crate) struct OnGpus {
    id: AlgorithmId,
    parts: Vec<Share>,
    slabs: Slabs,
    workers: Workers,
    /// Whether one of the parts has exceeded the limit in this frame.
    any_over: Arc<AtomicBool>,
    /// By how much the work of a GPU grows with the logarithm of its boxes.
    exponent: f64,
    /// Whether its kernels have run: some drivers finish compiling when they first do.
    warm: bool,
}

/// The method `brute`, `sap`, `grid-sap` or `bvh` on GPUs that are open already: from boxes in host memory to pairs in host memory.
///
/// For programs that have opened a device of their own ([`Gpu::from_parts`](super::Gpu::from_parts)). Several GPUs share each
/// frame; they may be several devices of one adapter.
///
/// # Errors
/// [`Error::UnknownAlgorithm`] without a GPU or for another method; [`Error::Unavailable`] when a kernel does not compile or
/// memory is refused.
pub fn broad_phase(method: &str, gpus: Vec<super::Gpu>) -> Result<Box<dyn BroadPhase>, Error> {
    let mut indices: Vec<u32> = gpus.iter().map(|g| g.identity().index).collect();
    indices.sort_unstable();
    indices.dedup();
    let unknown = |e: ParseIdError| Error::UnknownAlgorithm { text: method.to_owned(), hint: e.to_string() };
    let id = AlgorithmId::new(method, Backend::Gpu(indices)).map_err(unknown)?;
    OnGpus::on(&id, gpus)
}

/// One GPU and what it works on.
#[derive(Debug)]
struct Share {
    engine: Engine,
    members: Members,
    pairs: Pairs,
    /// Work in a nanosecond; `None` before the first frame.
    speed: Option<f64>,
    work: f64,
    began: Option<Instant>,
    failure: Option<Failure>,
    /// Whether its slab has more boxes than fit.
    full: bool,
}

impl OnGpus {
    /// The algorithm `id`, whose backend is a list of GPUs. Compiles its kernels.
    pub(crate) fn create(id: &AlgorithmId, gpus: &Gpus) -> Result<Box<dyn BroadPhase>, Error> {
        let Backend::Gpu(indices) = id.backend() else {
            return Err(Error::Unavailable { algorithm: id.clone(), reason: "it is not on a GPU".into() });
        };
        let opened = indices.iter().map(|&k| gpus.open(k)).collect::<Result<Vec<_>, GpuError>>();
        Self::on(id, opened.map_err(|e| unavailable(id, e))?)
    }

    /// The same on open GPUs, which may be the same one several times.
    pub(crate) fn on(id: &AlgorithmId, gpus: Vec<super::Gpu>) -> Result<Box<dyn BroadPhase>, Error> {
        let part = |gpu| {
            let engine = Engine::new(gpu, id.method())?;
            let (members, pairs) = (Members::default(), Pairs::new());
            Ok(Share { engine, members, pairs, speed: None, work: 0.0, began: None, failure: None, full: false })
        };
        let parts = gpus.into_iter().map(part).collect::<Result<Vec<_>, GpuError>>().map_err(|e| unavailable(id, e))?;
        // A pool of its own, without pinning: its threads wait for drivers, whose own threads must find a core.
        let workers = Workers::new("gpu", parts.len() as u32, &Threads::default())?;
        let exponent = match id.method() {
            "brute" => 2.0,
            "sap" => 5.0 / 3.0,
            _ => 1.0,
        };
        Ok(Box::new(Self {
            id: id.clone(),
            parts,
            slabs: Slabs::default(),
            workers,
            any_over: Arc::default(),
            exponent,
            warm: false,
        }))
    }

    /// All boxes at once on the one GPU that there is.
    fn whole(part: &mut Share, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Failure> {
        let params = part.engine.plan(boxes.len() as u32, || Look::of(&SampledBoxes::from(boxes), plan.stats(boxes)));
        part.engine.start(Piece { boxes, ids: None }, params)?;
        part.engine.finish(pairs)
    }

    /// In slabs: as many as there are GPUs, or that many times `rounds`. `false` when a slab is too large for its GPU.
    fn slabs(
        &mut self,
        rounds: usize,
        sample: &SceneStats,
        boxes: &[Aabb],
        pairs: &mut Pairs,
    ) -> Result<bool, Failure> {
        let Self { parts, slabs, workers, any_over, exponent, .. } = self;
        any_over.store(false, Ordering::Relaxed);
        let exponent = *exponent;
        let shares: Vec<f64> = shares(parts.iter().map(|p| p.speed), exponent);
        let each = shares.iter().flat_map(|s| std::iter::repeat_n(s / rounds as f64, rounds)).collect::<Vec<_>>();
        slabs.plan(sample, boxes, each.into_iter());
        debug_assert_eq!(slabs.count(), parts.len() * rounds);
        let slabs = &*slabs;
        for part in parts.iter_mut() {
            part.pairs.begin_part(pairs, any_over);
            part.work = 0.0;
            part.began = None;
        }
        for round in 0..rounds {
            workers.each(parts, |k, part| part.start(slabs, k * rounds + round, boxes, exponent));
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
}

impl Share {
    fn start(&mut self, slabs: &Slabs, slab: usize, boxes: &[Aabb], exponent: f64) {
        self.began.get_or_insert_with(Instant::now);
        // What a slab before this one left says nothing of it, even where its gathering fails.
        (self.failure, self.full) = (None, false);
        match slabs.gather(slab, boxes, self.engine.most_objects(), &mut self.members) {
            Ok(fits) => self.full = !fits,
            Err(error) => self.failure = Some(Failure::Frame(error)),
        }
        if self.full || self.failure.is_some() || self.members.boxes.is_empty() {
            return;
        }
        let Members { boxes, ids } = &self.members;
        self.work += (boxes.len() as f64).powf(exponent);
        let params = self.engine.plan(boxes.len() as u32, || Look::at(&SampledBoxes::from(boxes)));
        self.failure = self.engine.start(Piece { boxes, ids: Some(ids) }, params).err().map(Failure::Gpu);
    }

    fn finish(&mut self, rounds: usize) {
        if self.full || self.failure.is_some() {
            return;
        }
        self.failure = self.engine.finish(&mut self.pairs).err();
        if let Some(began) = self.began.filter(|_| self.failure.is_none() && rounds == 1 && self.work > SMALLEST_WORK) {
            let speed = self.work / began.elapsed().as_nanos().max(1) as f64;
            self.speed = Some(self.speed.map_or(speed, |before| before + SPEED_FOLLOWS * (speed - before)));
        }
    }
}

/// The share of the boxes that each GPU gets, so that all take the same time.
fn shares(speeds: impl Iterator<Item = Option<f64>>, exponent: f64) -> Vec<f64> {
    let speeds: Vec<Option<f64>> = speeds.collect();
    let known: Option<Vec<f64>> = speeds.iter().map(|s| s.map(|v| v.powf(1.0 / exponent))).collect();
    let weights = known.unwrap_or_else(|| vec![1.0; speeds.len()]);
    let total: f64 = weights.iter().sum();
    let bounded: Vec<f64> = weights.iter().map(|w| (w / total).max(SMALLEST_SHARE)).collect();
    let total: f64 = bounded.iter().sum();
    bounded.iter().map(|w| w / total).collect()
}

/// The failure to report: a fault of a GPU first, because the frame is then to be run elsewhere.
fn worst(parts: &mut [Share]) -> Option<Failure> {
    let failures: Vec<Failure> = parts.iter_mut().filter_map(|p| p.failure.take()).collect();
    failures.iter().find(|f| matches!(f, Failure::Gpu(_))).or(failures.first()).cloned()
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
        let found = match self.parts.as_mut_slice() {
            [part] if boxes.len() <= part.engine.most_objects() => Self::whole(part, plan, boxes, pairs),
            parts => {
                let sample = plan.stats(boxes);
                let room: usize = parts.iter().map(|p| p.engine.most_objects()).sum();
                let mut rounds = boxes.len().div_ceil(room.max(1)).max(1);
                let found = loop {
                    pairs.clear();
                    match self.slabs(rounds, &sample, boxes, pairs) {
                        Ok(true) => break Ok(()),
                        Ok(false) if rounds < MOST_ROUNDS => rounds *= 2,
                        Ok(false) => {
                            let reason = "too many boxes reach through too much of the scene to be cut into pieces";
                            break Err(Failure::limit(reason));
                        }
                        // A slab knows its own first invalid box; which is the first of all only the whole frame tells.
                        Err(Failure::Frame(error @ Error::InvalidBox { .. })) => {
                            break Err(Failure::Frame(Aabb::check(boxes, 0).err().unwrap_or(error)));
                        }
                        Err(failure) => break Err(failure),
                    }
                };
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
            // A refused allocation is reported by the frame that needs it.
            let _ = part.engine.prepare(&params, parts > 1, None);
        }
        if !self.warm {
            let _ = self.find_pairs(&[Aabb::default(); 2], &mut Pairs::new());
        }
    }
}
