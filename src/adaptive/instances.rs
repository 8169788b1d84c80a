//! The algorithms to choose from, and what runs them.

use super::warming::Place;
use crate::aabb::Aabb;
use crate::algorithm::{AlgorithmId, Backend};
use crate::broad_phase::{BroadPhase, FrameWork};
use crate::error::{Error, Unavailable};
use crate::load::FramePlan;
use crate::pairs::Pairs;
use crate::registry::Registry;
use crate::tuning::Tuning;

/// An algorithm of the tuning.
pub(crate) struct Candidate {
    pub(super) id: AlgorithmId,
    /// Its position among the instances; `None` once it failed, or where it can't run.
    pub(super) instance: Option<usize>,
}

/// Runs one candidate, or several that differ in their number of threads only and share what they keep from frame to
/// frame.
pub(crate) struct Instance {
    place: Place,
    /// Whether it may wait for a driver while it gets ready.
    waits: bool,
    /// Whether it builds on the frame before.
    pub(super) is_incremental: bool,
    /// Where several share it, on how many threads it runs.
    threads: Option<u32>,
    /// Objects that its buffers are ready for.
    ready: usize,
    /// The first frame since its last one that another one ran and of which it was not told; `None` while it goes on,
    /// and before its first.
    left_at: Option<u64>,
}

impl Instance {
    fn new(id: &AlgorithmId, algorithm: Box<dyn BroadPhase>, threads: Option<u32>) -> Self {
        let is_incremental = algorithm.is_incremental();
        let waits = matches!(id.backend(), Backend::Gpu(_));
        Self { place: Place::Here(algorithm), waits, is_incremental, threads, ready: 0, left_at: None }
    }

    /// Gets it ready for frames of that many objects, now.
    pub(super) fn prepare(&mut self, objects: usize) {
        self.place.wait();
        if let Some(algorithm) = self.place.here() {
            algorithm.prepare(objects);
            self.ready = self.ready.max(objects);
        }
    }

    /// The same within a frame: what may wait for a driver does so on a thread of its own.
    pub(super) fn warm(&mut self, objects: usize) {
        // What is away for fewer is cold once more when it comes back.
        if self.is_away() {
            return;
        }
        if self.waits {
            self.ready = self.ready.max(objects);
            self.place.send(objects);
        } else {
            self.prepare(objects);
        }
    }

    /// Whether that is still to be done for so many objects.
    pub(super) fn is_cold(&self, objects: usize) -> bool {
        self.ready < objects
    }

    /// Takes it back from that thread if it is ready, or else with `patience` when it is. Whether it has come back.
    pub(super) fn take_back(&mut self, patience: bool) -> bool {
        let away = self.is_away();
        if patience {
            self.place.wait();
        } else {
            self.place.take_back();
        }
        away && !self.is_away()
    }

    pub(super) fn is_away(&self) -> bool {
        self.place.is_away()
    }

    /// Whether it can run: it is neither away nor did it panic there.
    pub(super) fn is_here(&mut self) -> bool {
        self.place.here().is_some()
    }

    /// Another one ran this frame, and it the one before.
    pub(super) fn leave(&mut self, frame: u64) {
        self.left_at = Some(frame);
    }

    /// Finds the pairs of this frame. Returns how the frame came about where one may build on the one before.
    pub(super) fn run(
        &mut self,
        id: &AlgorithmId,
        frame: u64,
        plan: &FramePlan,
        boxes: &[Aabb],
        pairs: &mut Pairs,
    ) -> Result<Option<FrameWork>, Error> {
        let Some(algorithm) = self.place.here() else {
            return Err(Error::Unavailable { algorithm: id.clone(), reason: Unavailable::FailedBefore });
        };
        let wanted = id.threads();
        if self.threads.is_some_and(|threads| threads != wanted) {
            if !algorithm.set_threads(wanted) {
                let reason = Unavailable::FixedThreads { wanted };
                return Err(Error::Unavailable { algorithm: id.clone(), reason });
            }
            self.threads = Some(wanted);
        }
        if let Some(left_at) = self.left_at.filter(|_| self.is_incremental) {
            algorithm.missed_frames(frame - left_at);
            // Should this frame fail, those up to it are told.
            self.left_at = Some(frame);
        }
        algorithm.find_pairs_with(plan, boxes, pairs)?;
        self.left_at = None;
        self.ready = self.ready.max(boxes.len());
        Ok(self.work())
    }

