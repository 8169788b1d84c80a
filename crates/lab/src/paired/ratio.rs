//! The ratio of two costs over the sizes: lines through nearby medians, and their errors.
//!
//! Drawing frames again would show the error of a median within its point only. Between points the host changes, and with it
//! both costs by some percent; that error shows in how far medians lie from the lines, and between rounds.

use sapwise::stats::{median, robust_deviation};

/// A line takes part of this much to either side of its place, in natural logarithms of the size: 0.6 of a decade, over which
/// the exponents of costs change little.
const REACH: f64 = 0.6 * std::f64::consts::LN_10;
/// Where fewer sizes lie within, it takes these many and reaches a fifth beyond: what lies at the reach itself has no weight.
const NEIGHBOURS: usize = 4;
const BEYOND: f64 = 1.2;
/// The shorter line that is taken where costs bend within the reach.
const SHORTER: f64 = 0.5;
/// Medians within this many reaches have one variance: more of them tell it better, but small sizes are noisier than large ones.
const ALIKE: f64 = 2.0;
/// Distance of the places at which the ratio is evaluated: 1/32 octave.
const GRID_STEP: f64 = std::f64::consts::LN_2 / 32.0;

/// Frames of two algorithms at one point. The k-th sample of both is the same frame; what has no partner is not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairedSamples<'a> {
    /// Objects in each frame.
    pub objects: u32,
    /// Nanoseconds of the first algorithm.
    pub first_ns: &'a [u64],
    /// Nanoseconds of the second algorithm.
    pub second_ns: &'a [u64],
}

/// `ln(first / second)` over the logarithm of the size.
#[derive(Debug, Clone)]
pub(super) struct Ratio {
    /// Ascending by place.
    medians: Vec<Median>,
    /// How far each median lies from the line at its place, in the order of the medians.
    residuals: Vec<f64>,
    /// Variance of each median, and the degrees of freedom that it was found with.
    variances: Vec<(f64, f64)>,
    rounds: usize,
    /// Places, in natural logarithms of the objects.
    pub(super) grid: Vec<f64>,
    /// For each place the line there.
    lines: Vec<Line>,
}

/// The median over the frames of a point.
#[derive(Debug, Clone)]
struct Median {
    /// Natural logarithm of the objects.
    at: f64,
    /// The pass over the sizes in which it was measured.
    round: usize,
    value: f64,
    /// Of the median, as far as its frames show it.
    variance: f64,
}

/// Weights of the medians from the first of them on; the others have none.
#[derive(Debug, Clone, Default)]
struct Weights(usize, Vec<f64>);

/// How the medians enter the ratio at a place.
#[derive(Debug, Clone)]
struct Line {
    weights: Weights,
    /// By how much the shorter line says otherwise, as far as noise does not explain it: too little to take that line, and as
    /// much as this one may be off where costs bend.
    bend: f64,
}

/// A weighted sum of medians.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub(super) value: f64,
    deviation: f64,
    /// Degrees of freedom of the deviation.
    freedom: f64,
}

impl Estimate {
    /// The value over the one that pure noise exceeds as rarely as a normal variable exceeds `quantile`.
    pub(super) fn in_units_of(self, quantile: f64) -> f64 {
        let units = self.value / (self.deviation * student(quantile, self.freedom));
        // Without noise and exactly at a crossing nothing is told from nothing.
        if units.is_nan() { 0.0 } else { units }
    }
}

