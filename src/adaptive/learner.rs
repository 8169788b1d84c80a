//! What the frames that were run tell about the cost of every algorithm.
//!
//! The natural logarithm of measured over predicted time is taken to be the sum of two parts. The *regime* is shared: a factor for each
//! class of processor (a clock that throttles, tuning of another machine); beside that for each number of threads or GPUs one, and one
//! on what a call costs (cores that moved apart, a core that is taken); and for all algorithms that keep the same from frame to frame
//! one. The *own* part of an algorithm is a curve over the number of objects. A Kalman filter follows both: the regime with all its
//! covariances, which takes a dozen numbers, the own parts each by itself.

use super::frame_batch::FrameBatch;
use super::knots::{KNOTS, KnotPosition, View};
use crate::algorithm::BackendClass;
use crate::tuning::AlgorithmCost;

/// Standard deviations before anything was observed. Tuning of another machine are off by a factor of several for all algorithms at once, and
/// a core that is taken doubles the time of those that use it.
const CLASS_LN: f64 = 0.8;
const KEPT_LN: f64 = 0.5;
const WIDTH_LN: f64 = 0.2;
const CALL_LN: f64 = 0.7;
/// The least of an own part: tuning that was measured a minute ago are off by this in the next scene.
const OWN_LN: f64 = 0.15;

/// Frames after which what was observed counts for half. In a hundred frames a class may change by 15 %, what keeping saves by 25 %, a width
/// by 7 % and an own curve by 2 % (standard deviations); a faster change shows in surprises.
const CLASS_FRAMES: f64 = 10_000.0;
const KEPT_FRAMES: f64 = 400.0;
const WIDTH_FRAMES: f64 = 800.0;
const OWN_FRAMES: f64 = 6000.0;

/// Share of each frame in the mean time that frames of a width wait for other programs, and batches of an algorithm before its frames count
/// for that: until then what is dearer than expected was expected wrongly.
const WAIT_SHARE: f64 = 1.0 / 128.0;
const KNOWN: u32 = 4;

/// The noise of a frame is learned for each algorithm; it starts here, and is never believed to be less.
const NOISE_LN: f64 = 0.1;
const LEAST_NOISE_LN: f64 = 0.02;
/// Of this many frames in a row the mean is as noisy as of this power of their number far apart.
const ALIKE: f64 = 0.7;
/// And the frame with which an algorithm begins as this part of one where it was slower than expected, for its threads may have slept or met
/// another program; where it was faster, that was no accident.
const COLD_WORTH: [f64; 2] = [0.02, 0.5];
/// Share of each new deviation in the noise.
const NOISE_SHARE: f64 = 1.0 / 8.0;

/// A surprise counts as no more than this many standard deviations: frames whose threads waited for a core take fifty times as long.
const MOST_SURPRISE: f64 = 3.0;
/// This many of them in a row, all to the same side, are no accident: the machine or the scene has changed.
const NO_ACCIDENT: u32 = 3;

/// A state that is followed: what is expected, and its variance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Own {
    mean: f64,
    variance: f64,
    /// The frame at which the variance held.
    at: u64,
}

/// What is known about one algorithm beside the regime.
#[derive(Debug, Clone)]
struct Algorithm {
    /// The part of the regime that is its class of processor's, and the two of its width if it is wider than one: on all of its cost,
    /// and behind it in the list on its calls.
    class: usize,
    width: Option<usize>,
    /// The part that it shares with those that keep the same from frame to frame.
    kept: Option<usize>,
    /// Variance of the own part before anything was observed.
    before: f64,
    own: [Own; KNOTS],
    noise: f64,
    /// Where in the list of waits its width stands, and how often it was observed.
    wait: usize,
    batches: u32,
    /// Surprises in a row, counted with their sign.
    run: i32,
}

/// Follows the costs of all algorithms. Allocates when it is made.
#[derive(Debug, Clone)]
pub(super) struct Learner {
    algorithms: Vec<Algorithm>,
    /// The regime: means, covariance row by row, and the variances before anything was observed.
    mean: Vec<f64>,
    covariance: Vec<f64>,
    before: Vec<f64>,
    /// Frames after which each counts for half.
    lasts: Vec<f64>,
    with: Vec<f64>,
    /// For each class and width the mean time that a frame waits for other programs, nanoseconds, and the frame at which that held.
    waits: Vec<(f64, u64)>,
    frame: u64,
    observed: u64,
}

