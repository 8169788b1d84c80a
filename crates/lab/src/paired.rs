//! Two algorithms side by side over the number of objects, from timings of both on the same frames.
//!
//! At each size the median over frames of `ln(first / second)` is taken: pairing frame by frame cancels disturbances
//! that hit both.

use sapwise_tune::stats::{NORMAL_90, mean, median, robust_deviation};
use std::collections::BTreeMap;

/// Standard error of a median over that of a mean, for a normal distribution.
const MEDIAN_OVER_MEAN: f64 = 1.2533;

/// Quantile of the normal distribution that noise alone exceeds in one case of a hundred.
const DISTINCT: f64 = 2.326;

/// Two times that differ by less than this count as equal, however exact they are.
const LEAST_LN: f64 = 0.02;

/// Returns the standard error of the median of values; `None` without any.
pub(crate) fn median_error(values: &[f64]) -> Option<f64> {
    Some(MEDIAN_OVER_MEAN * robust_deviation(values)? / (values.len() as f64).sqrt())
}

/// Frames of two algorithms at one size. The k-th sample of both is the same frame; a sample without a partner is
/// ignored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PairedSamples<'a> {
    /// Objects in each frame.
    pub(crate) objects: u32,
    /// Nanoseconds of the first algorithm.
    pub(crate) first_ns: &'a [u64],
    /// Nanoseconds of the second algorithm.
    pub(crate) second_ns: &'a [u64],
}

/// `ln(first / second)` over the number of objects, at three sizes or more.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PairedRatio {
    /// Ascending by size, each size once.
    sizes: Vec<Size>,
}

/// A number of objects at which the two cost the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crossing {
    /// Number of objects.
    pub(crate) objects: f64,
    /// Whether the first algorithm is the cheaper one with fewer objects.
    pub(crate) first_below: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Size {
    ln_objects: f64,
    /// Above zero if the second algorithm is cheaper.
    ratio_ln: f64,
    error_ln: f64,
}

impl Size {
    /// Combines the ratios at each point of one size, given with their standard errors over the frames.
    fn of(objects: u32, points: &[(f64, f64)]) -> Self {
        let (ratios, errors): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
        // A change between two points does not show in the frames of either.
        let between = robust_deviation(&ratios).unwrap_or(0.0) * MEDIAN_OVER_MEAN;
        let error_ln = mean(&errors).hypot(between) / (points.len() as f64).sqrt();
        Self { ln_objects: f64::from(objects).ln(), ratio_ln: median(&ratios).unwrap_or(0.0), error_ln }
    }

    /// Returns the ratio over the least ratio that differs from zero at that quantile: -1 or less if the first
    /// algorithm is distinctly cheaper.
    fn told(&self, quantile: f64) -> f64 {
        self.ratio_ln / (quantile * self.error_ln).max(LEAST_LN)
    }
}

impl PairedRatio {
    /// Compares two algorithms at points where both were timed, in any order; a size may have several points. `None`
    /// with fewer than three sizes that have a pair of samples above zero.
    pub(crate) fn new(points: &[PairedSamples<'_>]) -> Option<Self> {
        let of_point = |point: &PairedSamples<'_>| {
            let pairs = point.first_ns.iter().zip(point.second_ns).filter(|(a, b)| **a > 0 && **b > 0);
            let ratios: Vec<f64> = pairs.map(|(&a, &b)| (a as f64 / b as f64).ln()).collect();
            Some((point.objects, median(&ratios)?, median_error(&ratios)?))
        };
        Self::of_ratios(points.iter().filter_map(of_point))
    }

    /// Compares two algorithms by `ln(first / second)` at each point, with its standard error, after the number of
    /// objects.
    pub(crate) fn of_ratios(points: impl Iterator<Item = (u32, f64, f64)>) -> Option<Self> {
        let mut sizes: BTreeMap<u32, Vec<(f64, f64)>> = BTreeMap::new();
        for (objects, ratio, error) in points.filter(|p| p.0 > 0 && p.1.is_finite()) {
            sizes.entry(objects).or_default().push((ratio, error));
        }
        let sizes: Vec<Size> = sizes.iter().map(|(&objects, points)| Size::of(objects, points)).collect();
        (sizes.len() >= 3).then_some(Self { sizes })
    }

    /// Returns whether the first algorithm is cheaper on average over the sizes.
    pub(crate) fn first_is_cheaper(&self) -> bool {
        self.sizes.iter().map(|s| s.ratio_ln).sum::<f64>() < 0.0
    }

    /// Returns the crossings, ascending. Each lies between two sizes of which the first algorithm is distinctly
    /// cheaper at one and the second at the other.
    pub(crate) fn crossings(&self) -> Vec<Crossing> {
        let mut found = Vec::new();
        let mut last: Option<usize> = None;
        for (k, size) in self.sizes.iter().enumerate().filter(|(_, size)| size.told(DISTINCT).abs() >= 1.0) {
            if let Some(from) = last
                && (self.sizes[from].ratio_ln > 0.0) != (size.ratio_ln > 0.0)
            {
                found.push(self.crossing(from, k));
            }
            last = Some(k);
        }
        found
    }

    /// Returns the middle one of the roots between two sizes at which opposite algorithms are cheaper.
    fn crossing(&self, from: usize, to: usize) -> Crossing {
        let pairs = self.sizes[from..=to].windows(2);
        let roots: Vec<f64> = pairs
            .filter(|w| (w[0].ratio_ln > 0.0) != (w[1].ratio_ln > 0.0))
            .map(|w| between(w[0].ln_objects, w[1].ln_objects, w[0].ratio_ln / (w[0].ratio_ln - w[1].ratio_ln)))
            .collect();
        Crossing { objects: roots[roots.len() / 2].exp(), first_below: self.sizes[from].ratio_ln < 0.0 }
    }

