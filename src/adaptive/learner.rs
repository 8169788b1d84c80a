//! What the frames that were run tell about the cost of every algorithm.
//!
//! The natural logarithm of measured over predicted time is taken to be the sum of two parts. The *regime* is shared: one factor for
//! each class of processor (a clock that throttles, another program), and one for each number of threads or GPUs beside that, for small
//! and for large frames (cores that moved apart, a core that is taken). The *own* part of an algorithm is a curve over the number of
//! objects. A Kalman filter follows both: the regime with all its covariances, which takes a dozen numbers, the own parts each
//! by itself. [`Posterior`](crate::Posterior) knows more and takes some 50 microseconds for an observation, longer than most frames.

use crate::{AlgorithmCost, BackendClass};

/// Knots of an own curve: 2^3 to 2^21 objects, every second octave, linear in between and constant beyond.
const KNOTS: usize = 10;
const FIRST_OCTAVE: f64 = 3.0;
const OCTAVES: f64 = 2.0;

/// Where a frame counts as small and where as large, for what a number of threads costs: in between the two share.
const SMALL_OCTAVE: f64 = 8.0;
const LARGE_OCTAVE: f64 = 16.0;

/// Standard deviations before anything was observed. A clock may halve, and a core that is taken may double a time.
const CLASS_LN: f64 = 0.4;
const WIDTH_LN: f64 = 0.35;
/// The least of an own part: fields that were measured a minute ago are off by this in the next scene.
const OWN_LN: f64 = 0.15;

/// Frames after which what was observed counts for 1/e: the regime changes in seconds, an own curve only with the scene.
const CLASS_FRAMES: f64 = 100.0;
const WIDTH_FRAMES: f64 = 600.0;
const OWN_FRAMES: f64 = 6000.0;

/// The noise of a frame is learned for each algorithm; it starts here, and is never believed to be less.
const NOISE_LN: f64 = 0.1;
const LEAST_NOISE_LN: f64 = 0.02;
/// Share of each new deviation in the noise.
const NOISE_SHARE: f64 = 1.0 / 32.0;

/// A surprise counts as no more than so many standard deviations: a frame whose thread waited for a core takes fifty times as long.
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
    /// The part of the regime that is its class of processor's, and the two of its width if it is wider than one.
    class: usize,
    width: Option<usize>,
    /// Variance of the own part before anything was observed.
    before: f64,
    own: [Own; KNOTS],
    noise: f64,
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
    /// Frames after which each counts for 1/e.
    lasts: Vec<f64>,
    with: Vec<f64>,
    frame: u64,
    observed: u64,
}

/// A number of objects among the knots, and between small and large.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    knot: usize,
    share: f64,
    large: f64,
}

impl Place {
    pub(super) fn of(log2_objects: f64) -> Self {
        let at = ((log2_objects - FIRST_OCTAVE) / OCTAVES).clamp(0.0, (KNOTS - 1) as f64);
        let knot = (at as usize).min(KNOTS - 2);
        let large = ((log2_objects - SMALL_OCTAVE) / (LARGE_OCTAVE - SMALL_OCTAVE)).clamp(0.0, 1.0);
        Self { knot, share: at - knot as f64, large }
    }

