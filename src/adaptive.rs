//! The in-line module: the cheapest algorithm for this frame, chosen before it runs.

mod decision;
mod frame_batch;
mod instances;
mod learner;
mod load_tracker;
mod motion_watch;
mod passed;
mod policy;
#[cfg(feature = "this-machine")]
mod setup;
mod shelter;
mod switching;
mod throttle;
mod trials;
mod warming;

use crate::aabb::Aabb;
use crate::algorithm::AlgorithmId;
#[cfg(feature = "this-machine")]
use crate::algorithm::BackendClass;
use crate::broad_phase::{BroadPhase, FrameKind, FrameWork, Incremental};
use crate::clock::{self, Instant};
use crate::error::{Error, Unavailable};
use crate::load::Load;
use crate::pairs::Pairs;
use crate::registry::Registry;
use crate::tuning::{Source, Step, Tuning};
use decision::Choice;
use instances::{Candidate, Instance};
use load_tracker::LoadTracker;
use passed::Passed;
use policy::Policy;
use std::fmt;

pub use decision::{Decision, Reason};
pub(crate) use instances::Instances;
#[cfg(feature = "this-machine")]
pub(crate) use setup::{Arrival, Awaited, Handover, Keeper, Start};
#[cfg(feature = "this-machine")]
pub use setup::{Origin, SaveError, Setup};

/// A runner-up that costs at most this much more than the choice gets its buffers ready: the next border may be near.
const WARM_WITHIN: f64 = 1.5;

/// Sizes of the slice that learned tuning shows: four a decade from ten to a million, in quarters of a decade.
const SLICE: std::ops::RangeInclusive<u32> = 4..=24;

/// When the frame that ran was decided on.
#[derive(Debug, Clone, Copy)]
enum Decided {
    /// It went on as the one before.
    Never,
    /// By a call of [`decide`](Adaptive::decide).
    Before,
    /// Right before it ran, from then on.
    At(Instant),
}

/// A broad phase that runs whichever algorithm is expected to be cheapest for each frame.
///
/// Every algorithm takes the same boxes and returns the same pairs, so a switch is invisible but for its speed. What is expected comes from
/// [`Tuning`] and, where these have cost curves, from the times of the frames that were run: [`set_learning`](Self::set_learning).
// A frame without a decision looks at what stands first and at the beginning of `tracker`, and at nothing else: between two frames of a program all of it
// leaves the caches, and ten lines of memory here and there take as long as some frames.
#[repr(C, align(64))]
pub struct Adaptive {
    /// The throttle alone tells whether the next frame needs a decision, and the instance that goes on where it needs none.
    steady: bool,
    running: usize,
    instances: Vec<Instance>,
    /// The last frame: what it took, where it was timed, and how it came about, where one may build on the one before.
    measured_ns: Option<f64>,
    work: Option<FrameWork>,
    /// The frames since the last decision.
    passed: Passed,
    tracker: LoadTracker,
    /// In the order of [`Tuning::algorithms`].
    candidates: Vec<Candidate>,
    policy: Policy,
    choice: Option<Choice>,
    /// An instance gets ready on a thread of its own.
    any_away: bool,
    /// The most objects that were to be prepared for.
    prepared: usize,
    /// [`decide`](Self::decide) was called for a frame of this many boxes that has not run yet.
    decided: Option<usize>,
    /// How it came to its tuning.
    #[cfg(feature = "this-machine")]
    start: Start,
}

impl Adaptive {
    /// An adaptive broad phase over those algorithms of `tuning` that `registry` can make.
    ///
    /// An algorithm whose cost was found for another revision is left out, and so is one with more threads than the registry
    /// lists: its cost says nothing about this build or this machine.
    ///
    /// # Errors
    /// [`Error::Unavailable`] or [`Error::UnknownAlgorithm`] when none can be made, [`Error::NoAlgorithm`] when none is named.
    pub fn new(tuning: Tuning, registry: &Registry) -> Result<Self, Error> {
        let mut made = Instances::of(&tuning, registry);
        made.failure().map_or_else(|| Ok(Self::with(tuning, made)), Err)
    }

