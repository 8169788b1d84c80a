//! Shares of the work, with which all ranks take the same time.

use sapwise::Tuning;
use sapwise::algorithm::Load;

/// The loads for which each rank predicts its time, as multiples of the mean load.
pub const FACTORS: [f64; 9] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];

/// Predicts the nanoseconds of the cheapest algorithm of a tuning for a load.
///
/// Without costs in the tuning each box and each pair counts one nanosecond, so that only ratios have a meaning.
pub fn predicted_ns(tuning: &Tuning, load: &Load) -> f64 {
    let counted = || f64::from(load.objects) + load.pairs;
    tuning.cheapest(load, |_| true).map_or_else(counted, |(_, ns)| ns).max(1.0)
}

/// Returns the share of each rank with which all are predicted to take the same time. The sum is 1.
///
/// `times` holds the time of each rank for each of the [`FACTORS`] of the mean load; it interpolates between them. A
/// rank with a time that is not a number above 0 counts as one of mean speed.
///
/// It uses only sums, products and comparisons, so that all ranks compute the same bits on any processor.
pub fn shares(times: &[[f64; FACTORS.len()]]) -> Vec<f64> {
    let sound = |t: &&[f64; FACTORS.len()]| t.iter().all(|v| v.is_finite() && *v > 0.0);
    let known: Vec<_> = times.iter().filter(sound).collect();
    if known.is_empty() {
        return vec![1.0 / times.len() as f64; times.len()];
    }
    let mean = std::array::from_fn(|k| known.iter().map(|t| t[k]).sum::<f64>() / known.len() as f64);
    let ascending = |t: &[f64; FACTORS.len()]| {
        let mut t = if sound(&t) { *t } else { mean };
        // A curve that does not ascend has no inverse.
        (1..t.len()).for_each(|k| t[k] = t[k].max(t[k - 1] * 1.001));
        t
    };
    let times: Vec<_> = times.iter().map(ascending).collect();
    let (mut low, mut high) = (0.0, times.iter().map(|t| t[4]).fold(0.0, f64::max));
    for _ in 0..100 {
        let time = (low + high) / 2.0;
        let done: f64 = times.iter().map(|t| work(t, time)).sum();
        if done < times.len() as f64 { low = time } else { high = time }
    }
    let work: Vec<f64> = times.iter().map(|t| work(t, high)).collect();
    let all: f64 = work.iter().sum();
    work.into_iter().map(|w| w / all).collect()
}

/// Returns the cost of one more pair over that of one more box at a load; 0 if more boxes take no more time.
///
/// `predict` returns the time of a load.
pub fn pair_cost(load: &Load, predict: impl Fn(&Load) -> f64) -> f64 {
    // A large step, because the curve jumps when another algorithm becomes the cheapest.
    const MORE: f64 = 1.25;
    let now = predict(load);
    let objects = (f64::from(load.objects) * MORE).min(f64::from(u32::MAX)) as u32;
    let box_ns = (predict(&load.rescaled(objects, load.pairs)) - now) / f64::from(objects - load.objects).max(1.0);
    let pair_ns = (predict(&load.with_pairs(load.pairs * MORE)) - now) / (load.pairs * (MORE - 1.0)).max(1.0);
    let cost = pair_ns / box_ns;
    if cost.is_finite() && box_ns > 0.0 { cost.clamp(0.0, 16.0) } else { 0.0 }
}

/// Returns the cost of a box of each region over the mean box. `works` is the work of each region over that of a mean
/// region, `owned` the weight of its samples in any unit. Boxes weigh more in a region with many pairs or with many
/// boxes of others.
pub fn costs(works: &[f64], owned: &[u64]) -> Vec<f64> {
    let mean = owned.iter().sum::<u64>() as f64 / owned.len().max(1) as f64;
    let cost = |(work, &owned): (&f64, &u64)| {
        let cost = work * mean / owned as f64;
        if cost.is_finite() { cost.clamp(0.0625, 16.0) } else { 1.0 }
    };
    works.iter().zip(owned).map(cost).collect()
}

/// The work that a rank does in a time, as a multiple of the mean load.
fn work(times: &[f64; FACTORS.len()], time: f64) -> f64 {
    let at = times.partition_point(|t| *t <= time);
    match at {
        0 => FACTORS[0] * time / times[0],
        9.. => FACTORS[8] * time / times[8],
        _ => {
            let (low, high) = (times[at - 1], times[at]);
            FACTORS[at - 1] + (FACTORS[at] - FACTORS[at - 1]) * (time - low) / (high - low)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::Registry;

    fn linear(call: f64, unit: f64) -> [f64; 9] {
        FACTORS.map(|f| call + unit * f)
    }

    #[test]
    fn shares_follow_speed_and_fixed_costs() {
        let near = |found: Vec<f64>, wanted: &[f64]| {
            assert!(found.iter().zip(wanted).all(|(f, w)| (f - w).abs() < 1e-3), "{found:?} {wanted:?}");
        };
        near(shares(&[linear(0.0, 1.0); 4]), &[0.25; 4]);
        near(shares(&[linear(0.0, 1.0), linear(0.0, 3.0)]), &[0.75, 0.25]);
        // 1 + 2 f = 0 + 2 g and f + g = 2: the second rank does a half more.
        near(shares(&[linear(1.0, 2.0), linear(0.0, 2.0)]), &[0.375, 0.625]);
        near(shares(&[linear(0.0, 1.0), [f64::NAN; 9]]), &[0.5, 0.5]);
        near(shares(&[[0.0; 9]; 2]), &[0.5, 0.5]);
        // A thousand times as slow.
        near(shares(&[linear(0.0, 1.0), linear(0.0, 1000.0)]), &[1000.0 / 1001.0, 1.0 / 1001.0]);
    }

    #[test]
    fn boxes_cost_as_much_as_their_region() {
        assert_eq!(costs(&[1.0, 1.0, 1.0], &[30, 60, 30]), [4.0 / 3.0, 2.0 / 3.0, 4.0 / 3.0]);
        assert_eq!(costs(&[1.5, 0.5], &[10, 10]), [1.5, 0.5]);
        assert_eq!(costs(&[1.0, 0.0, f64::NAN], &[0, 5, 5]), [1.0, 0.0625, 1.0]);
    }

    #[test]
    fn a_tuning_without_costs_counts_boxes_and_pairs() {
        let tuning = Tuning::usual(&Registry::with_cores(1));
        assert_eq!(predicted_ns(&tuning, &Load::of_objects(10).with_pairs(5.0)), 15.0);
        let load = Load::of_objects(1000).with_pairs(500.0);
        assert_eq!(pair_cost(&load, |load| predicted_ns(&tuning, load)), 1.0);
        assert_eq!(pair_cost(&load, |_| 1.0), 0.0);
    }
}