    /// The knots on both sides, with their weights.
    fn knots(self) -> [(usize, f64); 2] {
        [(self.knot, 1.0 - self.share), (self.knot + 1, self.share)]
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
    pub(super) fn new(costs: &[AlgorithmCost]) -> Self {
        let mut parts: Vec<Part> = Vec::new();
        let mut place = |part: Part| {
            parts.iter().position(|p| *p == part).unwrap_or_else(|| {
                parts.push(part);
                parts.len() - 1
            })
        };
        let algorithms = costs.iter().map(|cost| {
            let backend = cost.algorithm.backend();
            let width = (backend.width() > 1).then(|| {
                let small = place(Part::Width(backend.class(), backend.width(), false));
                // Always next to each other: no other adds one in between.
                place(Part::Width(backend.class(), backend.width(), true));
                small
            });
            let before = cost.spread_ln.max(OWN_LN).powi(2);
            Algorithm {
                class: place(Part::Class(backend.class())),
                width,
                before,
                own: [Own { mean: 0.0, variance: before, at: 0 }; KNOTS],
                noise: NOISE_LN.powi(2),
                run: 0,
            }
        });
        let algorithms: Vec<Algorithm> = algorithms.collect();
        let before: Vec<f64> = parts.iter().map(|p| p.deviation().powi(2)).collect();
        let mut covariance = vec![0.0; parts.len() * parts.len()];
        for (k, variance) in before.iter().enumerate() {
            covariance[k * parts.len() + k] = *variance;
        }
        Self {
            algorithms,
            mean: vec![0.0; parts.len()],
            covariance,
            lasts: parts.iter().map(|p| p.lasts()).collect(),
            with: vec![0.0; parts.len()],
            before,
            frame: 0,
            observed: 0,
        }
    }

    /// Frames that were observed.
    pub(super) fn observed(&self) -> u64 {
        self.observed
    }

    /// The parts of the regime that count for an algorithm, with their weights.
    fn regime(algorithm: &Algorithm, place: Place) -> [(usize, f64); 3] {
        match algorithm.width {
            Some(k) => [(algorithm.class, 1.0), (k, 1.0 - place.large), (k + 1, place.large)],
            None => [(algorithm.class, 1.0), (0, 0.0), (0, 0.0)],
        }
    }

    /// Expected natural logarithm of real over predicted time.
    pub(super) fn correction_ln(&self, algorithm: usize, place: Place) -> f64 {
        let a = &self.algorithms[algorithm];
        let regime: f64 = Self::regime(a, place).iter().map(|&(k, weight)| weight * self.mean[k]).sum();
        regime + place.knots().iter().map(|&(k, weight)| weight * a.own[k].mean).sum::<f64>()
    }

    fn own_variance(&self, algorithm: usize, place: Place) -> f64 {
        let a = &self.algorithms[algorithm];
        place.knots().iter().map(|&(k, weight)| weight * a.own[k].variance_at(self.frame, a.before)).sum()
    }

    /// Variance of the logarithm of the ratio of two costs.
    pub(super) fn variance_of_ratio(&self, a: usize, b: usize, place: Place) -> f64 {
        let mut weights = [(0, 0.0); 6];
        let (of_a, of_b) = weights.split_at_mut(3);
        of_a.copy_from_slice(&Self::regime(&self.algorithms[a], place));
        of_b.copy_from_slice(&Self::regime(&self.algorithms[b], place));
        of_b.iter_mut().for_each(|(_, weight)| *weight = -*weight);
        let size = self.mean.len();
        let shared: f64 = weights
            .iter()
            .flat_map(|&(i, x)| weights.iter().map(move |&(j, y)| (i, j, x * y)))
            .map(|(i, j, weight)| weight * self.covariance[i * size + j])
            .sum();
        shared.max(0.0) + self.own_variance(a, place) + self.own_variance(b, place)
    }

    /// So many frames have passed: the regime may have changed since.
    pub(super) fn pass(&mut self, frames: u32) {
        self.frame += u64::from(frames);
        let size = self.mean.len();
        let frames = f64::from(frames);
        for i in 0..size {
            for j in 0..size {
                let aged = frames / self.lasts[i].min(self.lasts[j]);
                let share = aged / (1.0 + aged);
                let before = if i == j { self.before[i] } else { 0.0 };
                let entry = &mut self.covariance[i * size + j];
                *entry += share * (before - *entry);
            }
        }
    }

    /// Takes in that a frame took the algorithm `real_ln` where `predicted_ln` was predicted without correction, both logarithms of
    /// nanoseconds. `doubt` is a variance of that figure beside the algorithm's noise.
    pub(super) fn observe(&mut self, algorithm: usize, place: Place, real_ln: f64, predicted_ln: f64, doubt: f64) {
        let surprise = real_ln - predicted_ln - self.correction_ln(algorithm, place);
        if !surprise.is_finite() {
            return;
        }
        self.observed += 1;
        let size = self.mean.len();
        let Self { algorithms, mean, covariance, with, frame, .. } = self;
        let a = &mut algorithms[algorithm];
        let regime = Self::regime(a, place);
        for (i, w) in with.iter_mut().enumerate() {
            *w = regime.iter().map(|&(k, weight)| weight * covariance[i * size + k]).sum();
        }
        for (k, _) in place.knots() {
            let own = &mut a.own[k];
            own.variance = own.variance_at(*frame, a.before);
            own.at = *frame;
        }
        let of_regime: f64 = regime.iter().map(|&(k, weight)| weight * with[k]).sum();
        let of_own: f64 = place.knots().iter().map(|&(k, weight)| weight * weight * a.own[k].variance).sum();
        let variance = of_regime.max(0.0) + of_own + a.noise + doubt;
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
        let deviation = error * error - of_regime - of_own;
        a.noise += NOISE_SHARE * (deviation.max(0.0) - a.noise);
        a.noise = a.noise.max(LEAST_NOISE_LN.powi(2));
        if a.run.unsigned_abs() >= NO_ACCIDENT {
            a.run = 0;
            return self.doubt_all(algorithm, place);
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
        for (k, weight) in place.knots() {
            let own = &mut a.own[k];
            let with = weight * own.variance;
            own.mean += with * gain;
            own.variance -= with * with / variance;
        }
    }

    /// What was observed holds no longer: the next frames count as if they were the first.
    fn doubt_all(&mut self, algorithm: usize, place: Place) {
        let size = self.mean.len();
        self.covariance.fill(0.0);
        for (k, &before) in self.before.iter().enumerate() {
            self.covariance[k * size + k] = before;
        }
        let a = &mut self.algorithms[algorithm];
        for (k, _) in place.knots() {
            a.own[k].variance = a.before;
        }
    }

    /// Logarithms of the numbers of objects between which corrections are linear.
    pub(super) fn octaves(&self) -> impl Iterator<Item = f64> {
        (0..KNOTS).map(|k| FIRST_OCTAVE + OCTAVES * k as f64).chain([SMALL_OCTAVE, LARGE_OCTAVE])
    }

    /// As [`correction_ln`](Self::correction_ln), at a number of objects.
    pub(super) fn correction_at(&self, algorithm: usize, log2_objects: f64) -> f64 {
        self.correction_ln(algorithm, Place::of(log2_objects))
    }

    /// Standard deviation of the logarithm of a frame's time around the corrected cost: the root of the mean over the knots.
    pub(super) fn spread_ln(&self, algorithm: usize) -> f64 {
        let a = &self.algorithms[algorithm];
        let own: f64 = a.own.iter().map(|own| own.variance_at(self.frame, a.before)).sum();
        (own / KNOTS as f64 + a.noise).sqrt()
    }
}

/// A part of the regime.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Class(BackendClass),
    /// Of a number of threads or GPUs, in large frames or in small ones.
    Width(BackendClass, u32, bool),
}

impl Part {
    fn deviation(self) -> f64 {
        match self {
            Self::Class(_) => CLASS_LN,
            Self::Width(..) => WIDTH_LN,
        }
    }

    fn lasts(self) -> f64 {
        match self {
            Self::Class(_) => CLASS_FRAMES,
            Self::Width(..) => WIDTH_FRAMES,
        }
    }
}