    /// Over instances that are there already.
    pub(crate) fn with(tuning: Tuning, made: Instances) -> Self {
        Self {
            steady: false,
            running: 0,
            policy: policy(tuning, &made),
            instances: made.instances,
            measured_ns: None,
            work: None,
            passed: Passed::default(),
            tracker: LoadTracker::default(),
            candidates: made.candidates,
            choice: None,
            any_away: false,
            prepared: 0,
            decided: None,
            #[cfg(feature = "this-machine")]
            start: Start::default(),
        }
    }

    /// Runs one algorithm always.
    ///
    /// # Errors
    /// As [`Registry::create`].
    pub fn only(algorithm: AlgorithmId, registry: &Registry) -> Result<Self, Error> {
        let steps = vec![Step { from_objects: 0, algorithm }];
        let tuning = Tuning::from_steps(steps).map_err(|_| Error::NoAlgorithm)?;
        Self::new(tuning, registry)
    }

    /// Whether the times of frames correct the expected costs. On unless it is turned off; what was learned until then stays in use.
    ///
    /// Tuning without cost curves have nothing to correct, and decide by the number of objects always. On `wasm32-unknown-unknown`, which has
    /// no clock, no frame is timed and nothing is learned.
    pub fn set_learning(&mut self, learns: bool) {
        self.policy.set_learning(learns && clock::TICKS);
    }

    /// Whether now and then another algorithm than the cheapest is tried, to learn what that one costs: in two frames, or in up to 128 where it keeps
    /// work from frame to frame, until they have cost two. Only where what the trial is expected to tell may save more in the next 300 frames than it costs. What
    /// trials and their decisions have cost is measured, and no other is made until that is no more than 0.5 % of the time of the frames and four frames; a scene that
    /// suddenly is larger than all before counts as one that begins. On unless it is turned off; without [learning](Self::set_learning) it does nothing.
    pub fn set_exploring(&mut self, explores: bool) {
        self.policy.set_exploring(explores);
    }

    /// The tuning that it began with.
    #[must_use]
    pub fn tuning(&self) -> &Tuning {
        self.policy.tuning()
    }

    /// The tuning corrected by what was learned of the machine and of each algorithm, with the slice of scenes like the present one. What
    /// passes is left out: another program on a core, cores that moved apart, how much this scene spares incremental algorithms. Those
    /// that it began with where nothing was learned.
    #[must_use]
    pub fn learned(&self) -> Tuning {
        let tuning = self.policy.tuning();
        let Some(learner) = self.policy.learned() else { return tuning.clone() };
        let costs = learner.lasting(&tuning.costs);
        let load = self.tracker.load();
        let like = |quarter: u32| {
            let objects = 10.0_f64.powf(f64::from(quarter) / 4.0).round() as u32;
            load.rescaled(objects, load.pairs * f64::from(objects) / f64::from(load.objects.max(1)))
        };
        let loads: Vec<Load> = SLICE.map(like).collect();
        let learned = Tuning::from_costs(Source::Learned, "like the last frame", costs, &loads);
        Tuning {
            model: tuning.model.clone(),
            extrapolated: tuning.extrapolated,
            warnings: tuning.warnings.clone(),
            samples: tuning.samples.clone(),
            ..learned
        }
    }

    /// Makes every algorithm again from this registry: one that was lost and is back, or all of them on a pool of another size. What was
    /// learned stays, unless incremental algorithms came or went; what they kept from frame to frame is gone. A tuning that is still
    /// awaited from the background brings algorithms of the registry that they were asked with.
    ///
    /// # Errors
    /// As [`new`](Self::new); the algorithms of before stay then.
    pub fn revive(&mut self, registry: &Registry) -> Result<(), Error> {
        let mut made = Instances::of(self.policy.tuning(), registry);
        if let Some(error) = made.failure() {
            return Err(error);
        }
        self.catch_up();
        self.policy.remade(&made.kept(), &made.usable());
        self.exchange(made);
        self.prepare(self.prepared);
        Ok(())
    }

    /// Takes what was made in the background, once it is there. The estimate of the load stays.
    #[cfg(feature = "this-machine")]
    pub(crate) fn take_over(&mut self) {
        let Some((tuning, made)) = self.start.arrived() else { return };
        let before = std::mem::replace(&mut self.policy, policy(tuning, &made));
        self.policy.set_as(&before);
        self.exchange(made);
        // As those of before were, but within a frame.
        (0..self.instances.len()).for_each(|k| self.warm(k, self.prepared));
    }

