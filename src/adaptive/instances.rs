//! The algorithms to choose from, and what runs them.

use super::warming::Place;
use crate::aabb::Aabb;
use crate::algorithm::{AlgorithmId, Backend};
use crate::broad_phase::{BroadPhase, FrameWork};
use crate::error::{Error, Unavailable};
use crate::load::FramePlan;
use crate::pairs::Pairs;
use crate::registry::{Registry, built_in};
use crate::tuning::Tuning;

/// What runs an algorithm of the tuning.
pub(crate) struct Instance {
    pub(super) place: Place,
    pub(super) id: AlgorithmId,
    /// Whether it may wait for a driver while it gets ready.
    waits: bool,
    /// Whether it builds on the frame before.
    pub(super) is_incremental: bool,
    /// Objects that its buffers are ready for.
    pub(super) ready: usize,
    /// The first frame since its last one that another one ran and of which it was not told; `None` while it goes on,
    /// and before its first.
    pub(super) left_at: Option<u64>,
}

impl Instance {
    /// Without `algorithm` it can't run.
    fn new(id: &AlgorithmId, algorithm: Option<Box<dyn BroadPhase>>) -> Self {
        let is_incremental = algorithm.as_ref().is_some_and(|algorithm| algorithm.is_incremental());
        let waits = matches!(id.backend(), Backend::Gpu(_));
        let place = algorithm.map_or(Place::Gone, Place::Here);
        Self { place, id: id.clone(), waits, is_incremental, ready: 0, left_at: None }
    }

    /// Gets it ready for frames of that many objects, now.
    pub(super) fn prepare(&mut self, objects: usize) {
        self.place.take_back(true);
        if let Some(algorithm) = self.place.here() {
            algorithm.prepare(objects);
            self.ready = self.ready.max(objects);
        }
    }

    /// The same within a frame: what may wait for a driver does so on a thread of its own.
    pub(super) fn warm(&mut self, objects: usize) {
        // What is away for fewer is cold once more when it comes back.
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

    /// Finds the pairs of this frame. Returns how the frame came about where one may build on the one before.
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
            // Should this frame fail, those up to it are told.
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

    /// How the last frame came about, where one may build on the one before. Checked once more: the fields are
    /// anybody's to set.
    fn work(&mut self) -> Option<FrameWork> {
        let algorithm = self.place.here().filter(|_| self.is_incremental)?;
        let work = algorithm.last_frame();
        Some(FrameWork::new(work.kind, work.over_mean))
    }
}

/// What runs the algorithms of some tuning, and why the last of those that can't run can't.
pub struct Instances {
    /// What made them.
    pub(super) registry: Registry,
    /// In the order of [`Tuning::algorithms`].
    pub(super) instances: Vec<Instance>,
    pub(super) failure: Option<Error>,
}

impl Instances {
    /// Numbers the states that candidates keep from frame to frame; `None` for one that keeps nothing. If a method fits
    /// its threads to a frame, its candidates have one number together, and only one of them runs.
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

    /// Which can run.
    pub(super) fn usable(&self) -> Vec<bool> {
        self.instances.iter().map(|one| one.place.is_here()).collect()
    }

    /// Why none of the algorithms can run; `None` where one can.
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