    /// Finds the pairs of a frame of which nothing was worked out, for the same candidate as in the last frame.
    /// `None` where that can't run.
    pub(super) fn go_on(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Option<Result<Option<FrameWork>, Error>> {
        let algorithm = self.place.here()?;
        let found = algorithm.find_pairs(boxes, pairs).map(|()| self.work());
        self.ready = self.ready.max(boxes.len());
        Some(found)
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
    pub(super) candidates: Vec<Candidate>,
    pub(super) instances: Vec<Instance>,
    pub(super) failure: Option<Error>,
}

impl Instances {
    /// Of each candidate where it finds what the frame before left: one number for all that share it. `None` where
    /// nothing is kept.
    pub(super) fn kept(&self) -> Vec<Option<usize>> {
        let keeps = |c: &Candidate| c.instance.filter(|&k| self.instances[k].is_incremental);
        self.candidates.iter().map(keeps).collect()
    }

    /// Which candidates can run.
    pub(super) fn usable(&self) -> Vec<bool> {
        self.candidates.iter().map(|c| c.instance.is_some()).collect()
    }

    /// Why none of the algorithms can run; `None` where one can.
    pub fn failure(&mut self) -> Option<Error> {
        if self.instances.is_empty() { Some(self.failure.take().unwrap_or(Error::NoAlgorithm)) } else { None }
    }

    /// Makes the algorithms of a tuning, those that differ in their number of threads only as one where they can be.
    pub fn of(tuning: &Tuning, registry: &Registry) -> Self {
        let ids = tuning.algorithms();
        let mut made = Self {
            registry: registry.clone(),
            candidates: ids.iter().map(|&id| Candidate { id: id.clone(), instance: None }).collect(),
            instances: Vec::new(),
            failure: None,
        };
        let stale = |id: &AlgorithmId| {
            let cost = tuning.costs.iter().find(|c| c.algorithm == *id);
            cost.and_then(|c| registry.mismatch(id, c.revision)).map_or(Ok(()), Err)
        };
        for (k, &id) in ids.iter().enumerate() {
            if made.candidates[k].instance.is_some() {
                continue;
            }
            if let Err(why) = stale(id) {
                made.failure = Some(why);
                continue;
            }
            // Those that differ from it in their number of threads only and can run here.
            let runs = |id: &AlgorithmId| !registry.entries().iter().any(|e| e.id == *id && e.unavailable.is_some());
            let kin = |other: &&AlgorithmId| {
                let alike = other.method() == id.method() && other.backend().class() == id.backend().class();
                alike && runs(other) && stale(other).is_ok()
            };
            let family: Vec<&AlgorithmId> = ids.iter().copied().filter(kin).collect();
            let whole = if family.contains(&id) { registry.create_family(&family).ok().flatten() } else { None };
            if let Some(algorithm) = whole {
                for candidate in made.candidates.iter_mut().filter(|c| family.contains(&&c.id)) {
                    candidate.instance = Some(made.instances.len());
                }
                // On none of them yet, so that the first frame sets it.
                made.instances.push(Instance::new(id, algorithm, Some(0)));
                continue;
            }
            match registry.create(id) {
                Ok(algorithm) => {
                    made.candidates[k].instance = Some(made.instances.len());
                    made.instances.push(Instance::new(id, algorithm, None));
                }
                Err(why) => made.failure = Some(why),
            }
        }
        made
    }
}
