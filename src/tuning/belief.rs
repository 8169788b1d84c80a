//! What is believed of the costs on a machine: a prediction, and how far from it each algorithm lies as far as
//! timings told.
//!
//! The natural logarithm of real over predicted time is taken to be a sum of parts. Some are shared: by a class of
//! processor (a clock that throttles, tuning of another machine), by a number of threads or GPUs, on all of a frame
//! and on what calling them takes (cores that moved apart, a core that is taken), by incremental algorithms that keep
//! the same from frame to frame, and by the algorithms of a method. One is the algorithm's own: a constant and a
//! function of the load, a Gaussian process at the first of the places of the residuals. A Kalman filter follows all
//! of them: the shared ones with all their covariances, those of an algorithm by themselves. That leaves out what
//! observations tell of the difference between a shared part and an own one, so that a sum of both is believed to be
//! less sure than it is.
//!
//! A frame that decides goes through all covariances, and between two frames of a program these lie in no cache. So
//! methods have no function of the load for all of their algorithms: in 88 replayed runs it changed costs by 0.0 +-
//! 0.4 %, and made the covariances of the shared parts thirty times as large.

mod basis;
mod own;
mod part;

use super::AlgorithmCost;
use crate::cost::{Frame, Places, Residual};
use crate::load::paces_apart_ln;
use basis::Basis;
use own::{Own, aged};
use part::Part;
use std::sync::Arc;

pub(crate) use basis::View;
pub(crate) use part::Deviations;

/// Functions of the load that a part consists of beside its constant. More places tell a little more of scenes that
/// were measured and a little less of others.
pub(crate) const CURVE: usize = 8;
/// A constant and these.
const SIZE: usize = CURVE + 1;

/// So many frames are forgotten at once: that goes through all covariances, which between two frames of a program lie
/// in no cache.
const FEWEST_FRAMES: f64 = 16.0;

/// Where boxes move e times as far as before, or an e-th of that, an e-th stays of what was observed of keeping. Less
/// than the second is the noise of [`Displacement`](crate::algorithm::Displacement), which watches few boxes.
const PACE_LN: f64 = 1.0;
const SAME_PACE_LN: f64 = 0.5;

/// No more than this many standard deviations of a surprise are believed at once: frames whose threads waited for a
/// core take fifty times as long.
pub(crate) const MOST_SURPRISE: f64 = 3.0;

/// What is believed of the algorithms of a tuning. Memory is allocated when it is made.
#[derive(Debug, Clone)]
pub(crate) struct Belief {
    basis: Basis,
    algorithms: Vec<Parts>,
    own: Vec<Own>,
    /// The shared parts: means, covariance row by row, the variances once what was observed is forgotten, and frames
    /// after which each counts for half.
    mean: Vec<f64>,
    covariance: Vec<f64>,
    later: Vec<f64>,
    lasts: Vec<f64>,
    /// Of the observation at hand: covariance of each shared part with it, and of each entry of the own part.
    /// `fading` is room for a passage of time.
    with: Vec<f64>,
    own_with: [f64; SIZE],
    fading: Vec<f64>,
    frame: u64,
}

/// Where the shared parts of an algorithm stand.
#[derive(Debug, Clone, Copy)]
struct Parts {
    class: usize,
    /// Of what it keeps from frame to frame, if it does.
    kept: Option<usize>,
    /// Of its width, if that is more than one: on all of its cost, and behind it on its calls.
    width: Option<usize>,
    method: usize,
    by_motion: bool,
}

/// Entries of the shared parts that count for one algorithm at most, and how the logarithm of its cost hangs on each.
const SHARED: usize = 5;
type Slopes = [(usize, f64); SHARED];

/// An algorithm that runs, as what is believed of others is held against it: how the logarithm of its cost hangs on
/// shared parts, and its variance.
#[derive(Debug, Clone)]
pub(crate) struct Running {
    slopes: Slopes,
    variance: f64,
}

/// What is expected of an observation, as natural logarithms: its deviation from the prediction, and the variances of
/// that in the shared and in the own parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Expected {
    pub(crate) ln: f64,
    pub(crate) shared: f64,
    pub(crate) own: f64,
}

