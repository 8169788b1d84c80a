//! Chooses the algorithm of the next frame: the one with the lowest predicted cost after corrections.
//!
//! Frames that ran give two correction factors, one for the class of processor and one for the candidate. A switch
//! waits until it would have saved its price. Rare trials measure the cost of other candidates.

use super::decision::{Choice, Reason};
use super::epoch::Epoch;
use super::part::Part;
use super::trial::{Trial, Trials};
use super::wait::{MOST_WAIT, Wait};
use crate::algorithm::BackendClass;
use crate::broad_phase::{FrameKind, FrameWork};
use crate::cost::{Frame, Places, Residual};
use crate::load::Load;
use crate::tuning::{AlgorithmCost, Step, Tuning};
use std::sync::Arc;

/// If the number of objects alone decides, the incumbent stays within this share of the borders of its own step.
const STEP_SLACK: f64 = 0.05;

/// Cost of the first frame of a candidate over a usual one: its memory is in no cache, and its threads sleep.
const COLD: f64 = 1.15;
/// Cost of the first frame of an incremental algorithm over a mean one, and frames of others after which a frame
/// counts as a first one.
const FROM_NOTHING: f64 = 3.0;
const FORGOTTEN: u64 = 3;

/// Standard deviations of the logarithm of a factor before any observation: of a class of processor, of a candidate.
const CLASS_LN: f64 = 0.32;
const OWN_LN: f64 = 0.3;
/// Standard deviation of the logarithm of the time of one frame. For a mean of `n` frames the variance is divided by
/// `n` to the power `ALIKE`.
const FRAME_LN: f64 = 0.2;
const ALIKE: f64 = 0.7;
/// Least standard deviation of the logarithm of the mean time of an epoch, however long.
const EPOCH_LN: f64 = 0.05;
/// Additional standard deviation for the first frames of an incremental algorithm, and frames over which it falls to
/// an e-th.
const UNSETTLED_LN: f64 = 0.4;
const SETTLING_FRAMES: f64 = 16.0;
/// A surprise counts as at most `MOST_SURPRISE` standard deviations. After `NO_ACCIDENT` larger ones in a row to the
/// same side, the corrections are as uncertain as at first.
const MOST_SURPRISE: f64 = 3.0;
const NO_ACCIDENT: i32 = 3;
/// Change of the logarithm of the number of objects over which a candidate's own correction falls to an e-th.
const SIZE_LN: f64 = 2.0;

/// A frame stands out if it takes this many times the longest expected one.
const STANDS_OUT: f64 = 3.0;
/// Observed epochs after which a frame that takes far longer than expected counts as one that waited for another
/// program. Earlier, the expectation counts as wrong.
const KNOWN: u32 = 4;

/// A switch that is expected to save its price within this many frames is made at once.
const SOON: f64 = 4.0;

/// Frames of a trial of an incremental candidate, and of any other.
const OF_KEPT: u32 = 16;
const OF_OTHERS: u32 = 2;
/// A candidate is not tried if its expected cost is more than this many times that of the incumbent.
const HOPELESS: f64 = 2.0;
/// The tried candidate becomes the incumbent if it costs less than this share of the incumbent's cost.
const WINS: f64 = 0.97;
/// Cost of the decisions of a trial over that of a usual decision: they evaluate no curve.
const TRIAL_DECISIONS: f64 = 0.15;

#[derive(Debug, Clone)]
struct Candidate {
    usable: bool,
    /// Number of the state that it keeps from frame to frame; `None` if it keeps none.
    kept: Option<usize>,
    /// Of the candidates that share this state, the one with the most threads. It runs for all of them, and fits its
    /// threads to each frame.
    leader: usize,
    method: usize,
    class: usize,
    width: u32,
    own: Part,
    /// Observed epochs, and the position of its wait in [`Policy::waits`].
    observed: u32,
    wait: usize,
    /// Expected nanoseconds of a mean frame, without and with corrections.
    predicted_ns: f64,
    mean_ns: f64,
    /// Nanoseconds that it would have saved since it became cheaper than the incumbent.
    saved_ns: f64,
}

/// State that incremental algorithms keep from frame to frame.
#[derive(Debug, Clone, Copy, Default)]
struct Kept {
    /// The last frame that kept it, and the number of frames in a row up to that one.
    last: Option<u64>,
    run: u32,
}