    /// Returns the 90 % interval of a crossover at `objects`, below which the first algorithm is the cheaper one: from
    /// the last size at which the first is distinctly cheaper, or the smallest size, to the first size at which the
    /// second is, or the largest size. `None` for a crossover beyond the sizes.
    pub(crate) fn interval(&self, objects: f64) -> Option<(f64, f64)> {
        let at = objects.ln();
        let (first, last) = (self.sizes.first()?, self.sizes.last()?);
        if !(first.ln_objects..=last.ln_objects).contains(&at) {
            return None;
        }
        let told: Vec<f64> = self.sizes.iter().map(|size| size.told(NORMAL_90)).collect();
        // The size at which the ratio becomes distinct, between one size and the next, distinct one.
        let edge = |within: usize, beyond: usize| {
            let (from, to) = (told[within], told[beyond].signum());
            let share = if from * to >= 1.0 { 0.0 } else { (to - from) / (told[beyond] - from) };
            between(self.sizes[within].ln_objects, self.sizes[beyond].ln_objects, share).exp()
        };
        let sizes = || (0..told.len()).map(|k| (k, self.sizes[k].ln_objects));
        let low = match sizes().rev().find(|&(k, ln)| ln <= at && told[k] <= -1.0) {
            Some((k, _)) if k + 1 < told.len() => edge(k + 1, k),
            Some(_) => objects,
            None => first.ln_objects.exp(),
        };
        let high = match sizes().find(|&(k, ln)| ln >= at && told[k] >= 1.0) {
            Some((k, _)) if k > 0 => edge(k - 1, k),
            Some(_) => objects,
            None => last.ln_objects.exp(),
        };
        Some((low.min(objects), high.max(objects)))
    }
}

fn between(from: f64, to: f64, share: f64) -> f64 {
    from + (to - from) * share
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_scenes::Random;

    /// Two passes over 21 sizes, five frames each, of two algorithms whose ratio is `(n / 1000) ^ exponent` with 3 %
    /// of noise.
    fn crossing_at_1000(exponent: f64, seed: u64) -> PairedRatio {
        let mut random = Random::named(seed, &[]);
        let mut noisy = |ns: f64| (1e6 * ns * (0.03 * random.normal()).exp()) as u64;
        let points: Vec<(u32, Vec<u64>, Vec<u64>)> = (0..42)
            .map(|k| {
                let n = 10.0_f64.powf(1.0 + f64::from(k % 21) / 4.0).round();
                let mut frames = |ns: f64| (0..5).map(|_| noisy(ns)).collect::<Vec<_>>();
                (n as u32, frames((n / 1000.0).powf(exponent)), frames(1.0))
            })
            .collect();
        let samples = points.iter().map(|(objects, first_ns, second_ns)| PairedSamples {
            objects: *objects,
            first_ns,
            second_ns,
        });
        PairedRatio::new(&samples.collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn a_crossing_is_found_with_its_side_and_lies_in_its_interval() {
        for seed in 0..20 {
            let ratio = crossing_at_1000(1.0, seed);
            let [found] = ratio.crossings()[..] else { panic!("{seed}: {:?}", ratio.crossings()) };
            assert!(found.first_below && (found.objects / 1000.0).log2().abs() < 0.1, "{found:?}");
            let (low, high) = ratio.interval(found.objects).unwrap();
            assert!(low <= 1050.0 && high >= 950.0 && high < 2.0 * low, "{seed}: {low} to {high}");
            assert!(!crossing_at_1000(-1.0, seed).crossings()[0].first_below);
        }
    }

    #[test]
    fn equal_costs_do_not_cross_and_have_the_widest_interval() {
        let found: usize = (0..50).map(|seed| crossing_at_1000(0.0, seed).crossings().len()).sum();
        assert!(found <= 10, "{found} crossings in 50 comparisons");
        let (low, high) = crossing_at_1000(0.001, 1).interval(1000.0).unwrap();
        assert!(low < 300.0 && high > 3000.0, "{low} to {high}");
    }

    #[test]
    fn what_lies_within_the_errors_does_not_cross() {
        let crossings = |error: f64| {
            let ratios =
                [(100, -0.1, error), (200, 0.1, error), (400, -0.1, error), (0, 1.0, 0.0), (800, f64::NAN, 0.0)];
            PairedRatio::of_ratios(ratios.into_iter()).unwrap().crossings().len()
        };
        assert_eq!((crossings(0.0), crossings(0.04), crossings(0.05)), (2, 2, 0));
    }

    #[test]
    fn too_few_sizes_and_a_crossover_beyond_them_are_not_told() {
        let at = |objects| PairedSamples { objects, first_ns: &[2, 2], second_ns: &[1, 1] };
        assert_eq!(PairedRatio::new(&[at(10), at(30), at(30), at(0)]), None);
        let apart = PairedRatio::new(&[at(10), at(30), at(90)]).unwrap();
        assert!(apart.crossings().is_empty() && !apart.first_is_cheaper());
        assert_eq!((apart.interval(100.0), apart.interval(5.0)), (None, None));
        let (low, high) = apart.interval(30.0).unwrap();
        assert!((low - 10.0).abs() < 1e-9 && (high - 30.0).abs() < 1e-9, "{low} to {high}");
    }
}
