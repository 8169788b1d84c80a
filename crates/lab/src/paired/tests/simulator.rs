//! Sweeps of two algorithms whose ratio is known: noise that is partly common, outliers, drift, hosts that change.

use crate::paired::{PairedOutcome, PairedSamples, compare};
pub(super) use sapwise_scenes::Random;

/// Objects and the samples of both algorithms.
pub(super) type Timed = (u32, Vec<u64>, Vec<u64>);

/// What disturbs the timings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Host {
    /// Standard deviation of the logarithm of a sample, half of its variance common to both algorithms on a frame.
    pub(super) noise: f64,
    /// The same of what changes from point to point and from algorithm to algorithm, and is equal in all frames of a point.
    pub(super) points: f64,
    /// By how much the logarithm of the ratio differs between the rounds.
    pub(super) rounds: f64,
}

/// 5 % a sample, 2.5 % a point.
pub(super) const USUAL: Host = Host { noise: 0.05, points: 0.025, rounds: 0.0 };

/// What is measured in the second round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Second {
    Nothing,
    /// The sizes on both sides of each change of the winner, and their geometric mean.
    Crossovers,
    Everything,
}

/// Standard normal by Box and Muller: with tails, which outliers are made of, and which the sum of twelve uniform numbers lacks.
fn normal(random: &mut Random) -> f64 {
    let radius = (-2.0 * (1.0 - random.uniform()).ln()).sqrt();
    radius * (std::f64::consts::TAU * random.uniform()).cos()
}

fn below(random: &mut Random, bound: usize) -> usize {
    (random.uniform() * bound as f64) as usize
}

/// Four sizes a decade from 10 to a million, then what `second` says. `ratio` is `ln(first / second)` at a size.
pub(super) fn sweep(ratio: &dyn Fn(f64) -> f64, host: Host, second: Second, seed: u64) -> Vec<Timed> {
    let mut random = Random::new(seed);
    // Which of the rounds is the slow one for the first algorithm is chance.
    let shift = if random.uniform() < 0.5 { host.rounds / 2.0 } else { -host.rounds / 2.0 };
    let sizes: Vec<u32> = (4..=24).map(|k| 10.0_f64.powf(f64::from(k) / 4.0).round() as u32).collect();
    let mut points = round(&sizes, &|n| ratio(n) + shift, host, &mut random);
    let again = match second {
        Second::Nothing => Vec::new(),
        Second::Crossovers => around_crossovers(&points),
        Second::Everything => sizes,
    };
    points.extend(round(&again, &|n| ratio(n) - shift, host, &mut random));
    points
}

fn around_crossovers(points: &[Timed]) -> Vec<u32> {
    let median = |samples: &[u64]| {
        let mut samples = samples.to_vec();
        samples.sort_unstable();
        samples[samples.len() / 2]
    };
    let first_wins = |p: &Timed| median(&p.1) < median(&p.2);
    let changes = points.windows(2).filter(|w| first_wins(&w[0]) != first_wins(&w[1]));
    let between = |a: u32, b: u32| (f64::from(a) * f64::from(b)).sqrt().round() as u32;
    let mut sizes: Vec<u32> = changes.flat_map(|w| [w[0].0, between(w[0].0, w[1].0), w[1].0]).collect();
    sizes.dedup();
    sizes
}

/// 5 to 40 frames a size; one of the lists ends up to a third earlier. A drift by 10 % over the round hits both alike.
fn round(sizes: &[u32], ratio: &dyn Fn(f64) -> f64, host: Host, random: &mut Random) -> Vec<Timed> {
    let point = |(k, &objects): (usize, &u32)| {
        let frames = 5 + below(random, 36);
        let mut samples = [Vec::new(), Vec::new()];
        let lengths = [frames, (frames - below(random, frames / 3)).max(5)];
        let longer = below(random, 2);
        let n = f64::from(objects);
        let level = (1000.0 * n.powf(1.2)).ln() + 0.1 * k as f64 / sizes.len() as f64;
        let levels = [0.5, -0.5].map(|share| level + share * ratio(n) + host.points * normal(random));
        for frame in 0..frames {
            let common = normal(random);
            for a in 0..2 {
                let noise = host.noise * 0.5_f64.sqrt() * (common + normal(random));
                let outlier = if random.uniform() < 0.05 { 1.0 + 4.0 * random.uniform() } else { 1.0 };
                if frame < lengths[a ^ longer] {
                    samples[a].push(((levels[a] + noise).exp() * outlier).round() as u64);
                }
            }
        }
        let [first, second] = samples;
        (objects, first, second)
    };
    sizes.iter().enumerate().map(point).collect()
}

pub(super) fn paired(points: &[Timed]) -> Vec<PairedSamples<'_>> {
    points.iter().map(|(objects, a, b)| PairedSamples { objects: *objects, first_ns: a, second_ns: b }).collect()
}

/// What many sweeps of the same two algorithms found.
pub(super) struct Trials {
    pub(super) found: Vec<PairedOutcome>,
}

impl Trials {
    pub(super) fn new(ratio: &dyn Fn(f64) -> f64, host: Host, second: Second, count: u64) -> Self {
        let trial = |seed| compare(&paired(&sweep(ratio, host, second, 1_000_003 * (seed + 1)))).unwrap();
        Self { found: (0..count).map(trial).collect() }
    }

    /// Share of the sweeps that found this many crossings.
    pub(super) fn share_with(&self, crossings: usize) -> f64 {
        let with = self.found.iter().filter(|c| c.positions().len() == crossings).count();
        with as f64 / self.found.len() as f64
    }

    /// Of the sweeps that found as many crossings as there are, the share of crossings whose interval holds the true one.
    pub(super) fn coverage(&self, truths: &[f64]) -> f64 {
        let holds: Vec<bool> = self.against(truths).map(|(p, t)| p.low <= t && t <= p.high).collect();
        holds.iter().filter(|h| **h).count() as f64 / holds.len() as f64
    }

    /// The error in octaves that a share of those crossings stays below.
    pub(super) fn error(&self, truths: &[f64], share: f64) -> f64 {
        let mut errors: Vec<f64> = self.against(truths).map(|(p, t)| (p.objects / t).log2().abs()).collect();
        errors.sort_unstable_by(f64::total_cmp);
        errors[((errors.len() - 1) as f64 * share) as usize]
    }

    /// The median width of their intervals, in octaves.
    pub(super) fn width(&self, truths: &[f64]) -> f64 {
        let mut widths: Vec<f64> = self.against(truths).map(|(p, _)| (p.high / p.low).log2()).collect();
        widths.sort_unstable_by(f64::total_cmp);
        widths[widths.len() / 2]
    }

    fn against(&self, truths: &[f64]) -> impl Iterator<Item = (&crate::paired::PairedCrossing, f64)> {
        let complete = self.found.iter().filter(move |c| c.positions().len() == truths.len());
        complete.flat_map(move |c| c.positions().iter().zip(truths.to_vec()))
    }
}