/// Chooses, and learns from the times of frames.
#[derive(Debug, Clone)]
pub(super) struct Policy {
    pub(super) tuning: Tuning,
    candidates: Vec<Candidate>,
    classes: Vec<Part>,
    kept: Vec<Kept>,
    /// The first number of objects and the candidate of each step whose algorithm is a candidate, ascending.
    steps: Vec<(u32, usize)>,
    pub(super) learns: bool,
    pub(super) explores: bool,
    /// Observed epochs, and surprises in a row to one side, negative if costs were lower than expected.
    observed: u64,
    surprises: i32,
    /// By class of processor and width.
    waits: Vec<Wait>,
    /// The candidate that runs unless a trial does, and the one that ran last.
    incumbent: Option<usize>,
    ran: Option<usize>,
    trials: Trials,
    /// Number of the next frame, and of the one of the last decision.
    pub(super) frame: u64,
    decided: u64,
    /// Objects at the last decision.
    objects: u32,
    /// Upper bound on the frames until the next decision, set while a switch is pending.
    rest: Option<f64>,
    /// Nanoseconds of a decision.
    pub(super) decision_ns: f64,
}

impl Policy {
    /// Makes the policy of a tuning. `kept` is the result of [`Instances::kept`](super::instances::Instances::kept).
    pub(super) fn new(tuning: Tuning, kept: &[Option<usize>], usable: &[bool]) -> Self {
        let ids = tuning.algorithms();
        let (mut methods, mut classes): (Vec<&str>, Vec<BackendClass>) = (Vec::new(), Vec::new());
        let mut widths: Vec<(BackendClass, u32)> = Vec::new();
        let candidates = ids.iter().enumerate().map(|(k, &id)| Candidate {
            usable: usable[k],
            kept: kept[k],
            leader: k,
            method: number(&mut methods, id.method()),
            class: number(&mut classes, id.backend().class()),
            width: id.backend().width(),
            own: Part::new(OWN_LN),
            observed: 0,
            wait: number(&mut widths, (id.backend().class(), id.backend().width())),
            predicted_ns: 0.0,
            mean_ns: 0.0,
            saved_ns: 0.0,
        });
        let step = |s: &Step| Some((s.from_objects, ids.iter().position(|id| **id == s.algorithm)?));
        let mut made = Self {
            candidates: candidates.collect(),
            classes: vec![Part::new(CLASS_LN); classes.len()],
            kept: states(kept),
            steps: tuning.steps.iter().filter_map(step).collect(),
            learns: true,
            explores: true,
            observed: 0,
            surprises: 0,
            waits: vec![Wait::default(); widths.len()],
            incumbent: None,
            ran: None,
            trials: Trials::default(),
            frame: 0,
            decided: 0,
            objects: 0,
            rest: None,
            decision_ns: 0.0,
            tuning,
        };
        made.lead();
        made
    }

    /// Finds the leader of each candidate, and makes that of the incumbent the incumbent. If the number of objects
    /// alone decides, each candidate is its own leader.
    fn lead(&mut self) {
        for k in 0..self.candidates.len() {
            let shares = |&other: &usize| {
                let (one, other) = (&self.candidates[k], &self.candidates[other]);
                other.usable && one.kept.is_some() && one.kept == other.kept && !self.is_by_count()
            };
            let most = (0..self.candidates.len()).filter(shares).max_by_key(|&other| self.candidates[other].width);
            self.candidates[k].leader = most.unwrap_or(k);
        }
        self.incumbent = self.incumbent.map(|k| self.candidates[k].leader);
    }

    /// Returns whether there are corrections.
    pub(super) fn has_learned(&self) -> bool {
        self.observed > 0
    }

    /// Returns the costs with corrections.
    pub(super) fn learned_costs(&self) -> Vec<AlgorithmCost> {
        let costs = &self.tuning.costs;
        let places = self.tuning.places().map_or_else(Places::usual, Arc::clone);
        let learned = |(k, cost): (usize, &AlgorithmCost)| {
            let mut cost = cost.clone();
            let none = || Residual::new(Arc::clone(&places), Vec::new(), false);
            cost.curve.residual.get_or_insert_with(none).constant += self.correction_ln(self.candidates[k].leader);
            cost
        };
        costs.iter().enumerate().map(learned).collect()
    }

    /// Returns whether a first frame can be decided by the number of objects.
    pub(super) fn has_steps(&self) -> bool {
        self.steps.iter().any(|&(_, k)| self.candidates[k].usable)
    }