    /// Other candidates take the place of those of before. What was decided goes with them.
    fn exchange(&mut self, made: Instances) {
        (self.candidates, self.instances) = (made.candidates, made.instances);
        self.decided = None;
        self.choice = None;
        self.steady = false;
        self.passed = Passed::default();
    }

    /// Where its tuning came from, what went wrong on the way and how long it took.
    #[cfg(feature = "this-machine")]
    #[must_use]
    pub fn setup(&self) -> &Setup {
        &self.start.setup
    }

    /// Keeps what was learned in the cache, for the next start of a program on this machine: call it at the end of a session. `false`, and
    /// nothing is kept, after a session so short that the tuning of this machine did not arrive, and where nothing could be predicted.
    ///
    /// # Errors
    /// When there is no cache to keep it in, or it can't be written.
    #[cfg(feature = "this-machine")]
    pub fn save(&self) -> Result<bool, SaveError> {
        self.start.save(|| (self.learned(), self.over_predicted()))
    }

    /// How many times as long as predicted frames take on the CPU, as far as they told.
    #[cfg(feature = "this-machine")]
    fn over_predicted(&self) -> f64 {
        let on_cpu = self.tuning().costs.iter().position(|c| c.algorithm.backend().class() == BackendClass::Cpu);
        self.policy.learned().zip(on_cpu).map_or(1.0, |(learner, k)| learner.class_ln(k).exp())
    }

    /// Begins with what a start on this machine found.
    #[cfg(feature = "this-machine")]
    pub(crate) fn set_start(&mut self, start: Start) {
        self.start = start;
    }

