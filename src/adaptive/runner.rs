//! Runs the frames, with a decision or with the algorithm of the previous frame.

use super::decision::{Choice, Decision, Reason};
use super::epoch::Epoch;
use super::instances::{Instance, Instances};
use super::load_tracker::{LoadTracker, count};
use super::policy::Policy;
use super::warming::Place;
use crate::aabb::Aabb;
use crate::broad_phase::FrameWork;
use crate::clock::{self, Instant};
use crate::error::{Error, Unavailable};
use crate::pairs::Pairs;
use crate::registry::Registry;
use crate::tuning::{Source, Tuning};

/// A runner-up is prepared if its cost is at most this many times that of the choice.
const WARM_WITHIN: f64 = 1.5;

/// Fewest boxes for which a first frame is sampled. Then a sample takes less than a frame, and a wrong choice may cost
/// several.
const FIRST_SAMPLED: usize = 1000;

/// The algorithms, the choice among them, and what is known of the frames.
// A frame without a decision reads only the first fields and the beginning of `tracker`. Between two frames of a
// program all fields leave the caches, and ten scattered cache lines take as long as some frames.
#[repr(C, align(64))]
pub(super) struct Runner {
    /// Whether the next frame goes on without a decision, unless the tracker calls for one.
    steady: bool,
    /// Whether another tuning may [replace](Self::replace) this one before any frame.
    pub(super) awaits: bool,
    /// The last instance that ran and did not fail; `None` before the first frame of these instances.
    running: Option<usize>,
    /// In the order of [`Tuning::algorithms`].
    instances: Vec<Instance>,
    /// Nanoseconds of the last frame if it was timed, and its work if it is incremental.
    measured_ns: Option<f64>,
    pub(super) work: Option<FrameWork>,
    epoch: Epoch,
    pub(super) tracker: LoadTracker,
    /// The registry that made the instances.
    registry: Registry,
    pub(super) policy: Policy,
    choice: Option<Choice>,
    /// Whether an instance is prepared on a thread of its own.
    any_away: bool,
    /// The most objects for which a caller prepared.
    prepared: usize,
    /// Number of boxes of a frame that was decided and has not run yet.
    decided: Option<usize>,
}

impl Runner {
    pub(super) fn new(tuning: Tuning, made: Instances) -> Self {
        Self::with(policy(tuning, &made), made)
    }

    /// Makes the same algorithms anew. The first frame estimates the load. Learned corrections stay.
    pub(super) fn twin(&self) -> Self {
        let (mut policy, made) = (self.policy.clone(), Instances::of(&self.policy.tuning, &self.registry));
        policy.remade(&made.kept(), &made.usable());
        Self::with(policy, made)
    }

    fn with(policy: Policy, made: Instances) -> Self {
        Self {
            steady: false,
            awaits: false,
            running: None,
            policy,
            registry: made.registry,
            instances: made.instances,
            measured_ns: None,
            work: None,
            epoch: Epoch::default(),
            tracker: LoadTracker::default(),
            choice: None,
            any_away: false,
            prepared: 0,
            decided: None,
        }
    }

    /// Returns whether another tuning may replace this one before the next frame.
    pub(super) fn is_open(&self) -> bool {
        self.awaits && self.decided.is_none()
    }

    /// Replaces the tuning and the instances. The estimate of the load stays.
    pub(super) fn replace(&mut self, tuning: Tuning, made: Instances) {
        let Policy { learns, explores, .. } = self.policy;
        self.policy = policy(tuning, &made);
        (self.policy.learns, self.policy.explores) = (learns, explores);
        self.exchange(made);
        // As within a frame: instances that may block are prepared on threads of their own.
        self.choices().into_iter().for_each(|k| self.warm(k, self.prepared));
    }

    /// Replaces the instances by others of the same algorithms.
    pub(super) fn remake(&mut self, made: Instances) {
        self.catch_up();
        self.policy.remade(&made.kept(), &made.usable());
        self.exchange(made);
        self.prepare(self.prepared);
    }

    fn exchange(&mut self, made: Instances) {
        (self.instances, self.registry, self.running) = (made.instances, made.registry, None);
        (self.decided, self.choice, self.steady, self.epoch) = (None, None, false, Epoch::default());
    }

    /// Returns whether any of the algorithms is incremental.
    pub(super) fn is_incremental(&self) -> bool {
        self.instances.iter().any(|instance| instance.is_incremental)
    }

    /// Prepares the instances that may be chosen for frames of `objects` boxes.
    pub(super) fn prepare(&mut self, objects: usize) {
        self.prepared = self.prepared.max(objects);
        self.take_back(true);
        self.choices().into_iter().for_each(|k| self.instances[k].prepare(objects));
    }

    /// Returns the instances that may be chosen.
    fn choices(&self) -> Vec<usize> {
        (0..self.instances.len()).filter(|&k| self.policy.is_choice(k)).collect()
    }