    /// Returns whether the number of objects alone decides.
    pub(super) fn is_by_count(&self) -> bool {
        self.tuning.costs.is_empty()
    }

    pub(super) fn set_usable(&mut self, candidate: usize, usable: bool) {
        let c = &mut self.candidates[candidate];
        (c.usable, c.saved_ns) = (usable, 0.0);
        if !usable {
            self.incumbent = self.incumbent.filter(|&k| k != candidate);
            self.trials.running = self.trials.running.filter(|trial| trial.candidate != candidate);
        }
        self.lead();
    }

    /// Records a failed frame: the next one runs the incumbent.
    pub(super) fn failed(&mut self) {
        self.trials.running = None;
    }

    /// Records that other instances replace the previous ones.
    pub(super) fn remade(&mut self, kept: &[Option<usize>], usable: &[bool]) {
        for (c, (&kept, &usable)) in self.candidates.iter_mut().zip(kept.iter().zip(usable)) {
            (c.kept, c.usable, c.saved_ns) = (kept, usable, 0.0);
        }
        self.incumbent = self.incumbent.filter(|&k| usable[k]);
        self.kept = states(kept);
        self.lead();
        (self.ran, self.trials.running) = (None, None);
    }

    /// Chooses for the next frame. `None` if no candidate is usable.
    pub(super) fn choose(&mut self, load: &Load) -> Option<Choice> {
        let frames = (self.frame - std::mem::replace(&mut self.decided, self.frame)) as f64;
        self.rest = None;
        if self.is_by_count() {
            return self.choose_by_count(load.objects);
        }
        self.expect(load);
        let best = self.cheapest(|_| true)?;
        let (incumbent, reason) = match self.incumbent {
            None if self.ran.is_none() => (best, Reason::First),
            None => (best, Reason::FellBack),
            Some(k) => self.settle(k, best, frames),
        };
        if self.incumbent != Some(incumbent) {
            self.appoint(incumbent);
        }
        self.trials.earn(frames * self.candidates[incumbent].mean_ns);
        // The load may have changed since the trial began.
        let goes_on = |trial: &Trial| !trial.is_over() && !self.is_hopeless(trial.candidate, incumbent);
        self.trials.running = self.trials.running.filter(|trial| reason == Reason::Stayed && goes_on(trial));
        if reason == Reason::Stayed && self.learns && self.explores {
            self.offer_trial(incumbent);
        }
        Some(match self.trials.running {
            Some(trial) => self.choice(trial.candidate, Reason::Explored),
            None => self.choice(incumbent, reason),
        })
    }

    /// Chooses for the first frame, by the number of its objects alone.
    pub(super) fn choose_first(&mut self, objects: u32) -> Option<Choice> {
        (self.decided, self.objects) = (self.frame, objects);
        self.choose_by_count(objects)
    }

    fn appoint(&mut self, incumbent: usize) {
        self.candidates.iter_mut().for_each(|c| c.saved_ns = 0.0);
        self.incumbent = Some(incumbent);
    }

    fn correction_ln(&self, candidate: usize) -> f64 {
        let c = &self.candidates[candidate];
        self.classes[c.class].mean(self.frame) + c.own.mean(self.frame)
    }

    /// Computes the expected cost of each candidate.
    fn expect(&mut self, load: &Load) {
        let growth_ln = (f64::from(load.objects.max(1)) / f64::from(self.objects.max(1))).ln().abs();
        self.objects = load.objects;
        let keep = (-growth_ln / SIZE_LN).exp();
        let frame = Frame::new(load);
        for (c, cost) in self.candidates.iter_mut().zip(&self.tuning.costs) {
            c.predicted_ns = cost.curve.cost_of(&frame);
            c.own.fade(keep);
        }
        for k in 0..self.candidates.len() {
            let Candidate { usable: true, predicted_ns: ns, leader, .. } = self.candidates[k] else { continue };
            self.candidates[leader].predicted_ns = self.candidates[leader].predicted_ns.min(ns);
        }
        (0..self.candidates.len()).for_each(|k| self.correct(k));
    }

    /// Corrects the expected cost of a candidate.
    fn correct(&mut self, candidate: usize) {
        let factor = self.correction_ln(candidate).exp();
        let c = &mut self.candidates[candidate];
        c.mean_ns = c.predicted_ns * factor + self.waits[c.wait].ns(self.frame);
    }

