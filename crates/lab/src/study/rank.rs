//! Whether two figures of machines rise together: Spearman's rank correlation, with what its interval says.

use crate::evaluate::Verdict;
use sapwise::stats::{NORMAL_90, normal_tail};
use sapwise_scenes::Random;

/// Machines below which nothing is told; the interval needs four.
pub(super) const FEWEST_MACHINES: usize = 5;
/// Machines up to which the chance is taken from orders: with few of them the normal distribution calls every perfect order a link.
const FEW: usize = 10;
/// Orders in which the machines exchange one figure.
const ORDERS: usize = 20_000;
/// Seed of these orders.
const SEED: u64 = 1;
/// A correlation within this is none that matters: it tells less than a tenth of the variance of the ranks.
const LEAST: f64 = 0.3;
/// A correlation of 1 has no finite transform. This one stands for it.
const HIGHEST: f64 = 0.999;
/// Share of the correlations that are called a link which may be none.
const FALSE_LINKS: f64 = 0.1;

/// A correlation over machines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rank {
    /// From -1 to 1.
    pub(super) correlation: f64,
    /// Ends of its 90 % interval (Fisher's transform with the variance of Bonett and Wright 2000).
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) machines: usize,
    /// The chance of as large a correlation of figures that have nothing to do with each other.
    chance: f64,
    pub(super) verdict: Verdict,
}

impl Rank {
    /// Of the machines that have both; `None` of fewer than five, or where one figure is the same on all.
    pub(super) fn of(pairs: &[(f64, f64)]) -> Option<Self> {
        if pairs.len() < FEWEST_MACHINES {
            return None;
        }
        let x = ranks(&pairs.iter().map(|p| p.0).collect::<Vec<_>>());
        let y = ranks(&pairs.iter().map(|p| p.1).collect::<Vec<_>>());
        let correlation = correlation(&x, &y)?;
        let z = correlation.clamp(-HIGHEST, HIGHEST).atanh();
        let over = pairs.len() as f64 - 3.0;
        let error = ((1.0 + correlation * correlation / 2.0) / over).sqrt();
        let end = |sign: f64| (z + sign * NORMAL_90 * error).tanh();
        // Without a link the variance of the transform is 1.06 over n - 3 (Fieller, Hartley and Pearson 1957).
        let chance = match pairs.len() {
            ..=FEW => by_orders(&x, &y, correlation),
            _ => 2.0 * normal_tail(z.abs() / (1.06 / over).sqrt()),
        };
        let (low, high) = (end(-1.0), end(1.0));
        Some(Self { correlation, low, high, machines: pairs.len(), chance, verdict: Verdict::CannotBeTold })
    }
}

/// The share of orders of one side that correlate as much; the order that was found is one of them.
fn by_orders(x: &[f64], y: &[f64], found: f64) -> f64 {
    let mut random = Random::new(SEED);
    let as_much = |_: &usize| {
        let other: Vec<f64> = random.shuffled(y.len()).into_iter().map(|k| y[k]).collect();
        correlation(x, &other).is_some_and(|c| c.abs() >= found.abs() - 1e-9)
    };
    (1 + (0..ORDERS).filter(as_much).count()) as f64 / (1 + ORDERS) as f64
}

/// Sets the verdicts. Of those called linked a tenth is expected to be none (Benjamini and Hochberg 1995), however many are looked at.
pub(super) fn judge(ranks: &mut [&mut Rank]) {
    let mut chances: Vec<f64> = ranks.iter().map(|r| r.chance).collect();
    chances.sort_by(f64::total_cmp);
    let count = chances.len() as f64;
    let below = |(k, chance): (usize, &f64)| (*chance <= FALSE_LINKS * (k + 1) as f64 / count).then_some(*chance);
    let most = chances.iter().enumerate().filter_map(below).fold(0.0, f64::max);
    for rank in ranks {
        rank.verdict = if rank.chance <= most && (rank.low > 0.0 || rank.high < 0.0) {
            Verdict::Linked
        } else if rank.low > -LEAST && rank.high < LEAST {
            Verdict::NotLinked
        } else {
            Verdict::CannotBeTold
        };
    }
}