impl Belief {
    /// The belief in predictions of which nothing was observed. `kept` says for each algorithm where it finds what
    /// the frame before left, if a frame is cheaper for it after one that was alike: one number for all that share
    /// it.
    pub(crate) fn new(costs: &[AlgorithmCost], kept: &[Option<usize>], deviations: Deviations) -> Self {
        let places = costs.iter().flat_map(AlgorithmCost::residuals).map(|r| Arc::clone(&r.places)).next();
        let mut parts: Vec<Part<'_>> = Vec::new();
        let mut algorithms = Vec::new();
        for (cost, kept) in costs.iter().zip(kept) {
            let mut at = |part| -> usize {
                parts.iter().position(|p| *p == part).unwrap_or_else(|| {
                    parts.push(part);
                    parts.len() - 1
                })
            };
            let backend = cost.algorithm.backend();
            let class = backend.class();
            let width = (backend.width() > 1).then(|| {
                let all = at(Part::Width(class, backend.width()));
                // Always next to each other: no other adds one in between.
                at(Part::Calls(class, backend.width()));
                all
            });
            let by_motion = cost.residuals().next().map_or(kept.is_some(), |r| r.by_motion);
            algorithms.push(Parts {
                class: at(Part::Class(class)),
                kept: kept.map(|k| at(Part::Kept(k))),
                width,
                method: at(Part::Method(class, cost.algorithm.method())),
                by_motion,
            });
        }
        let mut covariance = vec![0.0; parts.len() * parts.len()];
        set_diagonal(&mut covariance, parts.iter().map(|p| p.deviation_ln(deviations).powi(2)));
        Self {
            basis: Basis::new(places.unwrap_or_else(Places::usual)),
            algorithms,
            own: costs.iter().map(|_| Own::new()).collect(),
            mean: vec![0.0; parts.len()],
            covariance,
            lasts: parts.iter().map(Part::frames).collect(),
            with: vec![0.0; parts.len()],
            own_with: [0.0; SIZE],
            fading: vec![0.0; parts.len()],
            later: parts.iter().map(|p| p.later_ln(deviations).powi(2)).collect(),
            frame: 0,
        }
    }

    pub(crate) fn view(&self, frame: &Frame<'_>) -> View {
        self.basis.view(frame)
    }

    /// What the shared parts add to the logarithm of an algorithm's cost of which calls are that share, and which
    /// parts do with their slopes.
    fn shared(&self, algorithm: usize, calls: f64) -> (f64, Slopes) {
        let parts = &self.algorithms[algorithm];
        let mut slopes = [(0, 0.0); SHARED];
        slopes[0] = (parts.class, 1.0);
        slopes[1] = parts.kept.map_or((0, 0.0), |k| (k, 1.0));
        let mut ln = self.mean[parts.class] + slopes[1].1 * self.mean[slopes[1].0];
        if let Some(width) = parts.width {
            // A factor on the calls alone. What it adds to the whole is not linear in its logarithm; its slope is
            // that of the present one.
            let called = calls * self.mean[width + 1].exp();
            let whole = 1.0 - calls + called;
            slopes[2] = (width, 1.0);
            slopes[3] = (width + 1, called / whole);
            ln += self.mean[width] + whole.ln();
        }
        slopes[4] = (parts.method, 1.0);
        (ln + self.mean[parts.method], slopes)
    }

    /// Expected natural logarithm of real over predicted time of an algorithm of whose predicted time calls are that
    /// share.
    pub(crate) fn deviation_ln(&self, algorithm: usize, view: &View, calls: f64) -> f64 {
        let own = &self.own[algorithm].mean;
        let curve = view.of(self.algorithms[algorithm].by_motion);
        self.shared(algorithm, calls).0 + own[0] + curve.iter().zip(&own[1..]).map(|(a, b)| a * b).sum::<f64>()
    }

    /// What is expected of an observation of an algorithm, which is then to be [taken in](Self::absorb).
    pub(crate) fn expect(&mut self, algorithm: usize, view: &View, calls: f64) -> Expected {
        let (ln, slopes) = self.shared(algorithm, calls);
        let size = self.mean.len();
        self.with.fill(0.0);
        for (entry, weight) in slopes.into_iter().filter(|s| s.1 != 0.0) {
            let row = &self.covariance[entry * size..][..size];
            self.with.iter_mut().zip(row).for_each(|(w, c)| *w += weight * c);
        }
        let shared: f64 = slopes.iter().map(|&(k, weight)| weight * self.with[k]).sum();
        let values = values(view.of(self.algorithms[algorithm].by_motion));
        let own = &mut self.own[algorithm];
        own.age(aged(self.frame - own.at));
        own.at = self.frame;
        for (w, row) in self.own_with.iter_mut().zip(&own.covariance) {
            *w = row.iter().zip(&values).map(|(c, v)| c * v).sum();
        }
        Expected {
            ln: ln + dot(&own.mean, &values),
            shared: shared.max(0.0),
            own: dot(&self.own_with, &values).max(0.0),
        }
    }

