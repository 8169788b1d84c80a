//! Which algorithm runs the next frame: the cheapest by all that is known, seldom another one to learn what it costs.

use super::decision::{Choice, Reason};
use super::estimates::Estimates;
use super::frame_batch::{FrameBatch, MOST_OVER};
use super::learner::Learner;
use super::passed::{Budget, Passed, Usual};
use super::shelter::Shelter;
use super::switching::SwitchingCosts;
use super::trials::{HORIZON, OF_KEPT, OF_OTHERS, OF_SHARED, Offer, Trials, expected_gain};
use crate::broad_phase::{FrameKind, FrameWork};
use crate::load::Load;
use crate::tuning::Tuning;

/// By number of objects alone, the algorithm of before stays while its own step is within this share.
const STEP_SLACK: f64 = 0.05;

/// A switch that is expected to save its price within so many frames is made at once.
const SOON: f64 = 4.0;

/// An algorithm that is expected to cost so many times as much is not tried: beliefs are seldom off by that, and to
/// ask how likely it is takes longer than the rest of a decision.
const HOPELESS: f64 = 4.0;

/// A frame waits for other programs no longer than this many times what it takes at most, as far as that counts: a
/// breakpoint or a page from disk tells nothing of the frames that follow.
const MOST_WAIT: f64 = 64.0;

/// Chooses, and learns from what the choices cost.
#[derive(Debug, Clone)]
pub(super) struct Policy {
    tuning: Tuning,
    /// Candidates that can run.
    usable: Vec<bool>,
    /// The candidate of each step.
    steps: Vec<usize>,
    /// Without cost curves there is nothing to correct.
    learner: Option<Learner>,
    learns: bool,
    explores: bool,
    switching: SwitchingCosts,
    shelter: Shelter,
    /// The candidate that runs unless one explores, and what ran last.
    settled: Option<usize>,
    ran: Option<usize>,
    estimates: Estimates,
    batch: FrameBatch,
    /// What each candidate would have saved since it became cheaper than the one that runs.
    saved_ns: Vec<f64>,
    /// Frames until the next decision at most: where a switch waits until it would have saved its price, until then,
    /// and as many at least as lose what a decision takes; where what would be cheapest is sheltered from, until it
    /// may run again.
    rests_at_most: Option<f64>,
    /// The number of the frame that is to run, and of the one that was decided last.
    frame: u64,
    decided: u64,
    trials: Trials,
    /// The last frame that was timed was one of a trial.
    tried: bool,
    /// What a decision takes in the mean, in nanoseconds.
    decision_ns: f64,
}

impl Policy {
    /// `kept` says for each candidate where it finds what the frame before left, if a frame is cheaper for it after
    /// one that was alike: one number for all that share it.
    pub(super) fn new(tuning: Tuning, kept: &[Option<usize>], usable: Vec<bool>) -> Self {
        let count = usable.len();
        let learner = (!tuning.costs.is_empty()).then(|| Learner::new(&tuning.costs, kept));
        let ids = tuning.algorithms();
        let steps = tuning.steps.iter().filter_map(|s| ids.iter().position(|id| **id == s.algorithm)).collect();
        Self {
            steps,
            learner,
            learns: true,
            explores: true,
            switching: SwitchingCosts::new(kept),
            shelter: Shelter::new(ids.iter().copied()),
            settled: None,
            ran: None,
            estimates: Estimates::new(count, tuning.costs.len()),
            batch: FrameBatch::default(),
            saved_ns: vec![0.0; count],
            rests_at_most: None,
            frame: 0,
            decided: 0,
            trials: Trials::default(),
            tried: false,
            decision_ns: 0.0,
            tuning,
            usable,
        }
    }

    pub(super) fn tuning(&self) -> &Tuning {
        &self.tuning
    }

    pub(super) fn set_learning(&mut self, learns: bool) {
        self.learns = learns;
        // It would not be paid for.
        self.trials.stop(self.frame);
    }

    pub(super) fn set_exploring(&mut self, explores: bool) {
        self.explores = explores;
    }