    /// What was decided for the last frame; `None` before the first. As a text it is a sentence that tells why.
    ///
    /// With the feature `tracing` every switch is an event with that text: target `sapwise::adaptive`, level DEBUG; trials have level TRACE.
    #[must_use]
    pub fn last_decision(&self) -> Option<Decision<'_>> {
        self.choice.map(|c| Decision {
            algorithm: &self.candidates[c.chosen].id,
            predicted_ns: c.predicted_ns,
            measured_ns: self.measured_ns,
            runner_up: c.runner_up.map(|(k, ns)| (&self.candidates[k].id, ns)),
            reason: c.reason,
            source: if self.policy.learned().is_some() { Source::Learned } else { self.policy.tuning().source },
            load: self.tracker.load(),
        })
    }

    /// Tells the program's subscriber what was decided and why.
    fn tell(&self) {
        #[cfg(feature = "tracing")]
        if let Some(decision) = self.last_decision() {
            if decision.reason == Reason::Explored {
                tracing::trace!(target: "sapwise::adaptive", "{decision}");
            } else {
                tracing::debug!(target: "sapwise::adaptive", "{decision}");
            }
        }
    }

    /// Estimates the load of the next frame and decides, without running anything.
    pub fn decide(&mut self, boxes: &[Aabb]) -> Option<Decision<'_>> {
        self.look_up();
        self.choose(boxes);
        self.decided = Some(boxes.len());
        self.steady = false;
        self.last_decision()
    }

    /// Takes in the frames since the last decision.
    fn catch_up(&mut self) {
        let passed = std::mem::take(&mut self.passed);
        if let Some(choice) = self.choice.filter(|_| passed.frames > 0) {
            self.tracker.went_on(&passed);
            self.policy.went_on(choice.chosen, &passed);
        }
    }

    fn choose(&mut self, boxes: &[Aabb]) {
        self.catch_up();
        self.tracker.decide(boxes);
        if let Some(moved) = self.tracker.moved() {
            self.policy.moves(moved);
        }
        self.choice = self.choose_among();
        self.measured_ns = None;
    }

    /// Takes in what has come from other threads.
    fn look_up(&mut self) {
        #[cfg(feature = "this-machine")]
        self.take_over();
        self.take_back(false);
    }

    /// Whether the next frame needs a decision of its own, or was decided on already.
    #[inline(never)]
    fn is_due(&mut self, boxes: &[Aabb]) -> bool {
        if self.decided.is_some() {
            // What was decided for another frame than this one is decided again.
            self.decided = self.decided.filter(|&decided| decided == boxes.len());
            return true;
        }
        self.look_up();
        // By the number of objects alone a decision costs next to nothing, and is to depend on no clock.
        self.choice.is_none() || self.tracker.is_due(boxes) || self.policy.is_by_count()
    }

    /// Whether nothing but the load can call for a decision before the next frame.
    fn is_steady(&self) -> bool {
        #[cfg(feature = "this-machine")]
        let awaits = self.start.awaited.is_some();
        #[cfg(not(feature = "this-machine"))]
        let awaits = false;
        !(awaits || self.any_away || self.policy.is_by_count())
    }

    /// The choice among those that are here; where none is, among those that are awaited.
    fn choose_among(&mut self) -> Option<Choice> {
        let load = self.tracker.load();
        let choice = self.policy.choose(&load);
        if choice.is_some() || !self.take_back(true) {
            return choice;
        }
        self.policy.choose(&load)
    }

    /// Gets an instance ready. Meanwhile none of its candidates is chosen where that takes a thread of its own.
    fn warm(&mut self, instance: usize, objects: usize) {
        self.instances[instance].warm(objects);
        self.any_away |= self.instances[instance].is_away();
        self.update(instance);
    }

    /// Takes back what has got ready, or with `patience` all that is getting ready. Whether anything has come back.
    fn take_back(&mut self, patience: bool) -> bool {
        let mut any = false;
        if !self.any_away {
            return any;
        }
        self.any_away = false;
        for k in 0..self.instances.len() {
            if self.instances[k].take_back(patience) {
                self.update(k);
                any = true;
            }
            self.any_away |= self.instances[k].is_away();
        }
        any
    }

    /// Its candidates can be chosen while it is here, and never again where it is gone.
    fn update(&mut self, instance: usize) {
        let (here, away) = (self.instances[instance].is_here(), self.instances[instance].is_away());
        for (k, candidate) in self.candidates.iter_mut().enumerate().filter(|(_, c)| c.instance == Some(instance)) {
            self.policy.set_usable(k, here);
            if !here && !away {
                candidate.instance = None;
            }
        }
    }

    /// Runs a frame that needs no decision.
    fn go_on(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        let running = self.passed.is_timed().then(Instant::now);
        match self.instances[self.running].go_on(boxes, pairs).unwrap_or_else(|| Err(self.gone())) {
            Ok(work) => {
                let ns = running.map(|running| (running.elapsed().as_nanos() as f64).max(1.0));
                (self.work, self.measured_ns) = (work, ns.filter(|_| clock::TICKS));
                match ns.filter(|&ns| !self.passed.is_usual(ns)) {
                    None => {
                        self.passed.add(work, ns);
                        self.tracker.passes(boxes, pairs.overlapping(), &self.passed);
                    }
                    Some(ns) => {
                        self.catch_up();
                        self.learn(Decided::Never, ns, boxes, pairs);
                    }
                }
                Ok(())
            }
            Err(error) => {
                self.catch_up();
                self.failed(error)?;
                self.run_chosen(Decided::At(Instant::now()), boxes, pairs)
            }
        }
    }

    /// Decides, where that was not done before, and runs the frame.
    #[inline(never)]
    fn run_best(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        let decided = match self.decided.take() {
            Some(_) => Decided::Before,
            None => {
                let started = Instant::now();
                self.choose(boxes);
                Decided::At(started)
            }
        };
        self.run_chosen(decided, boxes, pairs)
    }

    /// Runs what was chosen, and where that fails the next cheapest in this same frame.
    fn run_chosen(&mut self, decided: Decided, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        loop {
            let Some(choice) = self.choice else {
                // What the last one left is no answer.
                pairs.clear();
                let algorithm = self.candidates[0].id.clone();
                return Err(Error::Unavailable { algorithm, reason: Unavailable::AllFailed });
            };
            let candidate = &self.candidates[choice.chosen];
            let Some(instance) = candidate.instance else {
                // Choosing leaves out what failed. Were it to come here all the same, no answer is better than an old one.
                return Err(self.gone());
            };
            let running = Instant::now();
            match self.instances[instance].run(&candidate.id, self.tracker.plan(), boxes, pairs) {
                Ok(work) => {
                    let ns = (running.elapsed().as_nanos() as f64).max(1.0);
                    (self.work, self.measured_ns, self.running) = (work, clock::TICKS.then_some(ns), instance);
                    self.learn(decided, ns, boxes, pairs);
                    return Ok(());
                }
                Err(error) => self.failed(error)?,
            }
        }
    }

    /// Learns from the frame that ran, which took so long.
    #[inline(never)]
    fn learn(&mut self, decided: Decided, ns: f64, boxes: &[Aabb], pairs: &Pairs) {
        let Some(choice) = self.choice else { return };
        let stood_out = matches!(decided, Decided::Never);
        self.tracker.ran(boxes, pairs.overlapping(), ns);
        let dear = self.policy.ran(choice.chosen, ns, self.work);
        let decision_ns = match decided {
            Decided::At(started) => Some(started.elapsed().as_nanos() as f64 - ns),
            Decided::Before | Decided::Never => None,
        };
        self.tracker.took(decision_ns, ns, self.policy.lead_ln());
        if !stood_out {
            self.policy.decision_took(decision_ns, self.tracker.decision_ns());
        }
        self.passed = Passed::expecting(self.policy.usual(choice.chosen));
        let began = !stood_out && !matches!(choice.reason, Reason::Stayed | Reason::Hysteresis);
        if began {
            self.tell();
        }
        if self.policy.doubts_load() {
            self.tracker.doubt(boxes);
        }
        if dear || began || stood_out || self.policy.is_exploring() {
            // What began in this frame is looked at once more before it may rest.
            self.tracker.wake();
        }
        self.warm_runner_up(boxes.len());
        self.steady = self.is_steady();
    }

    /// What to say where the algorithm that runs is not there any more.
    #[cold]
    fn gone(&self) -> Error {
        let algorithm = self.candidates[self.choice.map_or(0, |choice| choice.chosen)].id.clone();
        Error::Unavailable { algorithm, reason: Unavailable::FailedBefore }
    }

    /// Takes in that the frame failed. Where the algorithm is at fault, and not the boxes, another one is chosen.
    #[cold]
    fn failed(&mut self, error: Error) -> Result<(), Error> {
        self.steady = false;
        self.measured_ns = None;
        let Some(choice) = self.choice.filter(|_| matches!(error, Error::Unavailable { .. })) else {
            // A frame that was to explore has told nothing, and the next one is to run what is cheapest.
            self.tracker.failed();
            return Err(error);
        };
        self.candidates[choice.chosen].instance = None;
        self.policy.set_usable(choice.chosen, false);
        self.choice = self.choose_among().map(|c| Choice { reason: Reason::FellBack, ..c });
        Ok(())
    }

    /// Gets the runner-up ready when its turn may come soon.
    fn warm_runner_up(&mut self, boxes: usize) {
        let Some(Choice { predicted_ns: Some(best), runner_up: Some((next, ns)), .. }) = self.choice else { return };
        let Some(instance) = self.candidates[next].instance else { return };
        if ns <= best * WARM_WITHIN && self.instances[instance].is_cold(boxes) {
            // By powers of two, so that a growing scene pays for this a few times in all.
            self.warm(instance, boxes.checked_next_power_of_two().unwrap_or(boxes));
        }
    }
}