    /// Variance of the own part of an algorithm.
    fn own_variance(&self, algorithm: usize, view: &View) -> f64 {
        let own = &self.own[algorithm];
        let (age, values) = (aged(self.frame - own.at), values(view.of(self.algorithms[algorithm].by_motion)));
        let row = |i: usize| {
            let sum: f64 = own.covariance[i].iter().zip(&values).map(|(c, v)| c * v).sum();
            values[i] * ((1.0 - age) * sum + age * Own::before(i) * values[i])
        };
        (0..SIZE).map(row).sum()
    }

    /// Covariance of what shared parts add to the logarithms of two costs.
    fn between(&self, a: &Slopes, b: &Slopes) -> f64 {
        let row = |&(i, x): &(usize, f64)| {
            let covariance = &self.covariance[i * self.mean.len()..][..self.mean.len()];
            x * b.iter().map(|&(j, y)| y * covariance[j]).sum::<f64>()
        };
        a.iter().filter(|(_, x)| *x != 0.0).map(row).sum()
    }

    /// An algorithm that runs, under a load at which calls are that share of its time, for others to be held against.
    pub(crate) fn running(&self, algorithm: usize, view: &View, calls: f64) -> Running {
        let slopes = self.shared(algorithm, calls).1;
        Running { variance: self.between(&slopes, &slopes) + self.own_variance(algorithm, view), slopes }
    }

    /// What frames of another algorithm would tell of the logarithm of its cost over that of the one that runs, which
    /// is known by then: the standard deviation of by how much they are expected to correct it. `noise` is the
    /// variance of the mean of their logarithms. What both have in common says nothing of the ratio.
    pub(crate) fn told_of_ratio(&self, running: &Running, tried: usize, view: &View, calls: f64, noise: f64) -> f64 {
        let slopes = self.shared(tried, calls).1;
        let in_common = self.between(&slopes, &running.slopes).powi(2) / running.variance.max(f64::MIN_POSITIVE);
        let variance = (self.between(&slopes, &slopes) + self.own_variance(tried, view) - in_common).max(0.0);
        if variance + noise > 0.0 { variance / (variance + noise).sqrt() } else { 0.0 }
    }

    /// Takes in that the observation that was [expected](Self::expect) last was off by `error`, where errors have
    /// this variance.
    pub(crate) fn absorb(&mut self, algorithm: usize, error: f64, variance: f64) {
        let size = self.mean.len();
        let gain = error / variance;
        for (i, row) in self.covariance.chunks_exact_mut(size.max(1)).enumerate() {
            let with = self.with[i];
            if with != 0.0 {
                self.mean[i] += with * gain;
                let over = with / variance;
                row.iter_mut().zip(&self.with).for_each(|(entry, other)| *entry -= over * other);
            }
        }
        let own = &mut self.own[algorithm];
        for (i, row) in own.covariance.iter_mut().enumerate() {
            own.mean[i] += self.own_with[i] * gain;
            let over = self.own_with[i] / variance;
            row.iter_mut().zip(&self.own_with).for_each(|(entry, other)| *entry -= over * other);
        }
    }

    /// Takes in that a frame took the algorithm `ratio` times what was predicted, of which calls are that share.
    /// `noise_ln` is the standard deviation of its logarithm. Whether it could be taken in: a time that is no
    /// positive number tells nothing.
    pub(crate) fn observe(&mut self, algorithm: usize, view: &View, ratio: f64, calls: f64, noise_ln: f64) -> bool {
        let expected = self.expect(algorithm, view, calls);
        let surprise = ratio.ln() - expected.ln;
        let variance = expected.shared + expected.own + noise_ln * noise_ln;
        if !(surprise.is_finite() && variance.is_finite() && variance > 0.0) {
            return false;
        }
        let most = MOST_SURPRISE * variance.sqrt();
        self.absorb(algorithm, surprise.clamp(-most, most), variance);
        true
    }

    /// It is this frame now, and the machine may have changed since the one before.
    pub(crate) fn pass(&mut self, frame: u64) {
        let frames = frame.saturating_sub(self.frame) as f64;
        if frames < FEWEST_FRAMES {
            return;
        }
        self.frame = frame;
        for (stays, lasts) in self.fading.iter_mut().zip(&self.lasts) {
            *stays = 1.0 / (1.0 + frames / lasts);
        }
        self.fade();
    }