    /// Learns and explores if that one does.
    pub(super) fn set_as(&mut self, other: &Self) {
        (self.learns, self.explores) = (other.learns, other.explores);
    }

    /// The learner, once it has observed something.
    pub(super) fn learned(&self) -> Option<&Learner> {
        self.learner.as_ref().filter(|l| l.observed() > 0)
    }

    pub(super) fn set_usable(&mut self, candidate: usize, usable: bool) {
        self.usable[candidate] = usable;
        self.saved_ns[candidate] = 0.0;
        if !usable && self.settled == Some(candidate) {
            self.settled = None;
        }
        if !usable && self.trials.candidate() == Some(candidate) {
            self.trials.stop(self.frame);
        }
    }

    /// The frame failed. One of a trial has told nothing, and the next one would not either.
    pub(super) fn failed(&mut self) {
        self.trials.stop(self.frame);
    }

    /// Whether the number of objects alone decides.
    pub(super) fn is_by_count(&self) -> bool {
        self.tuning.costs.is_empty()
    }

    /// Other instances take the place of those of before.
    pub(super) fn remade(&mut self, kept: &[Option<usize>], usable: &[bool]) {
        (0..usable.len()).for_each(|k| self.set_usable(k, usable[k]));
        // A frame with them is a first one, and begins a batch of its own.
        self.ran = None;
        self.estimates.doubt();
        self.trials.stop(self.frame);
        self.batch = FrameBatch::default();
        if !self.switching.remade(kept) {
            self.switching = SwitchingCosts::new(kept);
            self.learner = self.learner.is_some().then(|| Learner::new(&self.tuning.costs, kept));
        }
    }

    /// Boxes were found to move so far in a frame, in edges.
    pub(super) fn moves(&mut self, moved: f64) {
        if let Some(learner) = self.learner.as_mut().filter(|_| self.learns) {
            learner.moves(moved);
        }
    }

    /// The number of the frame that is to run.
    pub(super) fn frame(&self) -> u64 {
        self.frame
    }

    /// The candidate that is to run the next frame. `None` when none can run.
    pub(super) fn choose(&mut self, load: &Load) -> Option<Choice> {
        let frames = (self.frame - std::mem::replace(&mut self.decided, self.frame)) as f64;
        self.rests_at_most = None;
        if self.is_by_count() {
            return self.choose_by_count(load.objects);
        }
        self.estimates.update(load, &self.tuning.costs, self.learner.as_ref(), &self.switching, self.frame);
        // Where all are avoided, all are as good as before.
        let best = self.cheapest(|k| !self.is_avoided(k)).or_else(|| self.cheapest(|_| true))?;
        let (settled, reason) = match self.settled {
            None if self.ran.is_none() => (best, Reason::First),
            None => (best, Reason::FellBack),
            Some(settled) if self.is_avoided(settled) => (best, Reason::Sheltered),
            Some(settled) => self.settle(settled, best, frames),
        };
        if let Some(sheltered) = self.cheapest(|_| true).filter(|&k| self.is_avoided(k)) {
            let lasts = self.shelter.lasts(sheltered, self.frame) as f64;
            self.rests_at_most = Some(self.rests_at_most.map_or(lasts, |most| most.min(lasts)));
        }
        if self.trials.is_over() || self.trials.candidate().is_some_and(|other| self.is_avoided(other)) {
            self.trials.stop(self.frame);
        }
        if self.settled != Some(settled) {
            self.saved_ns.fill(0.0);
            self.settled = Some(settled);
            self.trials.stop(self.frame);
        }
        self.trials.allow(self.estimates.mean_ns[settled], frames, load.objects);
        if reason == Reason::Stayed {
            self.offer_trial(settled);
        }
        Some(match self.trials.candidate() {
            Some(other) => self.choice(other, Reason::Explored),
            None => self.choice(settled, reason),
        })
    }

    /// Whether a candidate is not to run in this frame, since a frame of its method was far dearer than expected.
    fn is_avoided(&self, candidate: usize) -> bool {
        self.shelter.avoids(candidate, self.frame)
    }

