//! The in-line module: the cheapest algorithm for this frame, chosen before it runs.

use crate::{Aabb, AlgorithmId, BroadPhase, Displacement, Error, Fields, Load, Pairs, Registry, Source, Step};
use std::fmt;

/// A switch must promise to save at least this share of a frame. Without it the choice would flicker at a border, where
/// two costs are equal and the estimate of the load moves by a few percent from frame to frame.
const HYSTERESIS: f64 = 0.05;

/// Frames after which the boxes are sampled anew even if their number has not changed. A sample takes 16 us at 10 000 objects and
/// 25 us at a million on the first machine; spread over 32 frames a decision among six stays below 1 us.
const SAMPLE_EVERY: u32 = 32;

/// A change of the number of objects within a sixteenth, or within this many, needs no new sample. In a scene of a few boxes
/// the sample costs as much as the frame.
const SAMPLE_DRIFT: u32 = 16;

/// A runner-up that costs at most this much more than the choice gets its buffers ready: the next border may be near.
const WARM_WITHIN: f64 = 1.5;

/// A broad phase that runs whichever algorithm its [`Fields`] call cheapest for each frame.
///
/// Every algorithm takes the same boxes and gives the same pairs, so a switch is invisible but for its speed.
pub struct Adaptive {
    fields: Fields,
    /// In the order of [`Fields::algorithms`].
    candidates: Vec<Candidate>,
    current: Option<usize>,
    load: Load,
    /// Objects when the load was sampled, and frames since.
    sampled: u32,
    age: u32,
    displacement: Displacement,
    watching: Watching,
    /// Objects and pairs of the frame before.
    before: Option<(u32, u64)>,
    choice: Option<Choice>,
}

/// How far the boxes move is found out in the frame after each sample.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Watching {
    /// It is known.
    Done,
    /// It was sampled; this frame is to be watched when its pairs are found.
    Due,
    /// The next frame is to be compared with what was watched.
    Begun,
}

struct Candidate {
    id: AlgorithmId,
    /// `None` once it failed, or where it can't run.
    algorithm: Option<Box<dyn BroadPhase>>,
    /// Objects that its buffers are ready for.
    ready: u32,
}

/// A decision by position, without a copy of any name.
#[derive(Clone, Copy)]
struct Choice {
    chosen: usize,
    predicted_ns: Option<f64>,
    runner_up: Option<(usize, f64)>,
    reason: Reason,
    load: Load,
}

/// Why an algorithm was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// The first frame: nothing ran before.
    First,
    /// It ran before and is still the cheapest.
    Stayed,
    /// Another would be cheaper, but by too little to switch.
    Hysteresis,
    /// It became cheaper than the one before.
    Switched,
    /// The one that was chosen failed in this frame.
    FellBack,
}

/// The last decision and what it rested on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision<'a> {
    /// The algorithm that ran.
    pub algorithm: &'a AlgorithmId,
    /// Its predicted cost in nanoseconds; `None` where only the number of objects decides.
    pub predicted_ns: Option<f64>,
    /// The cheapest of the others and its predicted cost in nanoseconds.
    pub runner_up: Option<(&'a AlgorithmId, f64)>,
    /// Why it was chosen.
    pub reason: Reason,
    /// Where the costs came from.
    pub source: Source,
    /// The load that was estimated.
    pub load: Load,
}

impl Adaptive {
    /// An adaptive broad phase over those algorithms of `fields` that `registry` can make.
    ///
    /// An algorithm whose cost was found for another revision is left out, and so is one with more threads than the registry
    /// lists: its cost says nothing about this build or this machine.
    ///
    /// # Errors
    /// [`Error::Unavailable`] or [`Error::UnknownAlgorithm`] when none can be made.
    pub fn new(fields: Fields, registry: &Registry) -> Result<Self, Error> {
        let mut failure = None;
        let mut candidates = Vec::new();
        for id in fields.algorithms() {
            let stale = fields.costs.iter().find(|c| c.algorithm == *id).and_then(|c| registry.mismatch(id, c.revision));
            let made = stale.map_or_else(|| registry.create(id), Err);
            let algorithm = made.map_err(|e| failure = Some(e)).ok();
            candidates.push(Candidate { id: id.clone(), algorithm, ready: 0 });
        }
        if candidates.iter().all(|c| c.algorithm.is_none()) {
            let hint = || "these fields name no algorithm; make them with `sapwise predict`".to_owned();
            return Err(failure.unwrap_or_else(|| Error::UnknownAlgorithm { text: String::new(), hint: hint() }));
        }
        Ok(Self {
            fields,
            candidates,
            current: None,
            load: Load::default(),
            sampled: 0,
            age: 0,
            displacement: Displacement::default(),
            watching: Watching::Done,
            before: None,
            choice: None,
        })
    }