    fn cheapest(&self, among: impl Fn(usize) -> bool) -> Option<usize> {
        let usable = (0..self.candidates.len()).filter(|&k| self.is_choice(k) && among(k));
        usable.min_by(|&a, &b| self.candidates[a].mean_ns.total_cmp(&self.candidates[b].mean_ns))
    }

    /// Returns whether a candidate may be chosen.
    pub(super) fn is_choice(&self, candidate: usize) -> bool {
        let c = &self.candidates[candidate];
        c.usable && c.leader == candidate
    }

    /// Returns whether a candidate finds its state as recent frames left it.
    fn remembers(&self, candidate: usize) -> bool {
        let last = self.candidates[candidate].kept.and_then(|kept| self.kept[kept].last);
        last.is_some_and(|last| self.frame - last <= FORGOTTEN)
    }

    /// Returns the expected nanoseconds of a first frame of a candidate.
    fn first_ns(&self, candidate: usize) -> f64 {
        let c = &self.candidates[candidate];
        c.mean_ns * if c.kept.is_some() { FROM_NOTHING } else { COLD }
    }

    /// Returns the extra nanoseconds of the first frame if a candidate runs next.
    fn enter_ns(&self, candidate: usize) -> f64 {
        let mean_ns = self.candidates[candidate].mean_ns;
        if self.remembers(candidate) { (COLD - 1.0) * mean_ns } else { self.first_ns(candidate) - mean_ns }
    }

    /// Returns the price of a switch: the extra time of the first frame of the new candidate, and later that of the
    /// old one if its state is lost.
    fn price_ns(&self, from: usize, to: usize) -> f64 {
        let leave_ns = if self.remembers(from) { self.first_ns(from) - self.candidates[from].mean_ns } else { 0.0 };
        leave_ns + self.enter_ns(to)
    }

    /// Returns the next incumbent and the reason. Switches when the frames since another candidate became cheaper
    /// would have saved the price. If costs stay constant, the loss is at most twice that of a decision with knowledge
    /// of the future. If they flicker, no switch happens for long.
    fn settle(&mut self, incumbent: usize, best: usize, frames: f64) -> (usize, Reason) {
        let now_ns = self.candidates[incumbent].mean_ns;
        for c in &mut self.candidates {
            let gain = (now_ns - c.mean_ns) * frames;
            c.saved_ns = if gain.is_finite() { (c.saved_ns + gain).max(0.0) } else { 0.0 };
        }
        if best == incumbent {
            return (incumbent, Reason::Stayed);
        }
        let pays = |k: usize| {
            let gain_ns = now_ns - self.candidates[k].mean_ns;
            let saved_ns = self.candidates[k].saved_ns.max(SOON * gain_ns);
            gain_ns > 0.0 && saved_ns >= self.price_ns(incumbent, k)
        };
        if let Some(k) = self.cheapest(pays) {
            return (k, Reason::Switched);
        }
        // If the next decision comes after the switch would have paid, each frame in between loses the gain.
        let left_ns = (self.price_ns(incumbent, best) - self.candidates[best].saved_ns).max(self.decision_ns);
        self.rest = Some(left_ns / (now_ns - self.candidates[best].mean_ns)).filter(|frames| *frames > 0.0);
        (incumbent, Reason::Hysteresis)
    }

    /// Returns the least and the most frames until the next decision, so that it neither disturbs a trial nor misses a
    /// pending switch.
    pub(super) fn rest(&self) -> (f64, f64) {
        let least = self.trials.running.map_or(0.0, |trial| f64::from(trial.left) + 1.0);
        (least, self.rest.unwrap_or(f64::INFINITY))
    }

    /// Returns whether two candidates are similar enough for a trial, or of different classes of processor: the same
    /// method on at most twice as many threads, the same number of threads, or one of them incremental.
    fn is_near(&self, one: usize, other: usize) -> bool {
        let (one, other) = (&self.candidates[one], &self.candidates[other]);
        let (low, high) = (one.width.min(other.width), one.width.max(other.width));
        let fits = one.kept.is_some() || other.kept.is_some();
        one.class != other.class || low == high || fits || one.method == other.method && high <= 2 * low
    }

    fn is_hopeless(&self, candidate: usize, incumbent: usize) -> bool {
        self.candidates[candidate].mean_ns > HOPELESS * self.candidates[incumbent].mean_ns
    }

