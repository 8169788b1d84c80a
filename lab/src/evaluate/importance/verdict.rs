//! What the intervals of a parameter say.

use super::interval::Interval;
use serde::Serialize;
use std::fmt;

/// Physical machines below which nothing is told: five draws of four machines are mostly the same machines.
pub(super) const FEWEST_MACHINES: usize = 5;
/// Standard deviation of a parameter over the machines, in octaves, below which they are alike in it: 7 %.
const LEAST_DEVIATION: f64 = 0.1;

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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effect {
    /// The rise with one value of the parameter for all machines, in the training too: what no other parameter stands in for. None of too
    /// few machines.
    pub rise: Option<Interval>,
    /// What follows.
    pub verdict: Verdict,
    /// Why it can't be told; empty where it can.
    pub because: String,
}

impl Effect {
    /// Whether it says anything: not of too few machines, and not where what was fitted never reads the parameter, whose values can't
    /// change anything then.
    #[must_use]
    pub fn is_told(&self) -> bool {
        self.rise.is_some_and(|i| i.low != 0.0 || i.high != 0.0)
    }

    /// `deviation` is the standard deviation of the parameter over `machines` machines, in octaves; `least` what matters of the outcome.
    pub(super) fn new(rise: Option<Interval>, machines: usize, deviation: f64, least: f64) -> Self {
        let Some(rise) = rise.filter(|_| machines >= FEWEST_MACHINES) else {
            let because = format!("{machines} physical machines have both; it takes {FEWEST_MACHINES}");
            return Self { rise: None, verdict: Verdict::CannotBeTold, because };
        };
        let (mut verdict, mut because) = (Verdict::CannotBeTold, String::new());
        if deviation < LEAST_DEVIATION {
            because = format!("the parameter hardly varies: its standard deviation is {deviation:.3} octaves");
        } else if rise.high <= least {
            verdict = Verdict::NotLinked;
        } else if rise.low > 0.0 {
            verdict = Verdict::Linked;
        } else {
            because = "the interval holds zero, and more than what matters".to_owned();
        }
        Self { rise: Some(rise), verdict, because }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_follow_from_the_interval() {
        let interval = |low: f64, high: f64| Some(Interval { mean: (low + high) / 2.0, low, high });
        let of = |rise, machines, deviation| Effect::new(rise, machines, deviation, 0.1);
        let (none, wide, above) = (interval(-0.01, 0.01), interval(-0.2, 0.5), interval(0.05, 0.5));
        assert_eq!(of(none, 9, 1.0).verdict, Verdict::NotLinked);
        assert_eq!(of(above, 9, 1.0).verdict, Verdict::Linked);
        // What is surely there and too small to matter.
        assert_eq!(of(interval(0.01, 0.02), 9, 1.0).verdict, Verdict::NotLinked);
        for (effect, word) in
            [(of(wide, 9, 1.0), "holds zero"), (of(above, 9, 0.01), "hardly varies"), (of(above, 4, 1.0), "it takes 5")]
        {
            assert!(effect.verdict == Verdict::CannotBeTold && effect.because.contains(word), "{effect:?}");
        }
    }
}