    /// Runs one algorithm always.
    ///
    /// # Errors
    /// As [`Registry::create`].
    pub fn only(algorithm: AlgorithmId, registry: &Registry) -> Result<Self, Error> {
        let steps = vec![Step { from_objects: 0, algorithm }];
        let fields = Fields::from_steps(steps).map_err(|hint| Error::UnknownAlgorithm { text: String::new(), hint })?;
        Self::new(fields, registry)
    }

    /// The fields that decide.
    #[must_use]
    pub fn fields(&self) -> &Fields {
        &self.fields
    }

    /// What was decided for the last frame; `None` before the first.
    #[must_use]
    pub fn last_decision(&self) -> Option<Decision<'_>> {
        self.choice.map(|c| Decision {
            algorithm: &self.candidates[c.chosen].id,
            predicted_ns: c.predicted_ns,
            runner_up: c.runner_up.map(|(k, ns)| (&self.candidates[k].id, ns)),
            reason: c.reason,
            source: self.fields.source,
            load: c.load,
        })
    }

    /// Estimates the load of the next frame and decides, without running anything.
    pub fn decide(&mut self, boxes: &[Aabb]) -> Option<Decision<'_>> {
        self.observe(boxes);
        self.choose();
        self.last_decision()
    }

    /// Brings the load up to date: sampled when the scene has grown, shrunk or aged, else scaled from the last sample.
    fn observe(&mut self, boxes: &[Aabb]) {
        let objects = u32::try_from(boxes.len()).unwrap_or(u32::MAX);
        let pairs = self.before.map(|(n, pairs)| scaled(pairs as f64, objects, n));
        if self.watching == Watching::Begun {
            self.load.moved = self.displacement.moved(boxes).unwrap_or(1.0);
            self.watching = Watching::Done;
        }
        let drift = objects.abs_diff(self.sampled);
        if self.before.is_none() || self.age >= SAMPLE_EVERY || drift > (self.sampled / 16).max(SAMPLE_DRIFT) {
            self.load = Load::estimate(boxes, pairs, self.before.map(|_| self.load.moved));
            self.watching = Watching::Due;
            self.sampled = objects;
            self.age = 0;
            return;
        }
        self.age += 1;
        let pairs = pairs.unwrap_or(self.load.pairs);
        self.load = self.load.rescaled(objects, pairs);
    }

    fn choose(&mut self) {
        let load = self.load;
        let usable = |k: usize| self.candidates[k].algorithm.is_some();
        let Some(ranking) = self.fields.rank(&load, usable) else {
            self.choice = self.choose_by_count();
            return;
        };
        let mut choice = Choice {
            chosen: ranking.best,
            predicted_ns: Some(ranking.best_ns),
            runner_up: ranking.runner_up,
            reason: Reason::Switched,
            load,
        };
        match self.current {
            None => choice.reason = Reason::First,
            Some(current) if current == ranking.best => choice.reason = Reason::Stayed,
            Some(current) if usable(current) => {
                let now = self.fields.costs[current].curve.cost_ns(&load);
                if ranking.best_ns > now * (1.0 - HYSTERESIS) {
                    choice.chosen = current;
                    choice.predicted_ns = Some(now);
                    choice.runner_up = Some((ranking.best, ranking.best_ns));
                    choice.reason = Reason::Hysteresis;
                }
            }
            Some(_) => choice.reason = Reason::FellBack,
        }
        self.choice = Some(choice);
    }

    /// The step that holds at this number of objects, or the nearest below or above that can run.
    fn choose_by_count(&self) -> Option<Choice> {
        let objects = self.load.objects;
        let position = |s: &Step| self.candidates.iter().position(|c| c.id == s.algorithm && c.algorithm.is_some());
        let split = self.fields.steps.partition_point(|s| s.from_objects <= objects);
        let (below, above) = self.fields.steps.split_at(split);
        let chosen = below.iter().rev().chain(above).find_map(position)?;
        // The present one stays where it would hold a little below or above: only its own borders count.
        let holds = |current: usize, share: f64| {
            let step = self.fields.step((f64::from(objects) * share) as u32);
            step.is_some_and(|s| s.algorithm == self.candidates[current].id)
        };
        let (chosen, reason) = match self.current {
            None => (chosen, Reason::First),
            Some(current) if current == chosen => (chosen, Reason::Stayed),
            Some(current) if self.candidates[current].algorithm.is_none() => (chosen, Reason::FellBack),
            Some(current) if holds(current, 1.0 - HYSTERESIS) || holds(current, 1.0 + HYSTERESIS) => {
                (current, Reason::Hysteresis)
            }
            Some(_) => (chosen, Reason::Switched),
        };
        Some(Choice { chosen, predicted_ns: None, runner_up: None, reason, load: self.load })
    }

    /// Gets the runner-up ready when its turn may come soon.
    fn warm_runner_up(&mut self) {
        let Some(Choice { predicted_ns: Some(best), runner_up: Some((next, ns)), load, .. }) = self.choice else { return };
        let candidate = &mut self.candidates[next];
        if ns > best * WARM_WITHIN || candidate.ready >= load.objects {
            return;
        }
        if let Some(algorithm) = &mut candidate.algorithm {
            // By powers of two, so that a growing scene pays for this a few times in all.
            candidate.ready = load.objects.checked_next_power_of_two().unwrap_or(u32::MAX);
            algorithm.prepare(candidate.ready as usize);
        }
    }
}