/// Positions in ascending order, the mean of them where values are the same.
fn ranks(values: &[f64]) -> Vec<f64> {
    let rank = |value: &f64| {
        let below = values.iter().filter(|v| *v < value).count() as f64;
        let same = values.iter().filter(|v| *v == value).count() as f64;
        below + (same + 1.0) / 2.0
    };
    values.iter().map(rank).collect()
}

/// Pearson's correlation; `None` where one side does not vary.
fn correlation(x: &[f64], y: &[f64]) -> Option<f64> {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mx, my) = (mean(x), mean(y));
    let sum = |f: &dyn Fn(f64, f64) -> f64| x.iter().zip(y).map(|(a, b)| f(a - mx, b - my)).sum::<f64>();
    let (xx, yy) = (sum(&|a, _| a * a), sum(&|_, b| b * b));
    (xx > 0.0 && yy > 0.0).then(|| sum(&|a, b| a * b) / (xx * yy).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(machines: usize, share: f64, seed: u64) -> Vec<(f64, f64)> {
        let mut random = Random::named(seed, &["rank"]);
        (0..machines)
            .map(|_| {
                let x = random.normal();
                (x.exp(), share * x + (1.0 - share) * random.normal())
            })
            .collect()
    }

    #[test]
    fn it_agrees_with_a_worked_example() {
        // Five machines, ranks 1 2 3 4 5 against 2 1 4 3 5: 1 - 6 * 4 / (5 * 24).
        let found = Rank::of(&[(1.0, 20.0), (2.0, 10.0), (3.0, 40.0), (4.0, 30.0), (50.0, 50.0)]).unwrap();
        assert!((found.correlation - 0.8).abs() < 1e-12 && found.machines == 5);
        assert!(found.low < 0.8 && found.high > 0.8 && found.high < 1.0, "{found:?}");
        // Of the 120 orders of five 16 have a sum of squared differences of 4 or less, or of 36 or more.
        assert!((found.chance - 16.0 / 120.0).abs() < 0.01, "{found:?}");
        // Two figures of ten machines each share a rank.
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 0.5]), [3.5, 2.0, 3.5, 1.0]);
    }

    #[test]
    fn links_are_told_from_none_and_from_what_cannot_be_told() {
        let mut found: Vec<Rank> = [(60, 0.9), (200, 0.0), (8, 0.3)]
            .iter()
            .map(|&(n, share)| Rank::of(&pairs(n, share, 7)).unwrap())
            .collect();
        judge(&mut found.iter_mut().collect::<Vec<_>>());
        let verdicts: Vec<Verdict> = found.iter().map(|f| f.verdict).collect();
        assert_eq!(verdicts, [Verdict::Linked, Verdict::NotLinked, Verdict::CannotBeTold], "{found:?}");
    }

    #[test]
    fn of_few_machines_noise_is_no_link() {
        for machines in [5, 6, 8] {
            let mut found: Vec<Rank> = (0..300).map(|k| Rank::of(&pairs(machines, 0.0, k)).unwrap()).collect();
            judge(&mut found.iter_mut().collect::<Vec<_>>());
            let linked = found.iter().filter(|f| f.verdict == Verdict::Linked).count();
            assert!(linked <= 1, "{linked} of {machines} machines");
        }
    }

    #[test]
    fn of_figures_that_have_nothing_to_do_with_each_other_few_are_linked() {
        let mut found: Vec<Rank> = (0..100).map(|k| Rank::of(&pairs(12, 0.0, k)).unwrap()).collect();
        judge(&mut found.iter_mut().collect::<Vec<_>>());
        assert!(found.iter().filter(|f| f.verdict == Verdict::Linked).count() <= 2);
        // And the interval holds zero in about nine of ten.
        let holds = found.iter().filter(|f| f.low < 0.0 && f.high > 0.0).count();
        assert!((80..=98).contains(&holds), "{holds}");
    }

    #[test]
    fn too_few_machines_or_one_value_tell_nothing() {
        assert_eq!(Rank::of(&pairs(4, 0.9, 1)), None);
        assert_eq!(Rank::of(&[(1.0, 2.0); 9]), None);
    }
}
