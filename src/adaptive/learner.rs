//! What the frames that were run tell about the cost of every algorithm: the [`Belief`] observes them, in batches.

use super::frame_batch::{FrameBatch, MOST_OVER};
use super::switching::works;
use crate::algorithm::BackendClass;
use crate::cost::Frame;
use crate::tuning::AlgorithmCost;
use crate::tuning::belief::{Belief, Deviations, MOST_SURPRISE, Running, View};

/// Frames after which half of what was seen of waits is forgotten.
const WAIT_FRAMES: f64 = 800.0;
/// Share of each frame in the mean time that frames of a width wait for other programs, and batches of an algorithm
/// before its frames count for that: until then what is dearer than expected was expected wrongly.
const WAIT_SHARE: f64 = 1.0 / 128.0;
const KNOWN: u32 = 4;

/// A frame that takes so many times what the dearest kind of it is expected to, the latter before the algorithm is
/// known, and of which there was no other for so many frames, is a stall: a page from disk, a breakpoint, another
/// program. It tells nothing of any algorithm. Those that come again are waits of its width.
const STALL: [f64; 2] = [MOST_OVER, 64.0];
const STALLS_APART: u64 = 50;

/// The noise of a frame: standard deviation of its logarithm around what is expected of it. To learn it for each
/// algorithm is worth nothing: docs/methodology.md. With twice as much, one frame of a trial tells so little that the
/// same algorithm was tried five times in one real run.
const NOISE_LN: f64 = 0.2;
/// Of this many frames in a row the mean is as noisy as of this power of their number far apart.
const ALIKE: f64 = 0.7;

/// What keeps work takes another time in its first frames than later: it is yet to find what to keep. In a level of
/// 3000 boxes that loads, `pair-cache` took 220 to 280 us a frame in its first thirty and 185 from then on. So the
/// first ones count for less: standard deviation of the logarithm by which they are off at the beginning, and frames
/// in which that falls to an e-th.
const UNSETTLED_LN: f64 = 0.3;
const SETTLING_FRAMES: f64 = 32.0;

/// This many surprises in a row that are too large to be believed, all to the same side, are no accident: the machine
/// or the scene has changed.
const NO_ACCIDENT: u32 = 3;

/// What is known about one algorithm's frames beside their cost.
#[derive(Debug, Clone)]
struct Frames {
    /// Where in the list of waits its width stands, and how often it was observed.
    wait: usize,
    batches: u32,
    /// Surprises in a row, counted with their sign.
    run: i32,
    /// Where in the list of kept work that stands which it keeps, if it does.
    kept: Option<usize>,
}

/// Variance of the mean of the logarithms of so many frames in a row. They are alike, so that many of them tell less
/// than as many that were far apart.
fn noise(frames: u32) -> f64 {
    NOISE_LN.powi(2) / f64::from(frames).powf(ALIKE)
}

/// Follows the costs of all algorithms. Allocates when it is made.
#[derive(Debug, Clone)]
pub(super) struct Learner {
    belief: Belief,
    frames: Vec<Frames>,
    /// One for each class and width.
    waits: Vec<Wait>,
    /// By what is kept, frames that were observed.
    since: Vec<u32>,
    observed: u64,
    /// How far boxes moved when what is known of keeping was observed.
    moved: Option<f64>,
}

/// How long frames of a width wait for other programs.
#[derive(Debug, Clone, Copy, Default)]
struct Wait {
    /// The mean, in nanoseconds, and the frame at which that held.
    mean_ns: f64,
    at: u64,
    /// The last frame that took far longer than expected.
    stalled: Option<u64>,
}

impl Learner {
    /// `kept` as [`Policy::new`](super::policy::Policy::new) has it.
    pub(super) fn new(costs: &[AlgorithmCost], kept: &[Option<usize>]) -> Self {
        let mut widths: Vec<(BackendClass, u32)> = Vec::new();
        let frames = costs.iter().zip(kept).map(|(cost, kept)| {
            let backend = cost.algorithm.backend();
            let width = (backend.class(), backend.width());
            let wait = widths.iter().position(|w| *w == width).unwrap_or_else(|| {
                widths.push(width);
                widths.len() - 1
            });
            Frames { wait, batches: 0, run: 0, kept: *kept }
        });
        let frames = frames.collect();
        Self {
            belief: Belief::new(costs, kept, Deviations::IN_LINE),
            frames,
            waits: vec![Wait::default(); widths.len()],
            since: vec![0; works(kept)],
            observed: 0,
            moved: None,
        }
    }

    /// Batches that were observed.
    pub(super) fn observed(&self) -> u64 {
        self.observed
    }

    /// Boxes move so far in a frame now, in edges.
    pub(super) fn moves(&mut self, moved: f64) {
        let before = *self.moved.get_or_insert(moved);
        if self.belief.change_pace(before, moved) {
            self.moved = Some(moved);
        }
    }

    /// A load as what was learned sees it.
    pub(super) fn view(&self, frame: &Frame<'_>) -> View {
        self.belief.view(frame)
    }

