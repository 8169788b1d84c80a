//! Runs the frames: those that were decided on, and between two decisions those that go on.

use super::decision::{Choice, Decision, Reason};
use super::instances::{Candidate, Instance, Instances};
use super::load_tracker::LoadTracker;
use super::passed::Passed;
use super::policy::Policy;
use crate::aabb::Aabb;
use crate::broad_phase::FrameWork;
use crate::clock::{self, Instant};
use crate::error::{Error, Unavailable};
use crate::pairs::Pairs;
use crate::tuning::{Source, Tuning};

/// A runner-up that costs at most this much more than the choice gets its buffers ready: the next border may be near.
const WARM_WITHIN: f64 = 1.5;

/// When the frame that ran was decided on.
#[derive(Debug, Clone, Copy)]
enum Decided {
    /// It went on as the one before.
    Never,
    /// By a call of [`decide`](crate::Adaptive::decide).
    Before,
    /// Right before it ran, from then on.
    At(Instant),
}

/// The algorithms, the choice among them, and what is known of the frames.
// A frame without a decision looks at what stands first and at the beginning of `tracker`, and at nothing else:
// between two frames of a program all of it leaves the caches, and ten lines of memory here and there take as long as
// some frames.
#[repr(C, align(64))]
pub(super) struct Runner {
    /// The throttle alone tells whether the next frame needs a decision, and the instance that goes on where it needs
    /// none.
    steady: bool,
    /// Another tuning may arrive before any frame.
    awaits: bool,
    /// `None` before the first frame.
    running: Option<usize>,
    instances: Vec<Instance>,
    /// The last frame: what it took, where it was timed, and how it came about, where one may build on the one before.
    measured_ns: Option<f64>,
    work: Option<FrameWork>,
    /// The frames since the last decision.
    passed: Passed,
    pub(super) tracker: LoadTracker,
    /// In the order of [`Tuning::algorithms`].
    candidates: Vec<Candidate>,
    pub(super) policy: Policy,
    choice: Option<Choice>,
    /// An instance gets ready on a thread of its own.
    any_away: bool,
    /// The most objects that were to be prepared for.
    prepared: usize,
    /// A decision was made for a frame of this many boxes that has not run yet.
    decided: Option<usize>,
}

impl Runner {
    pub(super) fn new(tuning: Tuning, made: Instances) -> Self {
        Self {
            steady: false,
            awaits: false,
            running: None,
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
        }
    }

    /// Whether another tuning may [take the place](Self::replace) of this one before any frame.
    pub(super) fn set_awaits(&mut self, awaits: bool) {
        self.awaits = awaits;
    }

    /// Whether another tuning may come before the next frame.
    pub(super) fn is_open(&self) -> bool {
        self.awaits && self.decided.is_none()
    }

    /// Goes on with another tuning and its algorithms. The estimate of the load stays.
    pub(super) fn replace(&mut self, tuning: Tuning, made: Instances) {
        self.catch_up();
        let before = std::mem::replace(&mut self.policy, policy(tuning, &made));
        self.policy.set_as(&before);
        self.exchange(made);
        // As those of before were, but within a frame.
        (0..self.instances.len()).for_each(|k| self.warm(k, self.prepared));
    }

    /// Goes on with other instances of the same algorithms.
    pub(super) fn remake(&mut self, made: Instances) {
        self.catch_up();
        self.policy.remade(&made.kept(), &made.usable());
        self.exchange(made);
        self.prepare(self.prepared);
    }

    /// Other candidates take the place of those of before. What was decided goes with them.
    fn exchange(&mut self, made: Instances) {
        (self.candidates, self.instances, self.running) = (made.candidates, made.instances, None);
        self.decided = None;
        self.choice = None;
        self.steady = false;
        self.passed = Passed::default();
    }

    /// How the last frame came about, where its algorithm keeps work from frame to frame.
    pub(super) fn work(&self) -> Option<FrameWork> {
        self.work
    }

    /// Whether any of the algorithms builds on the frame before.
    pub(super) fn is_incremental(&self) -> bool {
        self.instances.iter().any(|instance| instance.is_incremental)
    }

    /// Gets all of them ready for frames of that many objects.
    pub(super) fn prepare(&mut self, objects: usize) {
        self.prepared = self.prepared.max(objects);
        self.take_back(true);
        self.instances.iter_mut().for_each(|instance| instance.prepare(objects));
    }

    /// What was decided for the last frame; `None` before the first.
    pub(super) fn last_decision(&self) -> Option<Decision<'_>> {
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

    /// Decides for the next frame, which is to be of these boxes.
    pub(super) fn decide(&mut self, boxes: &[Aabb]) {
        self.take_back(false);
        self.choose(boxes);
        self.decided = Some(boxes.len());
        self.steady = false;
    }