impl BroadPhase for Adaptive {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.observe(boxes);
        self.choose();
        loop {
            let Some(choice) = self.choice else {
                let reason = "every algorithm of the fields has failed".to_owned();
                let algorithm = self.candidates[self.current.unwrap_or(0)].id.clone();
                return Err(Error::Unavailable { algorithm, reason });
            };
            let candidate = &mut self.candidates[choice.chosen];
            let Some(algorithm) = candidate.algorithm.as_mut() else {
                // Choosing leaves out what failed. Were it to come here all the same, no answer is better than an old one.
                return Err(Error::Unavailable { algorithm: candidate.id.clone(), reason: "it failed before".to_owned() });
            };
            let result = algorithm.find_pairs(boxes, pairs);
            self.current = Some(choice.chosen);
            match result {
                Ok(()) => {
                    candidate.ready = candidate.ready.max(choice.load.objects);
                    self.before = Some((choice.load.objects, pairs.len() as u64));
                    // Not while observing: `decide` and `find_pairs` may both observe one frame, and it has not moved in between.
                    if self.watching == Watching::Due {
                        self.displacement.watch(boxes);
                        self.watching = Watching::Begun;
                    }
                    self.warm_runner_up();
                    return Ok(());
                }
                // The algorithm is at fault, not the boxes: the next cheapest runs in this same frame.
                Err(Error::Unavailable { .. }) => {
                    candidate.algorithm = None;
                    self.choose();
                }
                Err(error) => {
                    self.before = None;
                    return Err(error);
                }
            }
        }
    }

    fn prepare(&mut self, objects: usize) {
        for candidate in &mut self.candidates {
            if let Some(algorithm) = &mut candidate.algorithm {
                algorithm.prepare(objects);
                candidate.ready = candidate.ready.max(u32::try_from(objects).unwrap_or(u32::MAX));
            }
        }
    }

    fn keeps_work(&self) -> bool {
        self.candidates.iter().filter_map(|c| c.algorithm.as_ref()).any(|a| a.keeps_work())
    }
}

impl fmt::Debug for Adaptive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Adaptive").field("last_decision", &self.last_decision()).finish_non_exhaustive()
    }
}

/// A count that grows in proportion to the objects.
fn scaled(count: f64, objects: u32, before: u32) -> f64 {
    if before == 0 { count } else { count * f64::from(objects) / f64::from(before) }
}

#[cfg(test)]
mod tests;