    /// What a candidate took in the frame that ran, by all that is expected at most.
    fn is_dear(&mut self, candidate: usize, ns: f64) -> bool {
        let shelters = (0..self.usable.len()).filter(|&k| self.usable[k] && self.shelter.is_shelter(k));
        let Some(shelter_ns) = shelters.map(|k| self.estimates.mean_ns[k]).min_by(f64::total_cmp) else { return false };
        let most_ns = self.estimates.mean_ns[candidate]
            .max(self.switching.rebuild_ns(candidate, self.estimates.expected[candidate]));
        self.shelter.ran(candidate, self.frame, ns, most_ns, shelter_ns)
    }

    fn cheapest(&self, among: impl Fn(usize) -> bool) -> Option<usize> {
        let usable = (0..self.usable.len()).filter(|&k| self.usable[k] && among(k));
        usable.min_by(|&a, &b| self.estimates.mean_ns[a].total_cmp(&self.estimates.mean_ns[b]))
    }

    /// Whether to go on with the one that runs, or to which one to switch.
    ///
    /// A switch is made once the frames since the other became cheaper would have saved what it costs. Where costs
    /// hold still that loses at most twice what knowing the future would, and where they flicker about a border
    /// nothing is ever saved for long.
    fn settle(&mut self, settled: usize, best: usize, frames: f64) -> (usize, Reason) {
        let now = self.estimates.mean_ns[settled];
        for (saved, mean_ns) in self.saved_ns.iter_mut().zip(&self.estimates.mean_ns) {
            let gain = (now - mean_ns) * frames;
            *saved = if gain.is_finite() { (*saved + gain).max(0.0) } else { 0.0 };
        }
        if best == settled {
            return (settled, Reason::Stayed);
        }
        let price_ns = |k: usize| {
            self.switching.leave_ns(settled, k, self.frame, self.estimates.expected[settled])
                + self.switching.enter_ns(k, self.frame, self.estimates.expected[k])
        };
        let pays = |k: usize| {
            let gain_ns = now - self.estimates.mean_ns[k];
            gain_ns > 0.0 && self.saved_ns[k].max(SOON * gain_ns) >= price_ns(k) && !self.is_avoided(k)
        };
        if let Some(k) = self.cheapest(pays) {
            return (k, Reason::Switched);
        }
        // A decision that comes later than the switch has paid loses the gain of each frame in between. One that
        // comes sooner costs no more than the frames before it lose by waiting.
        let left_ns = (price_ns(best) - self.saved_ns[best]).max(self.decision_ns);
        self.rests_at_most = Some(left_ns / (now - self.estimates.mean_ns[best])).filter(|frames| *frames > 0.0);
        (settled, Reason::Hysteresis)
    }

    /// Frames until the next decision, at most, where a switch waits until it has saved its price or until a shelter
    /// ends.
    pub(super) fn rests_at_most(&self) -> Option<f64> {
        self.rests_at_most
    }

    /// Begins a trial of the candidate that is expected to save the most by it, if there is one.
    fn offer_trial(&mut self, settled: usize) {
        let Some(learner) = self.learner.as_ref().filter(|_| self.learns && self.explores) else { return };
        let now_ns = self.estimates.mean_ns[settled];
        let Some(allowance) = self.trials.allowance(self.frame, now_ns) else { return };
        let running = learner.running(settled, &self.estimates.view, self.estimates.predicted[settled].calls());
        let offer = |k: usize| {
            if k == settled || !self.usable[k] || self.is_avoided(k) || self.estimates.mean_ns[k] > HOPELESS * now_ns {
                return None;
            }
            let frames = match (self.switching.keeps(k), self.switching.share(k, settled)) {
                (_, true) => OF_SHARED,
                (true, false) => OF_KEPT,
                (false, false) => OF_OTHERS,
            };
            let enter_ns = self.switching.enter_ns(k, self.frame, self.estimates.expected[k]);
            let offer = Offer::of(k, frames, enter_ns, self.estimates.mean_ns[k], now_ns, self.decision_ns);
            if !allowance.may_pay(offer.price_ns) {
                return None;
            }
            let deviation = learner.told_of_ratio(
                &running,
                k,
                &self.estimates.view,
                self.estimates.predicted[k].calls(),
                offer.telling(),
            );
            let saved_ns = now_ns * expected_gain((self.estimates.mean_ns[k] / now_ns).ln(), deviation) * HORIZON;
            allowance.pays(offer.price_ns, saved_ns).then_some((offer, saved_ns - offer.price_ns))
        };
        let best = (0..self.usable.len()).filter_map(offer).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((offer, _)) = best {
            self.trials.begin(offer);
        }
    }

