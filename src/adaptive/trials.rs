//! Trials: another algorithm than the one that is settled on runs for some frames, so that it is learned what it costs.

use crate::stats::normal_density;

/// What is found out is taken to be of use for this many frames: five seconds of a game.
pub(super) const HORIZON: f64 = 300.0;

/// Share of the time of all frames that trials may cost.
const SHARE: f64 = 0.005;
/// Frames' worth of that which is there at the start: one frame in which an incremental algorithm begins costs two or
/// three.
const AT_FIRST: f64 = 4.0;
/// Where the objects are suddenly so many times the most so far, a level that loads, the difference is a start of its
/// own: without it a level of 3000 boxes took 1.38 times the best single algorithm (n 8) in place of 1.09 (n 4). A
/// scene that grows slowly brings along what it has learned.
const SUDDENLY: f64 = 1.25;
/// No more frames' worth than these are saved up: else a long rest would be followed by one trial after the other.
const MOST: f64 = 12.0;
/// A trial that is expected to save so many times its price beside that is made on credit, up to so many frames'
/// worth. In 80 runs of 20 scenes such trials would have saved as much as they were expected to, a fifth of the
/// frames, and were the most that was lost; half as many times costs 0.9 % more in replayed runs:
/// docs/methodology.md.
const ON_CREDIT: f64 = 16.0;
const MOST_DEBT: f64 = 8.0;
/// Frames between the end of a trial and the beginning of the next, at least.
const APART: u64 = 20;
/// Frames after which it is looked again whether a trial pays, where none did: to look takes longer than the rest of
/// a decision.
const LOOK_AGAIN: u64 = 8;

/// Frames of a trial of an algorithm that keeps work from frame to frame, at most: its first one makes that, the
/// others show what it saves, and `pair-cache` finds the size of its margin in a hundred. Where it costs no more than
/// the one that runs, they cost nothing. One that goes on with what the one that runs keeps is that with another
/// number of threads, which shows slowly: its first frame wakes them and takes 1.6 times as long as in another
/// instance (median of 413; 2.4 in the mean), and later ones differ among themselves by more than the two numbers do.
/// Any other algorithm shows what it costs in its second frame; the first one is cold.
pub(super) const OF_KEPT: u32 = 128;
pub(super) const OF_SHARED: u32 = 8;
pub(super) const OF_OTHERS: u32 = 2;
/// A trial ends when the frames behind its first one have cost so many frames' worth: what that one has cost is spent.
const ENOUGH: f64 = 2.0;

/// The trial that runs, and what trials may cost.
#[derive(Debug, Clone, Default)]
pub(super) struct Trials {
    running: Option<Trial>,
    /// The frame before which none may begin.
    not_before: u64,
    /// What trials may cost now, in nanoseconds.
    allowance_ns: f64,
    /// The most objects so far, and what their frame was expected to take, in nanoseconds.
    most: (u32, f64),
}

#[derive(Debug, Clone, Copy)]
struct Trial {
    candidate: usize,
    /// Frames that are left.
    left: u32,
    /// What it may cost still, in nanoseconds.
    left_ns: f64,
}

/// What a trial may cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Allowance {
    /// What is there, in nanoseconds; less than nothing after trials that turned out dear or were made on credit.
    ns: f64,
    credit: bool,
}

impl Allowance {
    /// Whether a trial of this price may be made if it is expected to save enough.
    pub(super) fn may_pay(&self, price_ns: f64) -> bool {
        price_ns <= self.ns || self.credit
    }

    /// Whether it is made, where it is expected to save so much.
    pub(super) fn pays(&self, price_ns: f64, saved_ns: f64) -> bool {
        let least = if price_ns <= self.ns { 1.0 } else { 1.0 + ON_CREDIT };
        self.may_pay(price_ns) && saved_ns > least * price_ns
    }
}

/// A trial that may be made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Offer {
    candidate: usize,
    frames: u32,
    /// What it is expected to cost beside what frames cost now, its decisions included.
    pub(super) price_ns: f64,
    now_ns: f64,
}

impl Offer {
    /// Of so many frames of a candidate, of which one is expected to take `mean_ns` and the first one `switch_ns`
    /// more, where one takes `now_ns`. A decision takes `decision_ns`.
    pub(super) fn of(
        candidate: usize,
        frames: u32,
        switch_ns: f64,
        mean_ns: f64,
        now_ns: f64,
        decision_ns: f64,
    ) -> Self {
        // One that turns out dear ends early.
        let dear_ns = (f64::from(frames) * (mean_ns - now_ns).max(0.0)).min(ENOUGH * now_ns);
        // One decision, after its last frame. That before its first is made in any case.
        Self { candidate, frames, price_ns: switch_ns + dear_ns + decision_ns, now_ns }
    }

    /// Frames that tell what it costs: all but the first.
    pub(super) fn telling(&self) -> u32 {
        self.frames - 1
    }
}