    /// Mean time that a frame of an algorithm waits for other programs, in nanoseconds. A helper whose core another
    /// program has waits until the scheduler's next turn, however short the frame: a hundred times as long as some.
    /// The mean is what counts, so that this is not noise, and it is no factor either.
    pub(super) fn wait_ns(&self, algorithm: usize, frame: u64) -> f64 {
        let Wait { mean_ns, at, .. } = self.waits[self.frames[algorithm].wait];
        mean_ns / (1.0 + frame.saturating_sub(at) as f64 / WAIT_FRAMES)
    }

    /// By how much the mean of the next so many frames of an algorithm may be off for being among its first: the
    /// variance of its logarithm.
    fn settle(&mut self, algorithm: usize, frames: u32) -> f64 {
        self.frames[algorithm].kept.map_or(0.0, |kept| {
            let since = &mut self.since[kept];
            let off_ln = UNSETTLED_LN * (-f64::from(*since) / SETTLING_FRAMES).exp();
            *since = since.saturating_add(frames);
            off_ln * off_ln
        })
    }

    /// Whether an algorithm was observed often enough to tell a frame that waited from one that was expected wrongly.
    pub(super) fn knows(&self, algorithm: usize) -> bool {
        self.frames[algorithm].batches >= KNOWN
    }

    /// Whether a frame that took so many times what the dearest kind of it is expected to is to be charged to nobody.
    pub(super) fn is_stall(&mut self, algorithm: usize, over: f64, frame: u64) -> bool {
        if over <= STALL[usize::from(!self.knows(algorithm))] {
            return false;
        }
        let last = self.waits[self.frames[algorithm].wait].stalled.replace(frame);
        last.is_none_or(|last| frame - last > STALLS_APART)
    }

    /// Takes in that each of some frames took this many nanoseconds more than any of its kind is expected to, or none.
    pub(super) fn waited(&mut self, algorithm: usize, frames: u32, ns: f64, frame: u64) {
        if self.knows(algorithm) {
            let before = self.wait_ns(algorithm, frame);
            let wait = &mut self.waits[self.frames[algorithm].wait];
            let stays = (1.0 - WAIT_SHARE).powi(frames.min(1024) as i32);
            (wait.mean_ns, wait.at) = (ns + stays * (before - ns), frame);
        }
    }

    /// Expected natural logarithm of real over predicted time, waits left out, of an algorithm of whose predicted
    /// time calls are that share.
    pub(super) fn correction_ln(&self, algorithm: usize, view: &View, calls: f64) -> f64 {
        self.belief.deviation_ln(algorithm, view, calls)
    }

    /// An algorithm that runs, of whose predicted time calls are that share, for
    /// [`told_of_ratio`](Self::told_of_ratio).
    pub(super) fn running(&self, algorithm: usize, view: &View, calls: f64) -> Running {
        self.belief.running(algorithm, view, calls)
    }

    /// What so many frames in a row of another algorithm would tell of the logarithm of its cost over that of the one
    /// that runs: the standard deviation of by how much they correct it.
    pub(super) fn told_of_ratio(&self, running: &Running, tried: usize, view: &View, calls: f64, frames: u32) -> f64 {
        self.belief.told_of_ratio(running, tried, view, calls, noise(frames))
    }

    /// Takes in that some frames took the algorithm longer or shorter than was predicted without correction. Whether
    /// that surprised no more than can be believed at once.
    pub(super) fn observe(&mut self, batch: &FrameBatch, frame: u64) -> bool {
        let (algorithm, ratio) = (batch.candidate, batch.real_ns / batch.predicted_ns);
        if !(ratio.is_finite() && ratio > 0.0) {
            return true;
        }
        self.belief.pass(frame);
        let expected = self.belief.expect(algorithm, &batch.view(), batch.calls());
        let surprise = ratio.ln() - expected.ln;
        let variance = expected.shared + expected.own + noise(batch.frames) + self.settle(algorithm, batch.frames);
        let most = MOST_SURPRISE * variance.sqrt();
        let believed = surprise.abs() <= most;
        self.observed += 1;
        let a = &mut self.frames[algorithm];
        a.batches = a.batches.saturating_add(1);
        a.run = match surprise.signum() as i32 {
            _ if believed => 0,
            side if a.run.signum() == -side => side,
            side => a.run + side,
        };
        if a.run.unsigned_abs() < NO_ACCIDENT {
            self.belief.absorb(algorithm, surprise.clamp(-most, most), variance);
        } else {
            // What was observed holds no longer: the next frames count as if they were the first. And what shared
            // parts have not explained until now is more likely the algorithm's own.
            a.run = 0;
            self.belief.doubt_shared();
            self.belief.doubt_own(algorithm, surprise);
        }
        believed
    }

    /// The costs as they are expected now, without what passes.
    pub(super) fn lasting(&self, costs: &[AlgorithmCost]) -> Vec<AlgorithmCost> {
        self.belief.costs(costs, true, NOISE_LN)
    }
}