    /// Runs a frame.
    pub(super) fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        let due = if self.steady { self.tracker.is_due(boxes) } else { self.is_due(boxes) };
        if due { self.run_best(boxes, pairs) } else { self.go_on(boxes, pairs) }
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
        #[cfg(test)]
        clock::counted::spend(clock::counted::DECISION_NS);
        self.catch_up();
        self.tracker.decide(boxes);
        if let Some(moved) = self.tracker.moved() {
            self.policy.moves(moved);
        }
        self.choice = self.choose_among();
        self.measured_ns = None;
    }

    /// Whether the next frame needs a decision of its own, or was decided on already.
    #[inline(never)]
    fn is_due(&mut self, boxes: &[Aabb]) -> bool {
        if self.decided.is_some() {
            // What was decided for another frame than this one is decided again.
            self.decided = self.decided.filter(|&decided| decided == boxes.len());
            return true;
        }
        self.take_back(false);
        // By the number of objects alone a decision costs next to nothing, and is to depend on no clock.
        self.choice.is_none() || self.tracker.is_due(boxes) || self.policy.is_by_count()
    }

    /// Whether nothing but the load can call for a decision before the next frame.
    fn is_steady(&self) -> bool {
        !(self.awaits || self.any_away || self.policy.is_by_count())
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
        let started = self.passed.is_timed().then(Instant::now);
        let instance = self.running.map(|running| &mut self.instances[running]);
        match instance.and_then(|i| i.go_on(boxes, pairs)).unwrap_or_else(|| Err(self.gone())) {
            Ok(work) => {
                let ns = started.map(|started| (started.elapsed().as_nanos() as f64).max(1.0));
                (self.work, self.measured_ns) = (work, ns.filter(|_| clock::TICKS));
                match ns.filter(|&ns| !self.passed.is_usual(ns)) {
                    None => {
                        self.passed.add(work, ns);
                        self.tracker.passes(boxes, pairs.len() as u64, &self.passed);
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
                // Choosing leaves out what failed. Were it to come here all the same, no answer is better than an old
                // one.
                return Err(self.gone());
            };
            let frame = self.policy.frame();
            let running = Instant::now();
            match self.instances[instance].run(&candidate.id, frame, self.tracker.plan(), boxes, pairs) {
                Ok(work) => {
                    let ns = (running.elapsed().as_nanos() as f64).max(1.0);
                    (self.work, self.measured_ns) = (work, clock::TICKS.then_some(ns));
                    if let Some(before) = self.running.replace(instance).filter(|before| *before != instance) {
                        self.instances[before].leave(frame);
                    }
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
        self.tracker.ran(boxes, pairs.len() as u64, ns);
        let dear = self.policy.ran(choice.chosen, ns, self.work);
        let decision_ns = match decided {
            Decided::At(started) => Some(self.tracker.without_sample(started.elapsed().as_nanos() as f64 - ns)),
            Decided::Before | Decided::Never => None,
        };
        self.tracker.took(decision_ns, ns);
        if !stood_out {
            self.policy.decision_took(decision_ns, self.tracker.decision_ns());
        }
        self.passed = Passed::expecting(self.policy.usual(choice.chosen));
        let began = !stood_out && !matches!(choice.reason, Reason::Stayed | Reason::Hysteresis);
        if began {
            self.tell();
        }
        let trial = self.policy.trial_rests();
        if let Some(frames) = trial.map(f64::from).or(self.policy.rests_at_most()) {
            self.tracker.rest_no_longer_than(frames);
        }
        // What began before it was known how far boxes move is decided on, and gets a plan of its frame, once more
        // before it may rest. Without, `pair-cache` in `uniform` of 800 took 1.19 times the best single algorithm (n
        // 8) in place of 1.05 (n 12). So is what takes the place of one that failed.
        let again = began && (choice.reason == Reason::FellBack || trial.is_none() && self.tracker.moved().is_none());
        if dear || again || stood_out {
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
            self.policy.failed();
            return Err(error);
        };
        self.candidates[choice.chosen].instance = None;
        self.policy.set_usable(choice.chosen, false);
        self.choice = self.choose_among().map(|c| Choice { reason: Reason::FellBack, ..c });
        Ok(())
    }

    /// Gets the runner-up ready when its turn may come soon.
    fn warm_runner_up(&mut self, boxes: usize) {
        let Some(Choice { predicted_ns: Some(best), runner_up: Some((next, ns)), reason, .. }) = self.choice else {
            return;
        };
        // Behind a trial stands what is settled on, and is to be here when that ends.
        let Some(instance) = self.candidates[next].instance.filter(|_| reason != Reason::Explored) else { return };
        if ns <= best * WARM_WITHIN && self.instances[instance].is_cold(boxes) {
            // By powers of two, so that a growing scene pays for this a few times in all.
            self.warm(instance, boxes.checked_next_power_of_two().unwrap_or(boxes));
        }
    }
}

fn policy(tuning: Tuning, made: &Instances) -> Policy {
    let mut policy = Policy::new(tuning, &made.kept(), made.usable());
    policy.set_learning(clock::TICKS);
    policy
}