    /// Begins the trial with the highest expected saving beyond its price, if any pays.
    fn offer_trial(&mut self, incumbent: usize) {
        let now_ns = self.candidates[incumbent].mean_ns;
        if !self.trials.may_begin(self.frame, now_ns) {
            return;
        }
        let offer = |k: usize| {
            let c = &self.candidates[k];
            if k == incumbent || !self.is_choice(k) || self.is_hopeless(k, incumbent) || !self.is_near(k, incumbent) {
                return None;
            }
            let frames = if c.kept.is_some() { OF_KEPT } else { OF_OTHERS };
            let more_ns = f64::from(frames) * (c.mean_ns - now_ns).max(0.0);
            let price_ns = self.enter_ns(k) + more_ns + TRIAL_DECISIONS * self.decision_ns;
            let unknown = c.own.variance(self.frame) + self.candidates[incumbent].own.variance(self.frame);
            let told_ln = unknown / (unknown + noise(frames)).sqrt();
            self.trials.offer(k, frames, price_ns, now_ns, (c.mean_ns / now_ns).ln(), told_ln)
        };
        let best = (0..self.candidates.len()).filter_map(offer).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((trial, _)) = best {
            (self.trials.running, self.trials.begun_at) = (Some(trial), self.frame);
        }
    }

    fn choice(&self, chosen: usize, reason: Reason) -> Choice {
        let mean_ns = |k: usize| self.candidates[k].mean_ns;
        let runner_up = self.cheapest(|k| k != chosen).map(|k| (k, mean_ns(k)));
        Choice { chosen, predicted_ns: Some(mean_ns(chosen)), runner_up, reason }
    }

    /// Makes an epoch of frames of a candidate.
    pub(super) fn epoch(&self, candidate: usize) -> Epoch {
        let mean_ns = self.candidates[candidate].mean_ns;
        // A candidate that was chosen by count alone has no expected cost.
        let most_ns = if mean_ns > 0.0 { STANDS_OUT * self.first_ns(candidate) } else { f64::INFINITY };
        Epoch::expecting(mean_ns, most_ns)
    }

    /// Records a frame of a candidate that was decided, stood out or belongs to a trial. Adds it to the epoch if its
    /// cost is a usual one. If `ns` is `None`, the clock was too coarse: the frame counts as expected and adds
    /// nothing.
    pub(super) fn ran(&mut self, candidate: usize, ns: Option<f64>, work: Option<FrameWork>, epoch: &mut Epoch) {
        let frame = self.frame + u64::from(epoch.frames);
        let entered = self.ran.replace(candidate) != Some(candidate);
        let remembered = self.remembers(candidate);
        let first_ns = self.first_ns(candidate);
        let c = &self.candidates[candidate];
        let (kept, observed, wait) = (c.kept, c.observed, c.wait);
        let (timed, ns) = (ns.is_some(), ns.unwrap_or(c.mean_ns));
        let now_ns = self.incumbent.map_or(0.0, |k| self.candidates[k].mean_ns);
        self.trials.ran(ns - now_ns);
        // A first frame has no usual cost. Its excess is known if the candidate keeps no state.
        let cold = entered && kept.is_none();
        let most_ns = if observed < KNOWN { f64::INFINITY } else { STANDS_OUT * first_ns };
        let waited_ns = (ns - most_ns).max(0.0);
        if waited_ns > 0.0 {
            self.waits[wait].add(waited_ns.min(MOST_WAIT * most_ns), frame);
        }
        if timed && (!entered || cold || remembered) {
            epoch.count((ns - waited_ns) / if cold { COLD } else { 1.0 }, work);
        }
    }