    fn choice(&self, chosen: usize, reason: Reason) -> Choice {
        let runner_up = self.cheapest(|k| k != chosen).map(|k| (k, self.estimates.mean_ns[k]));
        Choice { chosen, predicted_ns: Some(self.estimates.mean_ns[chosen]), runner_up, reason }
    }

    /// What is expected of the frames of a candidate until the next decision.
    pub(super) fn usual(&self, candidate: usize) -> Usual {
        if self.is_by_count() {
            return Usual::default();
        }
        let dearest_ns = self.switching.rebuild_ns(candidate, self.estimates.expected[candidate]);
        let trial = self.settled.zip(self.trials.rest()).filter(|_| self.trials.candidate() == Some(candidate));
        let trial = trial.map(|(settled, (_, left_ns))| Budget {
            now_ns: self.estimates.mean_ns[settled],
            left_ns,
            shares: self.switching.share(candidate, settled),
        });
        Usual { mean_ns: self.estimates.mean_ns[candidate], most_ns: MOST_OVER * dearest_ns, trial }
    }

    /// Takes in that a candidate ran some frames that were not decided on, none of which took longer than is usual.
    pub(super) fn went_on(&mut self, candidate: usize, passed: &Passed) {
        self.frame += u64::from(passed.frames);
        self.switching.ran(candidate, self.frame - 1, passed.frames, passed.rebuilt, passed.work);
        self.trials.ran(candidate, passed.frames);
        if !self.learns || passed.timed == 0 || self.learner.is_none() {
            return;
        }
        if self.tried {
            let all = f64::from(passed.frames) / f64::from(passed.timed);
            self.pay_for_trial(candidate, all * passed.ns, all * passed.over_mean, passed.frames, false);
        }
        self.make_room(candidate);
        let predicted = self.estimates.predicted[candidate].times(passed.over_mean);
        self.batch.add(passed.timed, passed.ns, predicted, &self.estimates.view);
        if let Some(learner) = &mut self.learner {
            learner.waited(candidate, passed.timed, 0.0, self.frame);
        }
        self.observe_full(candidate);
    }

    /// Takes in that a candidate ran the frame that was decided, what that took and how it came about; `None` where
    /// it builds on no frame before. Whether that was so much that the next frame is to be decided on, whatever it
    /// was before.
    pub(super) fn ran(&mut self, candidate: usize, ns: f64, work: Option<FrameWork>) -> bool {
        let entered = self.ran.replace(candidate) != Some(candidate);
        let rebuilt = work.is_some_and(|work| work.kind == FrameKind::Rebuilt);
        self.switching.ran(candidate, self.frame, 1, u32::from(rebuilt), work);
        self.trials.ran(candidate, 1);
        let dear = !self.is_by_count() && self.is_dear(candidate, ns);
        if self.learns {
            self.learn(candidate, entered, ns, work);
        }
        self.frame += 1;
        dear
    }