/// Parts of the regime that count for one algorithm at most, and how the logarithm of its cost hangs on each.
const PARTS: usize = 4;
type Slopes = [(usize, f64); PARTS];

impl Algorithm {
    /// The own part.
    fn own_ln(&self, position: KnotPosition) -> f64 {
        position.knots().iter().map(|&(k, weight)| weight * self.own[k].mean).sum()
    }
}

impl Own {
    /// The variance goes back towards what it was before, as what was observed ages.
    fn variance_at(&self, frame: u64, before: f64) -> f64 {
        let aged = (frame - self.at) as f64 / OWN_FRAMES;
        // Of the exponential only the beginning: none of this is known to the last digit.
        self.variance + (before - self.variance) * (aged / (1.0 + aged))
    }
}

impl Learner {
    /// `kept` as [`Policy::new`](super::policy::Policy::new) has it.
    pub(super) fn new(costs: &[AlgorithmCost], kept: &[Option<usize>]) -> Self {
        let mut parts: Vec<Factor> = Vec::new();
        let mut at = |factor: Factor| {
            parts.iter().position(|p| *p == factor).unwrap_or_else(|| {
                parts.push(factor);
                parts.len() - 1
            })
        };
        let mut widths: Vec<(BackendClass, u32)> = Vec::new();
        let algorithms = costs.iter().zip(kept).map(|(cost, kept)| {
            let backend = cost.algorithm.backend();
            let width_of = (backend.class(), backend.width());
            if !widths.contains(&width_of) {
                widths.push(width_of);
            }
            let width = (backend.width() > 1).then(|| {
                let all = at(Factor::Width(backend.class(), backend.width()));
                // Always next to each other: no other adds one in between.
                at(Factor::Calls(backend.class(), backend.width()));
                all
            });
            let before = cost.spread_ln.max(OWN_LN).powi(2);
            Algorithm {
                class: at(Factor::Class(backend.class())),
                kept: kept.map(|work| at(Factor::Kept(work))),
                width,
                before,
                own: [Own { mean: 0.0, variance: before, at: 0 }; KNOTS],
                noise: NOISE_LN.powi(2),
                wait: widths.iter().position(|w| *w == width_of).unwrap_or(0),
                batches: 0,
                run: 0,
            }
        });
        let algorithms: Vec<Algorithm> = algorithms.collect();
        let before: Vec<f64> = parts.iter().map(|p| p.deviation().powi(2)).collect();
        let mut covariance = vec![0.0; parts.len() * parts.len()];
        unobserve(&mut covariance, &before);
        Self {
            algorithms,
            mean: vec![0.0; parts.len()],
            covariance,
            lasts: parts.iter().map(|p| p.lasts()).collect(),
            with: vec![0.0; parts.len()],
            before,
            waits: vec![(0.0, 0); widths.len()],
            frame: 0,
            observed: 0,
        }
    }

    /// Batches that were observed.
    pub(super) fn observed(&self) -> u64 {
        self.observed
    }

    /// What the regime adds to the logarithm of an algorithm's cost, and the parts that do with their slopes.
    fn regime(&self, algorithm: &Algorithm, view: View) -> (f64, Slopes) {
        let kept = algorithm.kept.map_or((0, 0.0), |k| (k, 1.0));
        let shared = self.mean[algorithm.class] + kept.1 * self.mean[kept.0];
        let Some(width) = algorithm.width else { return (shared, [(algorithm.class, 1.0), kept, (0, 0.0), (0, 0.0)]) };
        // A factor on the calls alone. What it adds to the whole is not linear in its logarithm; its slope is that of the present one.
        let calls = view.calls * self.mean[width + 1].exp();
        let whole = 1.0 - view.calls + calls;
        let slopes = [(algorithm.class, 1.0), kept, (width, 1.0), (width + 1, calls / whole)];
        (shared + self.mean[width] + whole.ln(), slopes)
    }