    /// Learns from an epoch of a candidate. `work` is that of its last frame.
    pub(super) fn observe(&mut self, candidate: usize, epoch: &Epoch, work: Option<FrameWork>) {
        let c = &self.candidates[candidate];
        let mut unsettled = 0.0;
        if let Some(kept) = c.kept {
            let Kept { last, run } = &mut self.kept[kept];
            let goes_on = last.is_some_and(|last| self.frame - last <= FORGOTTEN);
            *run = if goes_on { run.saturating_add(epoch.frames) } else { 0 };
            unsettled = UNSETTLED_LN * (-f64::from(*run) / SETTLING_FRAMES).exp();
            let keeps = work.is_some_and(|work| work.kind != FrameKind::FromScratch);
            *last = keeps.then(|| self.frame + u64::from(epoch.frames) - 1);
        }
        self.frame += u64::from(epoch.frames);
        self.waits[c.wait].pass(epoch.timed, self.frame);
        let surprise = (epoch.ns / (epoch.work * c.predicted_ns)).ln() - self.correction_ln(candidate);
        if !self.learns || epoch.timed == 0 || !surprise.is_finite() {
            return;
        }
        self.observed += 1;
        self.candidates[candidate].observed += 1;
        let c = &self.candidates[candidate];
        let (class, own) = (&mut self.classes[c.class], &mut self.candidates[candidate].own);
        let known = EPOCH_LN * EPOCH_LN + unsettled * unsettled + noise(epoch.timed);
        let variance = |class: &Part, own: &Part| class.variance(self.frame) + own.variance(self.frame) + known;
        self.surprises = match surprise.signum() as i32 {
            _ if surprise.abs() <= MOST_SURPRISE * variance(class, own).sqrt() => 0,
            side if self.surprises.signum() == -side => side,
            side => self.surprises + side,
        };
        if self.surprises.abs() >= NO_ACCIDENT {
            self.surprises = 0;
            class.doubt();
            own.doubt();
        }
        let variance = variance(class, own);
        let most = MOST_SURPRISE * variance.sqrt();
        for part in [class, own] {
            part.absorb(surprise.clamp(-most, most), variance, self.frame);
        }
    }

    /// Returns whether a trial runs.
    pub(super) fn tries(&self) -> bool {
        self.trials.running.is_some()
    }

    /// Returns whether the running trial is over.
    pub(super) fn ends_trial(&self) -> bool {
        self.trials.running.is_some_and(|trial| trial.is_over())
    }

    /// Ends the trial, and chooses the tried candidate or the incumbent. Needs no load.
    pub(super) fn end_trial(&mut self) -> Option<Choice> {
        let trial = self.trials.running.take()?;
        let incumbent = self.incumbent?;
        (0..self.candidates.len()).for_each(|k| self.correct(k));
        if self.candidates[trial.candidate].mean_ns < WINS * self.candidates[incumbent].mean_ns {
            self.appoint(trial.candidate);
            return Some(self.choice(trial.candidate, Reason::Switched));
        }
        Some(self.choice(incumbent, Reason::Stayed))
    }

    /// Chooses the step for this number of objects, or the nearest one below, then above, that can run.
    fn choose_by_count(&mut self, objects: u32) -> Option<Choice> {
        let begun = |objects: u32| self.steps.partition_point(|&(from, _)| from <= objects);
        let (below, above) = self.steps.split_at(begun(objects));
        let mut leaders = below.iter().rev().chain(above).map(|&(_, k)| self.candidates[k].leader);
        let chosen = leaders.find(|&k| self.candidates[k].usable)?;
        // The slack applies only to the borders of the incumbent's own steps.
        let holds = |incumbent: usize, share: f64| {
            let step = begun((f64::from(objects) * share) as u32).checked_sub(1);
            step.is_some_and(|k| self.steps[k].1 == incumbent)
        };
        let (chosen, reason) = match self.incumbent {
            None if self.ran.is_none() => (chosen, Reason::First),
            None => (chosen, Reason::FellBack),
            Some(k) if k == chosen => (chosen, Reason::Stayed),
            Some(k) if holds(k, 1.0 - STEP_SLACK) || holds(k, 1.0 + STEP_SLACK) => (k, Reason::Hysteresis),
            Some(_) => (chosen, Reason::Switched),
        };
        self.incumbent = Some(chosen);
        Some(Choice { chosen, predicted_ns: None, runner_up: None, reason })
    }
}

/// Returns the variance of the logarithm of the mean time of some frames.
fn noise(frames: u32) -> f64 {
    FRAME_LN * FRAME_LN / f64::from(frames).powf(ALIKE)
}

/// Returns the states before the first frame.
fn states(kept: &[Option<usize>]) -> Vec<Kept> {
    vec![Kept::default(); kept.iter().flatten().max().map_or(0, |most| most + 1)]
}

/// Returns the position of a value in a list, and appends it if it is new.
fn number<T: PartialEq>(list: &mut Vec<T>, what: T) -> usize {
    list.iter().position(|known| *known == what).unwrap_or_else(|| {
        list.push(what);
        list.len() - 1
    })
}