    fn learn(&mut self, candidate: usize, entered: bool, ns: f64, work: Option<FrameWork>) {
        let expected = self.estimates.expected[candidate];
        let dearest_ns = self.switching.rebuild_ns(candidate, expected);
        let tried = std::mem::replace(&mut self.tried, self.settled != Some(candidate));
        let Some(learner) = &mut self.learner else { return };
        if learner.is_stall(candidate, ns / dearest_ns, self.frame) {
            return;
        }
        if self.tried || entered && tried {
            self.pay_for_trial(candidate, ns, work.map_or(1.0, |work| work.over_mean), 1, entered);
        }
        if work.map_or(entered, |work| work.kind == FrameKind::Rebuilt) {
            self.switching.learn(candidate, ns, expected);
        }
        self.make_room(candidate);
        let Some(learner) = &mut self.learner else { return };
        // The first one is cold, and tells nothing of the rest.
        if !entered {
            // Until it is known what is dear, all of a frame counts.
            let known = learner.knows(candidate);
            let dearest_ns = if known { self.switching.rebuild_ns(candidate, expected) } else { f64::INFINITY };
            let counted_ns = ns.min(MOST_OVER * dearest_ns);
            let predicted = self.estimates.predicted[candidate].times(work.map_or(1.0, |work| work.over_mean));
            self.batch.add(1, counted_ns, predicted, &self.estimates.view);
            learner.waited(candidate, 1, (ns - counted_ns).min(MOST_WAIT * dearest_ns), self.frame);
        }
        self.observe_full(candidate);
    }

    /// Pays for frames of a trial, or the first one after it: what so many took of a candidate, with so much work in
    /// frames of its mean one.
    fn pay_for_trial(&mut self, candidate: usize, ns: f64, over_mean: f64, frames: u32, first: bool) {
        let Some(settled) = self.settled else { return };
        // What is made again in a frame would have been made again in any other way.
        let shares = candidate == settled || self.switching.share(candidate, settled);
        let work = if shares { over_mean } else { f64::from(frames) };
        self.trials.pay(ns - work * self.estimates.mean_ns[settled], first);
    }

    /// Makes the batch one to which frames of a candidate can be added. What was added up of others is observed.
    fn make_room(&mut self, candidate: usize) {
        if self.batch.takes(candidate) {
            return;
        }
        if let Some(learner) = self.learner.as_mut().filter(|_| self.batch.frames > 0) {
            learner.observe(&self.batch, self.frame);
        }
        self.batch = self.batch.next(candidate);
    }

    /// Observes the batch, of frames of a candidate, where it is full or no other frame of a trial follows.
    fn observe_full(&mut self, candidate: usize) {
        let Some(learner) = &mut self.learner else { return };
        if self.batch.is_full() || self.batch.frames > 0 && self.trials.is_over() {
            let believed = learner.observe(&self.batch, self.frame);
            // What surprises is looked at again soon.
            self.batch = if believed { self.batch } else { FrameBatch::default() }.next(candidate);
        }
    }

    /// Takes in what the decision for the frame that ran took, where that is known, and what decisions take in the
    /// mean.
    pub(super) fn decision_took(&mut self, ns: Option<f64>, mean_ns: f64) {
        self.decision_ns = mean_ns;
        if self.tried {
            self.trials.pay(ns.unwrap_or(mean_ns), true);
        }
    }

    /// Frames of a trial until its end, the one that ran counted; `None` where none runs.
    pub(super) fn trial_rests(&self) -> Option<u32> {
        self.trials.rest().map(|(frames, _)| frames)
    }

    /// The step that holds at this number of objects, or the nearest below or above that can run.
    fn choose_by_count(&mut self, objects: u32) -> Option<Choice> {
        let steps = &self.tuning.steps;
        let split = steps.partition_point(|s| s.from_objects <= objects);
        let (below, above) = self.steps.split_at(split);
        let chosen = below.iter().rev().chain(above).copied().find(|&k| self.usable[k])?;
        // The present one stays where it would hold a little below or above: only its own borders count.
        let holds = |current: usize, share: f64| {
            let scaled = (f64::from(objects) * share) as u32;
            let step = steps.partition_point(|s| s.from_objects <= scaled).checked_sub(1);
            step.is_some_and(|k| self.steps[k] == current)
        };
        let (chosen, reason) = match self.settled {
            None if self.ran.is_none() => (chosen, Reason::First),
            None => (chosen, Reason::FellBack),
            Some(current) if current == chosen => (chosen, Reason::Stayed),
            Some(current) if holds(current, 1.0 - STEP_SLACK) || holds(current, 1.0 + STEP_SLACK) => {
                (current, Reason::Hysteresis)
            }
            Some(_) => (chosen, Reason::Switched),
        };
        self.settled = Some(chosen);
        Some(Choice { chosen, predicted_ns: None, runner_up: None, reason })
    }
}