    /// Returns the decision for the last frame; `None` before the first.
    pub(super) fn last_decision(&self) -> Option<Decision<'_>> {
        self.choice.map(|c| Decision {
            algorithm: &self.instances[c.chosen].id,
            predicted_ns: c.predicted_ns,
            measured_ns: self.measured_ns,
            runner_up: c.runner_up.map(|(k, ns)| (&self.instances[k].id, ns)),
            reason: c.reason,
            source: if self.policy.has_learned() { Source::Learned } else { self.policy.tuning.source },
            load: self.tracker.load,
        })
    }

    /// Decides for the next frame. The caller runs it with these boxes.
    pub(super) fn decide(&mut self, boxes: &[Aabb]) {
        self.choose(boxes);
        (self.decided, self.steady) = (Some(boxes.len()), false);
    }

    /// Runs a frame.
    pub(super) fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        let objects = count(boxes);
        if let Some(running) = self.running.filter(|_| self.steady && !self.tracker.pace.is_due(objects)) {
            return self.go_on(running, boxes, pairs);
        }
        // A decision for another number of boxes is made again.
        if self.decided.take() != Some(boxes.len()) {
            if self.is_due(objects) {
                self.choose(boxes);
            } else if self.policy.ends_trial() {
                self.catch_up();
                self.choice = self.policy.end_trial();
            }
        }
        self.run_chosen(boxes, pairs)
    }

    /// Returns whether the next frame needs a decision of its own.
    fn is_due(&mut self, objects: u32) -> bool {
        self.take_back(false);
        // A decision by the number of objects alone costs next to nothing, and needs no clock.
        self.choice.is_none() || self.policy.is_by_count() || self.tracker.pace.is_due(objects)
    }

    /// Learns from the frames since the last decision.
    fn catch_up(&mut self) {
        let epoch = std::mem::take(&mut self.epoch);
        if let Some(choice) = self.choice.filter(|_| epoch.frames > 0) {
            let mean_ns = if epoch.timed > 0 { epoch.ns / f64::from(epoch.timed) } else { self.tracker.pace.frame_ns };
            self.tracker.passed(epoch.frames, f64::from(epoch.frames) * mean_ns);
            self.policy.observe(choice.chosen, &epoch, self.work);
        }
    }

    #[inline(never)]
    fn choose(&mut self, boxes: &[Aabb]) {
        let started = Instant::now();
        #[cfg(test)]
        clock::counted::spend(clock::counted::DECISION_NS);
        self.catch_up();
        let is_first = self.choice.is_none() && self.running.is_none();
        let by_count = is_first && !self.policy.has_learned() && boxes.len() < FIRST_SAMPLED;
        let spent_ns = if by_count && self.policy.has_steps() {
            self.tracker.begin(boxes);
            self.choice = self.choose_among(|policy, load| policy.choose_first(load.objects));
            0.0
        } else {
            let spent_ns = self.tracker.update(boxes);
            self.choice = self.choose_among(|policy, load| policy.choose(load));
            spent_ns
        };
        self.measured_ns = None;
        let took_ns = (clock::elapsed_ns(started) - spent_ns).max(0.0);
        self.tracker.pace.decided(count(boxes), took_ns);
        self.policy.decision_ns = self.tracker.pace.decision_ns;
    }

    /// Chooses among the instances that are here. If none is, waits for those that are being prepared.
    fn choose_among(&mut self, choose: impl Fn(&mut Policy, &crate::load::Load) -> Option<Choice>) -> Option<Choice> {
        let load = self.tracker.load;
        let choice = choose(&mut self.policy, &load);
        if choice.is_some() || !self.take_back(true) {
            return choice;
        }
        choose(&mut self.policy, &load)
    }

    /// Prepares an instance. If that takes a thread of its own, the instance is not chosen meanwhile.
    fn warm(&mut self, instance: usize, objects: usize) {
        self.instances[instance].warm(objects);
        self.any_away |= self.instances[instance].place.is_away();
        self.update(instance);
    }

    /// Takes back the instances that are ready; with `patience` waits for all others. Returns whether any came back.
    fn take_back(&mut self, patience: bool) -> bool {
        let mut any = false;
        if self.any_away {
            for k in 0..self.instances.len() {
                if self.instances[k].place.take_back(patience) {
                    self.update(k);
                    any = true;
                }
            }
            self.any_away = self.instances.iter().any(|instance| instance.place.is_away());
        }
        any
    }

    /// Lets the policy choose an instance only if it is here.
    fn update(&mut self, instance: usize) {
        self.policy.set_usable(instance, self.instances[instance].place.is_here());
    }

    /// Runs a frame with the algorithm of the previous one.
    fn go_on(&mut self, running: usize, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        let started = self.epoch.is_timed().then(Instant::now);
        match self.instances[running].go_on(boxes, pairs) {
            Ok(work) => {
                let ns = started.and_then(clock::measured_ns);
                (self.work, self.measured_ns) = (work, ns);
                if self.epoch.add(ns, work) {
                    self.stood_out(ns.unwrap_or_default(), boxes, pairs);
                } else {
                    self.tracker.went_on(boxes, pairs.len() as u64, &self.epoch);
                }
                Ok(())
            }
            Err(error) => {
                self.catch_up();
                self.failed(error)?;
                self.run_chosen(boxes, pairs)
            }
        }
    }

    /// Records a frame without a decision that stood out, and makes a decision due.
    #[inline(never)]
    fn stood_out(&mut self, ns: f64, boxes: &[Aabb], pairs: &Pairs) {
        let Some(choice) = self.choice else { return };
        self.tracker.ran(boxes, pairs.len() as u64);
        self.policy.ran(choice.chosen, Some(ns), self.work, &mut self.epoch);
        self.tracker.pace.wake();
    }

    /// Runs the choice. If that fails, runs the next cheapest in the same frame.
    #[inline(never)]
    fn run_chosen(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        loop {
            let Some(choice) = self.choice else {
                // Drops the pairs of the algorithm that failed last.
                pairs.clear();
                let algorithm = self.instances[0].id.clone();
                return Err(Error::Unavailable { algorithm, reason: Unavailable::AllFailed });
            };
            let chosen = choice.chosen;
            let frame = self.policy.frame + u64::from(self.epoch.frames);
            let started = Instant::now();
            match self.instances[chosen].run(frame, &self.tracker.plan, boxes, pairs) {
                Ok(work) => {
                    let ns = clock::measured_ns(started);
                    (self.work, self.measured_ns) = (work, ns);
                    if let Some(before) = self.running.replace(chosen).filter(|before| *before != chosen) {
                        self.instances[before].left_at = Some(frame);
                    }
                    self.ran(choice, ns, boxes, pairs);
                    return Ok(());
                }
                Err(error) => self.failed(error)?,
            }
        }
    }

    /// Records a frame that was decided or belongs to a trial.
    fn ran(&mut self, choice: Choice, ns: Option<f64>, boxes: &[Aabb], pairs: &Pairs) {
        self.tracker.ran(boxes, pairs.len() as u64);
        if self.epoch.frames == 0 {
            self.epoch = self.policy.epoch(choice.chosen);
        }
        self.policy.ran(choice.chosen, ns, self.work, &mut self.epoch);
        self.epoch.frames += 1;
        let began = self.epoch.frames == 1 && !matches!(choice.reason, Reason::Stayed | Reason::Hysteresis);
        if began {
            self.tell();
        }
        self.tracker.pace.set_rest(choice.predicted_ns.or(ns).unwrap_or(1.0), self.policy.rest());
        // Little was known when a first frame or a replacement was chosen.
        if matches!(choice.reason, Reason::First | Reason::FellBack) {
            self.tracker.pace.wake();
        }
        self.warm_runner_up(boxes.len());
        self.steady = !(self.awaits || self.any_away || self.policy.is_by_count() || self.policy.tries());
    }

    /// Reports the decision to the program's subscriber.
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

    /// Records a failed frame. If the algorithm caused the error, and not the boxes, chooses another one.
    #[cold]
    fn failed(&mut self, error: Error) -> Result<(), Error> {
        (self.steady, self.measured_ns) = (false, None);
        let Some(choice) = self.choice.filter(|_| matches!(error, Error::Unavailable { .. })) else {
            self.tracker.failed();
            self.policy.failed();
            return Err(error);
        };
        self.instances[choice.chosen].place = Place::Gone;
        self.update(choice.chosen);
        self.catch_up();
        let next = self.choose_among(|policy, load| policy.choose(load));
        self.choice = next.map(|c| Choice { reason: Reason::FellBack, ..c });
        Ok(())
    }

    /// Prepares the runner-up if it may be chosen soon.
    fn warm_runner_up(&mut self, boxes: usize) {
        let Some(Choice { predicted_ns: Some(best), runner_up: Some((next, ns)), reason, .. }) = self.choice else {
            return;
        };
        // The runner-up of a trial is the incumbent, which must be here when the trial ends.
        let tried = reason == Reason::Explored;
        if !tried && ns <= best * WARM_WITHIN && self.instances[next].ready < boxes {
            // For powers of two, so that a growing scene prepares only a few times.
            self.warm(next, boxes.checked_next_power_of_two().unwrap_or(boxes));
        }
    }
}

fn policy(tuning: Tuning, made: &Instances) -> Policy {
    let mut policy = Policy::new(tuning, &made.kept(), &made.usable());
    policy.learns = clock::ticks();
    policy
}
