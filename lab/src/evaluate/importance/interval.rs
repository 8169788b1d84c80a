//! A mean over machines, and how far it would differ with other machines.

use sapwise::stats::quantile;
use sapwise_scenes::Random;
use serde::Serialize;

/// Draws of as many machines as there are, with replacement.
const DRAWS: usize = 2000;
/// Seed of the draws.
const SEED: u64 = 1;

/// A mean over physical machines with its 90 % interval by a bootstrap over them, in the unit of what holds it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// The mean over the machines.
    pub mean: f64,
    /// Lower end, the 5 % quantile of the means of the draws.
    pub low: f64,
    /// Upper end, the 95 % quantile.
    pub high: f64,
}

impl Interval {
    /// Of one value for each machine; `None` of no machine.
    ///
    /// Machines are drawn and not rows: what there is more of from one machine is no more evidence about others. The models are not
    /// fitted again to each draw, so that the interval says how far machines differ under these models.
    pub(super) fn of(values: &[f64]) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        let mut random = Random::new(SEED);
        let mut draw = || values[(random.bits() % values.len() as u64) as usize];
        let mean = |sum: f64| sum / values.len() as f64;
        let means: Vec<f64> = (0..DRAWS).map(|_| mean((0..values.len()).map(|_| draw()).sum())).collect();
        Some(Self { mean: mean(values.iter().sum()), low: quantile(&means, 0.05)?, high: quantile(&means, 0.95)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_of_a_mean_is_as_wide_as_that_of_a_normal_distribution() {
        let mut random = Random::named(3, &[]);
        let values: Vec<f64> = (0..100).map(|_| 2.0 + random.normal()).collect();
        let found = Interval::of(&values).unwrap();
        // 1.645 standard deviations of the mean of a hundred to either side.
        assert!(((found.high - found.low) / 0.329 - 1.0).abs() < 0.25, "{found:?}");
        assert!(found.low < 2.0 && 2.0 < found.high && found.low < found.mean && found.mean < found.high, "{found:?}");
        assert_eq!(Interval::of(&[]), None);
        assert_eq!(Interval::of(&[0.5; 7]), Some(Interval { mean: 0.5, low: 0.5, high: 0.5 }));
    }
}