impl Trials {
    /// The candidate that is tried now.
    pub(super) fn candidate(&self) -> Option<usize> {
        self.running.map(|t| t.candidate)
    }

    /// Adds to what trials may cost that of some frames with so many objects which are expected to take `now_ns` each.
    pub(super) fn allow(&mut self, now_ns: f64, frames: f64, objects: u32) {
        let (most, dearest_ns) = self.most;
        let dearest_now_ns = now_ns.max(dearest_ns);
        // An empty world is one that begins, too.
        let loads = dearest_ns == 0.0 || objects > most && f64::from(objects) >= SUDDENLY * f64::from(most);
        let dearer_ns = if loads { dearest_now_ns - dearest_ns } else { 0.0 };
        if objects > most || loads {
            self.most = (objects, dearest_now_ns);
        }
        self.allowance_ns = (self.allowance_ns + AT_FIRST * dearer_ns + SHARE * now_ns * frames).min(MOST * now_ns);
    }

    /// What a trial may cost that begins with this frame, where frames take `now_ns`; `None` where none may begin.
    /// The next look is some frames later.
    pub(super) fn allowance(&mut self, frame: u64, now_ns: f64) -> Option<Allowance> {
        if self.running.is_some() || frame < self.not_before {
            return None;
        }
        self.not_before = frame + LOOK_AGAIN;
        Some(Allowance { ns: self.allowance_ns, credit: self.allowance_ns > -MOST_DEBT * now_ns })
    }

    /// Begins a trial.
    pub(super) fn begin(&mut self, offer: Offer) {
        let Offer { candidate, frames, now_ns, .. } = offer;
        self.running = Some(Trial { candidate, left: frames, left_ns: ENOUGH * now_ns });
    }

    /// Takes in what a decision, or a frame of a trial, its `first` or another, or the first one after it has cost
    /// beside what frames cost otherwise. What decisions and first frames cost can't be saved any more, and ends no
    /// trial.
    pub(super) fn pay(&mut self, ns: f64, first: bool) {
        self.allowance_ns -= ns;
        if let Some(trial) = self.running.as_mut().filter(|_| !first) {
            trial.left_ns -= ns;
        }
    }

    /// Takes in that a candidate ran some frames.
    pub(super) fn ran(&mut self, candidate: usize, frames: u32) {
        if let Some(trial) = self.running.as_mut().filter(|t| t.candidate == candidate) {
            trial.left = trial.left.saturating_sub(frames);
        }
    }

    /// Frames from the last one of a trial, that one counted, until its end, and what they may cost beside what
    /// frames cost otherwise, in nanoseconds.
    pub(super) fn rest(&self) -> Option<(u32, f64)> {
        self.running.map(|t| (t.left + 1, t.left_ns))
    }

    /// Whether a trial runs that is over.
    pub(super) fn is_over(&self) -> bool {
        self.running.is_some_and(|t| t.left == 0 || t.left_ns < 0.0)
    }

    /// Ends the trial that runs before this frame, if one does.
    pub(super) fn stop(&mut self, frame: u64) {
        if self.running.take().is_some() {
            self.not_before = frame + APART;
        }
    }
}

/// Expected saving, as a share of the present cost, of knowing what another costs: the mean over a normal
/// distribution of the logarithm `ln_ratio` of other over present cost, of what is below nought.
pub(super) fn expected_gain(ln_ratio: f64, deviation: f64) -> f64 {
    if deviation <= 0.0 {
        return 0.0;
    }
    let u = -ln_ratio / deviation;
    // What is saved beside what a switch without looking would save already.
    (deviation * (normal_density(u) + u * cumulative(u)) - (-ln_ratio).max(0.0)).max(0.0)
}

/// The cumulative distribution of the standard normal one, to 1e-2: the logistic curve that comes closest. With it
/// nothing is to be gained from what is expected to cost over 1.8 deviations more, where the exact curve has a
/// hundredth of a deviation and less: what is that far off is not tried.
fn cumulative(x: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * x).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_cost_no_more_than_their_share_however_dear_they_turn_out() {
        let mut trials = Trials::default();
        let (mut paid, mut begun) = (0.0, 0);
        for frame in 0..20_000 {
            if trials.is_over() {
                trials.stop(frame);
            }
            trials.allow(100.0, 1.0, 9);
            let offer = Offer::of(1, [OF_KEPT, OF_OTHERS][begun % 2], 150.0, 130.0, 100.0, 1.0);
            if trials.allowance(frame, 100.0).is_some_and(|a| a.pays(offer.price_ns, 2.0 * offer.price_ns)) {
                trials.begin(offer);
                begun += 1;
            }
            if trials.candidate().is_some() {
                trials.ran(1, 1);
                trials.pay(170.0, false);
                paid += 170.0;
            }
        }
        // Of the last one only the price that was expected was there.
        assert!(paid <= (0.005 * 20_000.0 + 4.0 + 12.0) * 100.0 && paid > 9000.0, "{paid} for {begun}");
    }
}