    /// Mean time that a frame of an algorithm waits for other programs, in nanoseconds. A helper whose core another program has waits
    /// until the scheduler's next turn, however short the frame: a hundred times as long as some. The mean is what counts, so that this is not
    /// noise, and it is no factor either.
    pub(super) fn wait_ns(&self, algorithm: usize, frame: u64) -> f64 {
        let (ns, at) = self.waits[self.algorithms[algorithm].wait];
        ns / (1.0 + frame.saturating_sub(at) as f64 / WIDTH_FRAMES)
    }

    /// Whether an algorithm was observed often enough to tell a frame that waited from one that was expected wrongly.
    pub(super) fn knows(&self, algorithm: usize) -> bool {
        self.algorithms[algorithm].batches >= KNOWN
    }

    /// Takes in that a frame took this many nanoseconds more than any of its kind is expected to, or none.
    pub(super) fn waited(&mut self, algorithm: usize, ns: f64, frame: u64) {
        if self.knows(algorithm) {
            let before = self.wait_ns(algorithm, frame);
            self.waits[self.algorithms[algorithm].wait] = (before + WAIT_SHARE * (ns - before), frame);
        }
    }

    /// Expected natural logarithm of real over predicted time, waits left out.
    pub(super) fn correction_ln(&self, algorithm: usize, view: View) -> f64 {
        let a = &self.algorithms[algorithm];
        self.regime(a, view).0 + a.own_ln(view.position)
    }

    fn own_variance(&self, algorithm: usize, position: KnotPosition) -> f64 {
        let a = &self.algorithms[algorithm];
        position.knots().iter().map(|&(k, weight)| weight * a.own[k].variance_at(self.frame, a.before)).sum()
    }

    /// Variance of the logarithm of the ratio of two costs.
    pub(super) fn variance_of_ratio(&self, (a, of_a): (usize, View), (b, of_b): (usize, View)) -> f64 {
        let mut weights = [(0, 0.0); 2 * PARTS];
        let (first, second) = weights.split_at_mut(PARTS);
        first.copy_from_slice(&self.regime(&self.algorithms[a], of_a).1);
        second.copy_from_slice(&self.regime(&self.algorithms[b], of_b).1);
        second.iter_mut().for_each(|(_, weight)| *weight = -*weight);
        let size = self.mean.len();
        let shared: f64 = weights
            .iter()
            .flat_map(|&(i, x)| weights.iter().map(move |&(j, y)| (i, j, x * y)))
            .map(|(i, j, weight)| weight * self.covariance[i * size + j])
            .sum();
        shared.max(0.0) + self.own_variance(a, of_a.position) + self.own_variance(b, of_b.position)
    }

    /// Takes in that some frames took the algorithm longer or shorter than was predicted without correction.
    pub(super) fn observe(&mut self, batch: &FrameBatch, frame: u64) {
        let algorithm = batch.candidate;
        let position = KnotPosition::of(batch.log2_objects());
        let view = View { position, calls: batch.calls() };
        let surprise = (batch.real_ns / batch.predicted_ns).ln() - self.correction_ln(algorithm, view);
        if !surprise.is_finite() {
            return;
        }
        self.pass(frame);
        self.observed += 1;
        self.algorithms[algorithm].batches = self.algorithms[algorithm].batches.saturating_add(1);
        // Frames in a row are alike, so that many of them tell less than as many that were far apart.
        let worth = if batch.cold { COLD_WORTH[usize::from(surprise < 0.0)] } else { f64::from(batch.frames).powf(ALIKE) };
        let size = self.mean.len();
        let (_, regime) = self.regime(&self.algorithms[algorithm], view);
        let Self { algorithms, mean, covariance, with, frame, .. } = self;
        let a = &mut algorithms[algorithm];
        for (i, w) in with.iter_mut().enumerate() {
            *w = regime.iter().map(|&(k, weight)| weight * covariance[i * size + k]).sum();
        }
        for (k, _) in position.knots() {
            let own = &mut a.own[k];
            own.variance = own.variance_at(*frame, a.before);
            own.at = *frame;
        }
        let of_regime: f64 = regime.iter().map(|&(k, weight)| weight * with[k]).sum();
        let of_own: f64 = position.knots().iter().map(|&(k, weight)| weight * weight * a.own[k].variance).sum();
        let variance = of_regime.max(0.0) + of_own + a.noise / worth;
        let most = MOST_SURPRISE * variance.sqrt();
        let error = surprise.clamp(-most, most);
        let side = if error == surprise { 0 } else { surprise.signum() as i32 };
        a.run = if side == 0 {
            0
        } else if a.run.signum() == -side {
            side
        } else {
            a.run + side
        };
        let deviation = (error * error - of_regime - of_own) * worth;
        a.noise += NOISE_SHARE * (deviation.max(0.0) - a.noise);
        a.noise = a.noise.max(LEAST_NOISE_LN.powi(2));
        if a.run.unsigned_abs() >= NO_ACCIDENT {
            a.run = 0;
            return self.doubt_all(algorithm, position, surprise);
        }
        let gain = error / variance;
        for (m, w) in mean.iter_mut().zip(&*with) {
            *m += w * gain;
        }
        for i in 0..size {
            for j in 0..size {
                covariance[i * size + j] -= with[i] * with[j] / variance;
            }
        }
        for (k, weight) in position.knots() {
            let own = &mut a.own[k];
            let with = weight * own.variance;
            own.mean += with * gain;
            own.variance -= with * with / variance;
        }
    }