    /// Boxes moved so far in a frame, in edges, when it was observed how much keeping work spares, and move so far
    /// now. What a scene spares at one pace tells the less of another the further that is. False where it is about
    /// the same pace, and nothing is forgotten.
    pub(crate) fn change_pace(&mut self, before: f64, now: f64) -> bool {
        let away = paces_apart_ln(before, now);
        if away < SAME_PACE_LN {
            return false;
        }
        self.fading.fill(1.0);
        for kept in self.algorithms.iter().filter_map(|a| a.kept) {
            self.fading[kept] = (-away / PACE_LN).exp();
        }
        self.fade();
        true
    }

    /// Of each part that share in `fading` stays; of the rest nothing is known any more.
    fn fade(&mut self) {
        let size = self.mean.len();
        for (mean, fading) in self.mean.iter_mut().zip(&mut self.fading) {
            *mean *= *fading;
            // The root, so that the matrix remains that of a real vector.
            *fading = fading.sqrt();
        }
        for (i, row) in self.covariance.chunks_exact_mut(size.max(1)).enumerate() {
            let own = self.fading[i];
            row.iter_mut().zip(&self.fading).for_each(|(entry, other)| *entry *= own * other);
            row[i] += (1.0 - own * own) * self.later[i];
        }
    }

    /// What was observed of shared parts is as uncertain as if it was forgotten. The means stay: nothing better is
    /// known.
    pub(crate) fn doubt_shared(&mut self) {
        set_diagonal(&mut self.covariance, self.later.iter().copied());
    }

    /// What was observed of an algorithm's own part holds no longer, and it may be off by this much. Not of one that
    /// keeps work from frame to frame: what changes it is the scene, whose part is forgotten sooner than an own one.
    pub(crate) fn doubt_own(&mut self, algorithm: usize, ln: f64) {
        if self.algorithms[algorithm].kept.is_some() {
            return;
        }
        let own = &mut self.own[algorithm];
        for (i, row) in own.covariance.iter_mut().enumerate() {
            row.fill(0.0);
            row[i] = Own::before(i).max(ln * ln);
        }
    }

    /// The costs as they are expected now, with the spread that is left in their own parts and the noise of an
    /// observation, a standard deviation of its logarithm. What passes is left out where only what lasts is asked
    /// for: the parts of widths and of what is kept.
    pub(crate) fn costs(&self, costs: &[AlgorithmCost], lasting: bool, noise_ln: f64) -> Vec<AlgorithmCost> {
        let corrected = |(k, cost): (usize, &AlgorithmCost)| {
            let (parts, own) = (&self.algorithms[k], &self.own[k]);
            let mut cost = cost.clone();
            let mut constant = self.mean[parts.class] + self.mean[parts.method] + own.mean[0];
            if !lasting {
                constant += parts.kept.map_or(0.0, |k| self.mean[k]) + parts.width.map_or(0.0, |w| self.mean[w]);
                if let Some(width) = parts.width {
                    cost.curve.scale_calls(self.mean[width + 1].exp());
                }
            }
            let of_basis = std::array::from_fn(|i| own.mean[1 + i]);
            let weights = self.basis.weights(&of_basis, parts.by_motion)[..self.basis.count].to_vec();
            let now = Residual::new(Arc::clone(&self.basis.places), weights, parts.by_motion).with_constant(constant);
            cost.curve.residual = Some(match cost.curve.residual.take() {
                Some(before) => before.plus(&now),
                None => now,
            });
            let variance = own.covariance.iter().enumerate().map(|(i, row)| row[i]).sum::<f64>() / SIZE as f64;
            cost.spread_ln = variance.sqrt().hypot(noise_ln);
            cost
        };
        costs.iter().enumerate().map(corrected).collect()
    }
}

/// Covariances of parts with these variances, which have nothing in common.
fn set_diagonal(covariance: &mut [f64], variances: impl ExactSizeIterator<Item = f64>) {
    covariance.fill(0.0);
    let next = variances.len() + 1;
    covariance.iter_mut().step_by(next).zip(variances).for_each(|(entry, variance)| *entry = variance);
}

/// The values of an own part's entries.
fn values(curve: &[f64; CURVE]) -> [f64; SIZE] {
    let mut values = [1.0; SIZE];
    values[1..].copy_from_slice(curve);
    values
}

fn dot(a: &[f64; SIZE], b: &[f64; SIZE]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests;
