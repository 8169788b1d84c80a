//! The instances of the algorithms to choose from.

use super::warming::Place;
use crate::aabb::Aabb;
use crate::algorithm::{AlgorithmId, Backend};
use crate::broad_phase::{BroadPhase, FrameWork};
use crate::error::{Error, Unavailable};
use crate::load::FramePlan;
use crate::pairs::Pairs;
use crate::registry::{Registry, built_in};
use crate::tuning::Tuning;

/// An instance of an algorithm of the tuning.
pub(crate) struct Instance {
    pub(super) place: Place,
    pub(super) id: AlgorithmId,
    /// Whether it may wait for a driver while it is prepared.
    waits: bool,
    /// Whether it builds on the previous frame.
    pub(super) is_incremental: bool,
    /// Number of objects that its buffers are prepared for.
    pub(super) ready: usize,
    /// The first missed frame that was not reported to it yet; `None` while it runs, and before its first frame.
    pub(super) left_at: Option<u64>,
}

impl Instance {
    /// Makes an instance, which can't run without `algorithm`.
    fn new(id: &AlgorithmId, algorithm: Option<Box<dyn BroadPhase>>) -> Self {
        let is_incremental = algorithm.as_ref().is_some_and(|algorithm| algorithm.is_incremental());
        let waits = matches!(id.backend(), Backend::Gpu(_));
        let place = algorithm.map_or(Place::Gone, Place::Here);
        Self { place, id: id.clone(), waits, is_incremental, ready: 0, left_at: None }
    }

    /// Prepares it for frames of `objects` boxes, on this thread.
    pub(super) fn prepare(&mut self, objects: usize) {
        self.place.take_back(true);
        if let Some(algorithm) = self.place.here() {
            algorithm.prepare(objects);
            self.ready = self.ready.max(objects);
        }
    }

    /// Prepares it within a frame: on a thread of its own if it may wait for a driver.
    pub(super) fn warm(&mut self, objects: usize) {
        // If it is away for fewer objects, the caller prepares it again when it is back.
        if self.place.is_away() {
            return;
        }
        if self.waits {
            self.ready = self.ready.max(objects);
            self.place.send(objects);
        } else {
            self.prepare(objects);
        }
    }

    /// Finds the pairs of this frame. Returns the work of the frame if the algorithm is incremental.
    pub(super) fn run(
        &mut self,
        frame: u64,
        plan: &FramePlan,
        boxes: &[Aabb],
        pairs: &mut Pairs,
    ) -> Result<Option<FrameWork>, Error> {
        let Some(algorithm) = self.place.here() else { return Err(self.gone()) };
        if let Some(left_at) = self.left_at.filter(|&left_at| self.is_incremental && left_at < frame) {
            algorithm.missed_frames(frame - left_at);
            // If this frame fails, the frames up to it are reported already.
            self.left_at = Some(frame);
        }
        algorithm.find_pairs_with(plan, boxes, pairs)?;
        self.left_at = None;
        self.ready = self.ready.max(boxes.len());
        Ok(self.work())
    }

    /// Does the same without a plan, if this instance also ran the previous frame.
    pub(super) fn go_on(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<Option<FrameWork>, Error> {
        let Some(algorithm) = self.place.here() else { return Err(self.gone()) };
        let found = algorithm.find_pairs(boxes, pairs).map(|()| self.work());
        self.ready = self.ready.max(boxes.len());
        found
    }

    #[cold]
    fn gone(&self) -> Error {
        Error::Unavailable { algorithm: self.id.clone(), reason: Unavailable::FailedBefore }
    }

    /// Returns the work of the last frame if the algorithm is incremental. Checks it again, because its fields are
    /// public.
    fn work(&mut self) -> Option<FrameWork> {
        let algorithm = self.place.here().filter(|_| self.is_incremental)?;
        let work = algorithm.last_frame();
        Some(FrameWork::new(work.kind, work.over_mean))
    }
}

/// The instances of the algorithms of a tuning.
pub struct Instances {
    /// The registry that made them.
    pub(super) registry: Registry,
    /// In the order of [`Tuning::algorithms`].
    pub(super) instances: Vec<Instance>,
    /// Why the last of those that can't run can't.
    pub(super) failure: Option<Error>,
}

impl Instances {
    /// Returns the number of the state that each candidate keeps from frame to frame; `None` if it keeps none. The
    /// candidates of a method that fits its threads to a frame share one number, and only one of them runs.
    pub(super) fn kept(&self) -> Vec<Option<usize>> {
        let fits = |one: &Instance| built_in(&one.id).is_some_and(|method| method.fits_threads);
        let first =
            |id: &AlgorithmId| self.instances.iter().position(|one| one.id.method() == id.method() && fits(one));
        let kept = |(k, one): (usize, &Instance)| match one.is_incremental {
            true if fits(one) => first(&one.id),
            incremental => incremental.then_some(k),
        };
        self.instances.iter().enumerate().map(kept).collect()
    }

    /// Returns which can run.
    pub(super) fn usable(&self) -> Vec<bool> {
        self.instances.iter().map(|one| one.place.is_here()).collect()
    }

    /// Returns why no algorithm can run, or `None` if one can.
    pub fn failure(&mut self) -> Option<Error> {
        let none = !self.usable().contains(&true);
        none.then(|| self.failure.take().unwrap_or(Error::NoAlgorithm))
    }

    /// Makes the algorithms of a tuning.
    pub fn of(tuning: &Tuning, registry: &Registry) -> Self {
        let mut failure = None;
        let instance = |id: &AlgorithmId| {
            let cost = tuning.costs.iter().find(|c| c.algorithm == *id);
            let stale = cost.and_then(|c| registry.mismatch(id, c.revision));
            let made = stale.map_or_else(|| registry.create(id), Err);
            Instance::new(id, made.map_err(|why| failure = Some(why)).ok())
        };
        let instances = tuning.algorithms().into_iter().map(instance).collect();
        Self { registry: registry.clone(), instances, failure }
    }
}