    /// The regime may have changed since the last observation.
    fn pass(&mut self, frame: u64) {
        let frames = frame.saturating_sub(self.frame) as f64;
        self.frame = self.frame.max(frame);
        let size = self.mean.len();
        for i in 0..size {
            self.mean[i] /= 1.0 + frames / self.lasts[i];
            for j in 0..size {
                // What stays of each, so that the matrix remains that of a real vector.
                let stays = (1.0 / (1.0 + frames / self.lasts[i])) * (1.0 / (1.0 + frames / self.lasts[j]));
                let entry = &mut self.covariance[i * size + j];
                *entry *= stays.sqrt();
                if i == j {
                    *entry += (1.0 - stays.sqrt()) * self.before[i];
                }
            }
        }
    }

    /// What was observed holds no longer: the next frames count as if they were the first. And what the regime has not explained until now is
    /// more likely the algorithm's own.
    fn doubt_all(&mut self, algorithm: usize, position: KnotPosition, surprise: f64) {
        unobserve(&mut self.covariance, &self.before);
        let a = &mut self.algorithms[algorithm];
        for (k, _) in position.knots() {
            a.own[k].variance = a.before.max(surprise * surprise);
        }
    }

    /// Expected natural logarithm of real over predicted time at a number of objects, without what passes: only the class's part and
    /// the algorithm's own.
    pub(super) fn lasting_ln(&self, algorithm: usize, log2_objects: f64) -> f64 {
        let a = &self.algorithms[algorithm];
        self.mean[a.class] + a.own_ln(KnotPosition::of(log2_objects))
    }

    /// Standard deviation of the logarithm of a frame's time around the corrected cost: the root of the mean over the knots.
    pub(super) fn spread_ln(&self, algorithm: usize) -> f64 {
        let a = &self.algorithms[algorithm];
        let own: f64 = a.own.iter().map(|own| own.variance_at(self.frame, a.before)).sum();
        (own / KNOTS as f64 + a.noise).sqrt()
    }
}

/// Makes a covariance that of parts that nothing was observed of, which have these variances.
fn unobserve(covariance: &mut [f64], before: &[f64]) {
    covariance.fill(0.0);
    for (k, &variance) in before.iter().enumerate() {
        covariance[k * before.len() + k] = variance;
    }
}

/// A part of the regime.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Factor {
    Class(BackendClass),
    /// Of those that keep the same: a scene may spare them more or less of their work than those that the tuning was made from.
    Kept(usize),
    /// Of a number of threads or GPUs: on all of the cost, and on its calls.
    Width(BackendClass, u32),
    Calls(BackendClass, u32),
}

impl Factor {
    fn deviation(self) -> f64 {
        match self {
            Self::Class(_) => CLASS_LN,
            Self::Kept(_) => KEPT_LN,
            Self::Width(..) => WIDTH_LN,
            Self::Calls(..) => CALL_LN,
        }
    }

    fn lasts(self) -> f64 {
        match self {
            Self::Class(_) => CLASS_FRAMES,
            Self::Kept(_) => KEPT_FRAMES,
            Self::Width(..) | Self::Calls(..) => WIDTH_FRAMES,
        }
    }
}