impl BroadPhase for Adaptive {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        let due = if self.steady { self.tracker.is_due(boxes) } else { self.is_due(boxes) };
        if due { self.run_best(boxes, pairs) } else { self.go_on(boxes, pairs) }
    }

    fn prepare(&mut self, objects: usize) {
        self.prepared = self.prepared.max(objects);
        self.take_back(true);
        for k in 0..self.instances.len() {
            self.instances[k].prepare(objects);
        }
    }

    /// Where any of its algorithms is one.
    fn as_incremental(&mut self) -> Option<&mut dyn Incremental> {
        if self.instances.iter().any(|instance| instance.is_incremental) { Some(self) } else { None }
    }
}

impl Incremental for Adaptive {
    /// Of an algorithm that keeps nothing every frame is from scratch.
    fn last_frame(&self) -> FrameWork {
        self.work.unwrap_or(FrameWork::new(FrameKind::FromScratch, 1.0))
    }
}

impl fmt::Debug for Adaptive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Adaptive").field("last_decision", &self.last_decision()).finish_non_exhaustive()
    }
}

fn policy(tuning: Tuning, made: &Instances) -> Policy {
    let mut policy = Policy::new(tuning, &made.kept(), made.usable());
    policy.set_learning(clock::TICKS);
    policy
}

#[cfg(test)]
mod tests;