impl Ratio {
    /// `None` with fewer than three sizes that have a pair of samples. Where costs bend is told by differences beyond
    /// `distinct`, a quantile of the normal distribution.
    pub(super) fn new(points: &[PairedSamples<'_>], distinct: f64) -> Option<Self> {
        let (medians, rounds) = medians(points);
        let places: Vec<f64> = medians.iter().map(|m| m.at).collect();
        let mut sizes = places.clone();
        sizes.dedup();
        let (&low, &high) = (sizes.first()?, sizes.last()?);
        if sizes.len() < 3 {
            return None;
        }
        let parts = ((high - low) / GRID_STEP).ceil().max(1.0) as usize;
        // Rounding must not put the last place below the largest size.
        let grid = (0..parts).map(|k| low + (high - low) * k as f64 / parts as f64).chain([high]).collect();
        let variances = pooled(&medians, &sizes, &differences(&medians));
        let mut ratio = Self { residuals: Vec::new(), variances, medians, rounds, grid, lines: Vec::new() };
        ratio.lines = ratio.grid.iter().map(|&x| ratio.line(&places, x, reach(&sizes, x), distinct)).collect();
        let miss = |(k, &x)| ratio.miss(k, &line(&places, x, reach(&sizes, x)).unwrap_or_default());
        let misses: Vec<Miss> = places.iter().enumerate().map(miss).collect();
        ratio.residuals = misses.iter().map(|m| m.distance).collect();
        ratio.variances = pooled(&ratio.medians, &sizes, &misses);
        Some(ratio)
    }

    /// The line at `x`, or the shorter one where the two differ distinctly.
    fn line(&self, places: &[f64], x: f64, reach: f64, distinct: f64) -> Line {
        let long = line(places, x, reach).unwrap_or_default();
        let Some(shorter) = line(places, x, SHORTER * reach) else { return Line { weights: long, bend: 0.0 } };
        let mut difference: Vec<f64> = long.1.iter().map(|w| -w).collect();
        difference[shorter.0 - long.0..].iter_mut().zip(&shorter.1).for_each(|(d, w)| *d += w);
        let difference = self.estimate(&Weights(long.0, difference));
        if difference.in_units_of(distinct).abs() > 1.0 {
            return Line { weights: shorter, bend: 0.0 };
        }
        let beyond_noise = difference.value.powi(2) - difference.deviation.powi(2);
        Line { weights: long, bend: beyond_noise.max(0.0).sqrt() }
    }

    /// How far the k-th median lies from the line at its place.
    fn miss(&self, k: usize, Weights(first, weights): &Weights) -> Miss {
        let fitted: f64 = weights.iter().zip(&self.medians[*first..]).map(|(w, m)| w * m.value).sum();
        // The line follows each of its points.
        let share = 1.0 - 2.0 * weights[k - first] + weights.iter().map(|w| w * w).sum::<f64>();
        Miss { distance: self.medians[k].value - fitted, share, freedom: share }
    }

    /// The ratio at each place of the grid. Its error is that of the points and of bends, or that between rounds if it is larger.
    pub(super) fn curve(&self) -> Vec<Estimate> {
        let widened = |l: &Line| {
            let estimate = self.estimate(&l.weights);
            let deviation = estimate.deviation.hypot(l.bend).max(self.between_rounds(&l.weights));
            Estimate { deviation, ..estimate }
        };
        self.lines.iter().map(widened).collect()
    }

    /// The sum of the ratio over a stretch of the grid, with the error between points and not that between rounds: a change of
    /// the host moves a crossing, which its interval tells, and would hide here what each of the rounds shows.
    pub(super) fn area(&self, from: usize, to: usize) -> Estimate {
        let mut total = vec![0.0; self.medians.len()];
        for Line { weights: Weights(first, weights), .. } in &self.lines[from..=to] {
            total[*first..].iter_mut().zip(weights).for_each(|(t, w)| *t += w);
        }
        self.estimate(&Weights(0, total))
    }

    fn estimate(&self, Weights(first, weights): &Weights) -> Estimate {
        let (mut value, mut variance, mut freedom) = (0.0, 0.0, 0.0);
        for (k, w) in (*first..).zip(weights) {
            let own = w * w * self.variances[k].0;
            value += w * self.medians[k].value;
            variance += own;
            freedom += own * self.variances[k].1;
        }
        let freedom = if variance > 0.0 { freedom / variance } else { 1.0 };
        Estimate { value, deviation: variance.sqrt(), freedom }
    }

    /// The deviation that residuals alike within each round make (Liang and Zeger, 1986, with the rounds as clusters): a host that
    /// changed between them moves all medians of one. Two rounds have one difference, so that this is itself uncertain: where
    /// rounds differ by chance and much more than points do, intervals of 90 % hold the truth in some 75 %.
    fn between_rounds(&self, Weights(first, weights): &Weights) -> f64 {
        let mut sums = vec![None; self.rounds];
        for (k, w) in (*first..).zip(weights) {
            *sums[self.medians[k].round].get_or_insert(0.0) += w * self.residuals[k];
        }
        let rounds = sums.iter().flatten().count() as f64;
        let squares: f64 = sums.iter().flatten().map(|s: &f64| s * s).sum();
        if rounds > 1.0 { (squares * rounds / (rounds - 1.0)).sqrt() } else { 0.0 }
    }
}

/// The median of each point, ascending by size, and the number of rounds.
fn medians(points: &[PairedSamples<'_>]) -> (Vec<Median>, usize) {
    let mut medians = Vec::new();
    let (mut round, mut before) = (0, 0);
    for point in points.iter().filter(|p| p.objects > 0) {
        let pairs = point.first_ns.iter().zip(point.second_ns).filter(|(a, b)| **a > 0 && **b > 0);
        let ratios: Vec<f64> = pairs.map(|(&a, &b)| (a as f64 / b as f64).ln()).collect();
        if ratios.is_empty() {
            continue;
        }
        round += usize::from(point.objects <= before);
        before = point.objects;
        let (Some(value), Some(spread)) = (median(&ratios), robust_deviation(&ratios)) else { continue };
        // That of a mean times this is that of a median.
        let deviation = 1.2533 * spread;
        let variance = deviation * deviation / ratios.len() as f64;
        medians.push(Median { at: f64::from(point.objects).ln(), round, value, variance });
    }
    medians.sort_by(|a, b| a.at.total_cmp(&b.at));
    (medians, round + 1)
}

/// How far a median lies from where others put it.
struct Miss {
    distance: f64,
    /// The expected square of the distance, over the variance of a median.
    share: f64,
    /// Degrees of freedom that it adds.
    freedom: f64,
}

/// The distance of each median but the outer ones from the line through the one before and the one after it (Gasser, Sroka and
/// Jennen-Steinmetz, 1986). They show the noise alone, the residuals of lines also how the costs bend.
fn differences(medians: &[Median]) -> Vec<Miss> {
    let miss = |w: &[Median]| {
        let width = w[2].at - w[0].at;
        let after = if width > 0.0 { (w[1].at - w[0].at) / width } else { 0.5 };
        let distance = w[1].value - (1.0 - after) * w[0].value - after * w[2].value;
        // Neighbours share two of their three medians, so that two of them tell about as much as one alone.
        Miss { distance, share: 1.0 + (1.0 - after).powi(2) + after * after, freedom: 0.5 }
    };
    let none = || std::iter::once(Miss { distance: 0.0, share: 0.0, freedom: 0.0 });
    none().chain(medians.windows(3).map(miss)).chain(none()).collect()
}

/// The variance of each median from the misses of those nearby, and the degrees of freedom of that.
fn pooled(medians: &[Median], sizes: &[f64], misses: &[Miss]) -> Vec<(f64, f64)> {
    let variance = |x: f64| {
        let near = ALIKE * reach(sizes, x);
        let from = medians.partition_point(|m| x - m.at >= near);
        let to = medians.partition_point(|m| m.at - x < near);
        let of_frames = medians[from..to].iter().map(|m| m.variance).sum::<f64>() / (to - from) as f64;
        let squares: f64 = misses[from..to].iter().map(|m| m.distance * m.distance).sum();
        let shares: f64 = misses[from..to].iter().map(|m| m.share).sum();
        let freedom: f64 = misses[from..to].iter().map(|m| m.freedom).sum();
        // Three sizes leave next to no freedom, and chance may put them on a line: what the frames show counts as one miss more.
        ((squares + of_frames) / (shares + 1.0), freedom + 1.0)
    };
    medians.iter().map(|m| variance(m.at)).collect()
}

/// How far a line at `x` reaches.
fn reach(sizes: &[f64], x: f64) -> f64 {
    let mut distances: Vec<f64> = sizes.iter().map(|s| (s - x).abs()).collect();
    let last = NEIGHBOURS.min(sizes.len()) - 1;
    REACH.max(BEYOND * *distances.select_nth_unstable_by(last, f64::total_cmp).1)
}

/// The weights with which values at ascending places enter a tricube-weighted line (Cleveland, 1979) evaluated at `x`. `None`
/// where fewer than two places lie within the reach.
fn line(places: &[f64], x: f64, reach: f64) -> Option<Weights> {
    let first = places.partition_point(|p| x - p >= reach);
    let window = &places[first..places.partition_point(|p| p - x < reach)];
    if window.first() == window.last() {
        return None;
    }
    let tricube: Vec<f64> = window.iter().map(|p| (1.0 - ((p - x).abs() / reach).powi(3)).powi(3)).collect();
    let total: f64 = tricube.iter().sum();
    let centre = tricube.iter().zip(window).map(|(w, p)| w * p).sum::<f64>() / total;
    let spread: f64 = tricube.iter().zip(window).map(|(w, p)| w * (p - centre).powi(2)).sum();
    let weight = |(w, p): (&f64, &f64)| w * (1.0 / total + (x - centre) * (p - centre) / spread);
    Some(Weights(first, tricube.iter().zip(window).map(weight).collect()))
}

/// The quantile of Student's distribution that belongs to `z` of the normal one, by the expansion of Fisher and Cornish (1960)
/// to the third order: 2 % too small at two degrees of freedom and 12 % at one.
fn student(z: f64, freedom: f64) -> f64 {
    let (f, s) = (freedom.max(1.0), z * z);
    let first = (s + 1.0) / 4.0;
    let second = ((5.0 * s + 16.0) * s + 3.0) / 96.0;
    let third = (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0;
    z * (1.0 + (first + (second + third / f) / f) / f)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_as_in_the_tables() {
        for (freedom, in_table, within) in
            [(1e9, 1.645, 0.001), (20.0, 1.725, 0.002), (5.0, 2.015, 0.002), (2.0, 2.920, 0.07)]
        {
            assert!((student(1.645, freedom) - in_table).abs() < within, "{freedom}: {}", student(1.645, freedom));
        }
    }

    #[test]
    fn a_line_goes_through_what_lies_on_one_and_needs_two_places() {
        let places = [0.0, 0.4, 0.4, 1.0, 1.7];
        for x in [0.0, 0.3, 1.2, 1.7] {
            let Weights(first, weights) = line(&places, x, 1.5).unwrap();
            let at_x: f64 = weights.iter().zip(&places[first..]).map(|(w, p)| w * (3.0 - 2.0 * p)).sum();
            assert!((at_x - (3.0 - 2.0 * x)).abs() < 1e-12, "{x}: {at_x}");
        }
        assert!(line(&places, 0.4, 0.2).is_none() && line(&places, 9.0, 1.0).is_none());
    }

    #[test]
    fn rounds_begin_where_sizes_do_not_grow() {
        let at = |objects| PairedSamples { objects, first_ns: &[2], second_ns: &[1] };
        let (medians, rounds) = medians(&[at(10), at(30), at(90), at(30), at(50), at(50)]);
        let order: Vec<(f64, usize)> = medians.iter().map(|m| (m.at.exp().round(), m.round)).collect();
        assert_eq!(order, [(10.0, 0), (30.0, 0), (30.0, 1), (50.0, 1), (50.0, 2), (90.0, 0)]);
        assert_eq!(rounds, 3);
    }
}
