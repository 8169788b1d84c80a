//! One of the GPUs that share a frame, and how much of it each gets.

use super::slabs::Members;
use super::{Engine, Failure, Gpu, Look, Slabs};
use sapwise::error::GpuError;
use sapwise::internals::{SampledBoxes, Workers};
use sapwise::{Aabb, Pairs};
use std::time::Instant;

/// Weight of the last frame in the measured speed of a GPU.
const SPEED_FOLLOWS: f64 = 0.25;

/// The smallest share of the boxes that a GPU gets, so that its speed goes on being measured.
const SMALLEST_SHARE: f64 = 0.02;

/// Work below which a frame's time is mostly latency and says nothing about the GPU's speed. In boxes to the power of
/// the method's growth.
const SMALLEST_WORK: f64 = 20_000.0;

/// A GPU with its part of the frame.
#[derive(Debug)]
pub(super) struct Share {
    pub(super) engine: Engine,
    members: Members,
    pub(super) pairs: Pairs,
    /// Work in a nanosecond; `None` before the first frame.
    speed: Option<f64>,
    work: f64,
    began: Option<Instant>,
    failure: Option<Failure>,
    /// Whether its slab has more boxes than fit.
    pub(super) full: bool,
}

impl Share {
    pub(super) fn new(gpu: Gpu, method: &str) -> Result<Self, GpuError> {
        Ok(Self {
            engine: Engine::new(gpu, method)?,
            members: Members::default(),
            pairs: Pairs::new(),
            speed: None,
            work: 0.0,
            began: None,
            failure: None,
            full: false,
        })
    }

    /// Begins a frame of slabs.
    pub(super) fn begin(&mut self) {
        (self.work, self.began) = (0.0, None);
    }

    /// Gathers and submits a slab.
    pub(super) fn start(&mut self, slabs: &Slabs, slab: usize, boxes: &[Aabb]) {
        self.began.get_or_insert_with(Instant::now);
        (self.failure, self.full) = (None, false);
        match slabs.gather(slab, boxes, self.engine.most_objects(), &mut self.members) {
            Ok(fits) => self.full = !fits,
            Err(error) => self.failure = Some(Failure::Frame(error)),
        }
        if self.full || self.failure.is_some() || self.members.boxes.is_empty() {
            return;
        }
        if let Err(error) = self.engine.filter_for(&self.pairs) {
            self.failure = Some(Failure::Gpu(error));
            return;
        }
        let Members { boxes, ids } = &self.members;
        self.work += (boxes.len() as f64).powf(self.engine.search.growth());
        let look = || Look::at(&SampledBoxes::from(boxes.as_slice()));
        let plan = |engine: &Engine| engine.plan(boxes.len() as u32, look);
        let started = pollster::block_on(self.engine.start(boxes, Some(ids), plan, &Workers::one()));
        self.failure = started.err().map(Failure::Gpu);
    }

    /// Waits for the slab. The first of `rounds` slabs counts for the speed only if there are no others.
    pub(super) fn finish(&mut self, rounds: usize) {
        if self.full || self.failure.is_some() {
            return;
        }
        self.failure = pollster::block_on(self.engine.finish(&mut self.pairs, &Workers::one())).err();
        if let Some(began) = self.began.filter(|_| self.failure.is_none() && rounds == 1 && self.work > SMALLEST_WORK) {
            let speed = self.work / began.elapsed().as_nanos().max(1) as f64;
            self.speed = Some(self.speed.map_or(speed, |before| before + SPEED_FOLLOWS * (speed - before)));
        }
    }
}

/// Returns the share of the boxes for each GPU, so that all take the same time.
pub(super) fn sizes(parts: &[Share]) -> Vec<f64> {
    let known: Option<Vec<f64>> =
        parts.iter().map(|part| part.speed.map(|speed| speed.powf(1.0 / part.engine.search.growth()))).collect();
    let weights = known.unwrap_or_else(|| vec![1.0; parts.len()]);
    let total: f64 = weights.iter().sum();
    let bounded: Vec<f64> = weights.iter().map(|w| (w / total).max(SMALLEST_SHARE)).collect();
    let total: f64 = bounded.iter().sum();
    bounded.iter().map(|w| w / total).collect()
}

/// Returns the failure to report. Faults of GPUs come first, because the frame can then run elsewhere.
pub(super) fn worst(parts: &mut [Share]) -> Option<Failure> {
    let failures: Vec<Failure> = parts.iter_mut().filter_map(|p| p.failure.take()).collect();
    failures.iter().find(|f| matches!(f, Failure::Gpu(_))).or(failures.first()).cloned()
}
