//! A mean rise over machines, how far it would differ with other machines, and what follows.

use sapwise::stats::{mean, quantile};
use sapwise_scenes::Random;
use serde::Serialize;
use std::fmt;

/// Physical machines below which nothing is told: five draws of four machines are mostly the same machines.
pub(super) const FEWEST_MACHINES: usize = 5;
/// Standard deviation of a parameter over the machines, in octaves, below which they are alike in it: 7 %.
const LEAST_DEVIATION: f64 = 0.1;
/// Draws of as many machines as there are, with replacement, and their seed.
const DRAWS: usize = 2000;
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
    /// Machines are drawn and not rows: more rows of one machine are no more evidence about others. The models are not fitted again to
    /// each draw, so that the interval says how far machines differ under these models.
    pub(super) fn of(values: &[f64]) -> Option<Self> {
        let mut random = Random::new(SEED);
        let mut draw = || values[(random.bits() % values.len() as u64) as usize];
        let count = if values.is_empty() { 0 } else { DRAWS };
        let means: Vec<f64> =
            (0..count).map(|_| values.iter().map(|_| draw()).sum::<f64>() / values.len() as f64).collect();
        Some(Self { low: quantile(&means, 0.05)?, high: quantile(&means, 0.95)?, mean: mean(values) })
    }
}

/// Whether a parameter and an outcome belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Predictions of machines held out are worse without it.
    Linked,
    /// They are worse by less than matters, with the interval as proof.
    NotLinked,
    /// Neither is shown.
    CannotBeTold,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Linked => "linked",
            Self::NotLinked => "not linked",
            Self::CannotBeTold => "cannot be told from these machines",
        })
    }
}

/// How much worse an outcome is on machines held out, and what follows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Effect {
    /// The rise with one value of the parameter for all machines, in the training too: what no other parameter stands in for. `None` of
    /// fewer than five machines.
    pub rise: Option<Interval>,
    /// What follows. Neither where the parameter hardly varies over the machines.
    pub verdict: Verdict,
}

impl Effect {
    /// Whether it says anything: not of too few machines, and not where what was fitted never reads the parameter, whose values can't
    /// change anything then.
    #[must_use]
    pub fn is_told(&self) -> bool {
        self.rise.is_some_and(|i| i.low != 0.0 || i.high != 0.0)
    }

    /// `rises` has one value for each machine, `deviation` is the standard deviation of the parameter over them, in octaves, and `least` is
    /// what matters of the outcome.
    pub(super) fn new(rises: &[f64], deviation: f64, least: f64) -> Self {
        let rise = Interval::of(rises).filter(|_| rises.len() >= FEWEST_MACHINES);
        Self { rise, verdict: rise.map_or(Verdict::CannotBeTold, |rise| verdict(rise, deviation, least)) }
    }
}

fn verdict(rise: Interval, deviation: f64, least: f64) -> Verdict {
    match rise {
        _ if deviation < LEAST_DEVIATION => Verdict::CannotBeTold,
        _ if rise.high <= least => Verdict::NotLinked,
        _ if rise.low > 0.0 => Verdict::Linked,
        _ => Verdict::CannotBeTold,
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

    #[test]
    fn verdicts_follow_from_the_interval() {
        let of =
            |low: f64, high: f64, deviation| verdict(Interval { mean: (low + high) / 2.0, low, high }, deviation, 0.1);
        assert_eq!(of(-0.01, 0.01, 1.0), Verdict::NotLinked);
        assert_eq!(of(0.05, 0.5, 1.0), Verdict::Linked);
        // What is surely there and too small to matter.
        assert_eq!(of(0.01, 0.02, 1.0), Verdict::NotLinked);
        // The interval holds zero and what matters; the parameter hardly varies; there are four machines.
        assert_eq!([of(-0.2, 0.5, 1.0), of(0.05, 0.5, 0.01)], [Verdict::CannotBeTold; 2]);
        assert_eq!(Effect::new(&[0.3; 4], 1.0, 0.1), Effect { rise: None, verdict: Verdict::CannotBeTold });
        assert_eq!(Effect::new(&[0.3; 5], 1.0, 0.1).verdict, Verdict::Linked);
    }
}
