//! Simulated sweeps with known crossings. With 400 trials the standard error of a coverage of 90 % is 1.5 %.

mod simulator;

use super::*;
use simulator::{Host, Random, Second, Trials, USUAL, paired, sweep};

/// The required range of the coverage of a 90 % interval.
const COVERAGE: std::ops::RangeInclusive<f64> = 0.85..=0.97;

/// The exponents of two costs that cross at `truth` differ by `exponent`.
fn crossing(truth: f64, exponent: f64) -> impl Fn(f64) -> f64 {
    move |n| exponent * (n / truth).ln()
}

fn octaves(n: f64, from: f64) -> f64 {
    (n / from).log2()
}

#[test]
fn a_steep_crossing_is_found_to_a_twentieth_of_an_octave() {
    for (truth, second) in [(1000.0, Second::Crossovers), (2300.0, Second::Crossovers), (1000.0, Second::Everything)] {
        let trials = Trials::new(&crossing(truth, 1.0), USUAL, second, 400);
        assert_eq!(trials.share_with(1), 1.0);
        assert!(trials.error(&[truth], 0.95) <= 0.05, "{}", trials.error(&[truth], 0.95));
        assert!(COVERAGE.contains(&trials.coverage(&[truth])), "{}", trials.coverage(&[truth]));
        assert!(trials.found.iter().all(|c| c.positions()[0].first_below));
    }
}

#[test]
fn costs_that_bend_cross_where_they_do() {
    // 0.5 n^2 = 40 n + 6000.
    let truth = 40.0 + (1600.0_f64 + 12_000.0).sqrt();
    let trials = Trials::new(&|n| (0.5 * n * n / (40.0 * n + 6000.0)).ln(), USUAL, Second::Crossovers, 400);
    assert_eq!(trials.share_with(1), 1.0);
    assert!(trials.error(&[truth], 0.95) <= 0.05, "{}", trials.error(&[truth], 0.95));
    assert!(COVERAGE.contains(&trials.coverage(&[truth])), "{}", trials.coverage(&[truth]));
}

#[test]
fn one_round_alone_has_a_larger_error_and_tells_it() {
    let trials = Trials::new(&crossing(1000.0, 1.0), USUAL, Second::Nothing, 400);
    assert!(trials.error(&[1000.0], 0.95) <= 0.075, "{}", trials.error(&[1000.0], 0.95));
    assert!(COVERAGE.contains(&trials.coverage(&[1000.0])), "{}", trials.coverage(&[1000.0]));
}

#[test]
fn shallow_and_medium_crossings_lie_in_their_intervals() {
    for (truth, exponent) in [(3000.0, 0.4), (1000.0, 0.1), (20_000.0, 0.1)] {
        let trials = Trials::new(&crossing(truth, exponent), USUAL, Second::Crossovers, 400);
        assert!(trials.share_with(1) >= 0.98, "{}", trials.share_with(1));
        assert!(COVERAGE.contains(&trials.coverage(&[truth])), "{exponent}: {}", trials.coverage(&[truth]));
        // An error of 3 % in the ratio, over the exponent.
        assert!(trials.error(&[truth], 0.95) <= 0.05 / exponent, "{exponent}: {}", trials.error(&[truth], 0.95));
    }
}

#[test]
fn crossings_near_either_end_are_found() {
    for truth in [14.0, 600_000.0] {
        let trials = Trials::new(&crossing(truth, 1.0), USUAL, Second::Crossovers, 400);
        assert!(trials.share_with(1) >= 0.95, "{}", trials.share_with(1));
        assert!(COVERAGE.contains(&trials.coverage(&[truth])), "{truth}: {}", trials.coverage(&[truth]));
        assert!(trials.error(&[truth], 0.95) <= 0.06, "{truth}: {}", trials.error(&[truth], 0.95));
    }
}

#[test]
fn several_crossings_are_all_found() {
    let two = |n: f64| 0.05 * octaves(n, 128.0) * octaves(n, 8192.0);
    let trials = Trials::new(&two, USUAL, Second::Crossovers, 200);
    assert!(trials.share_with(2) >= 0.98);
    assert!(COVERAGE.contains(&trials.coverage(&[128.0, 8192.0])), "{}", trials.coverage(&[128.0, 8192.0]));
    assert!(trials.error(&[128.0, 8192.0], 0.95) <= 0.2, "{}", trials.error(&[128.0, 8192.0], 0.95));
    for found in &trials.found {
        let sides: Vec<bool> = found.positions().iter().map(|p| p.first_below).collect();
        assert_eq!(sides, [false, true], "{found:?}");
    }
    // Zero at 100, 3162 and 100 000.
    let three = |n: f64| -0.5 * (std::f64::consts::PI * (n.log10() - 2.0) / 1.5).sin();
    let trials = Trials::new(&three, USUAL, Second::Crossovers, 200);
    assert!(trials.share_with(3) >= 0.98, "{}", trials.share_with(3));
    let truths = [100.0, 10.0_f64.powf(3.5), 100_000.0];
    assert!(trials.error(&truths, 0.95) <= 0.2, "{}", trials.error(&truths, 0.95));
}

#[test]
fn a_bend_at_a_cache_size_widens_the_interval_instead_of_missing_the_crossing() {
    // From the exponent 0.2 to 1 where the data leave the cache, there and half an octave before it.
    for cache in [1000.0, 700.0] {
        let ratio = move |n: f64| 0.2 * (n / 1000.0).ln() + 0.8 * (n / cache).ln().max(0.0);
        let truth = (0.2 * 1000.0_f64.ln() + 0.8 * cache.ln()).exp();
        let trials = Trials::new(&ratio, USUAL, Second::Crossovers, 200);
        assert_eq!(trials.share_with(1), 1.0);
        assert!(trials.coverage(&[truth]) >= 0.85, "{cache}: {}", trials.coverage(&[truth]));
        assert!(trials.error(&[truth], 0.5) <= 0.2, "{cache}: {}", trials.error(&[truth], 0.5));
    }
}

#[test]
fn one_that_is_always_cheaper_is_told_with_its_side() {
    for (ahead, always) in [(0.05_f64, PairedOutcome::AlwaysSecond), (-0.2, PairedOutcome::AlwaysFirst)] {
        let trials = Trials::new(&|_| ahead, USUAL, Second::Crossovers, 200);
        assert!(trials.found.iter().all(|c| *c == always));
    }
}

#[test]
fn costs_that_touch_or_are_equal_seldom_cross() {
    let equal = Trials::new(&|_| 0.0, USUAL, Second::Crossovers, 400);
    assert!(equal.share_with(0) >= 0.97, "{}", equal.share_with(0));
    let touching = Trials::new(&|n| 0.03 * octaves(n, 1024.0).powi(2), USUAL, Second::Crossovers, 200);
    assert!(touching.share_with(0) >= 0.98, "{}", touching.share_with(0));
    assert!(touching.found.iter().all(|c| c.positions().len() != 1));
    let apart_only_at_the_end = Trials::new(&|n| 0.1 * octaves(n, 30_000.0).max(0.0), USUAL, Second::Crossovers, 200);
    assert!(apart_only_at_the_end.share_with(0) >= 0.9, "{}", apart_only_at_the_end.share_with(0));
}

#[test]
fn a_host_that_changed_between_the_rounds_widens_the_intervals() {
    // By 10 %, for one algorithm only; the truth is what lies between.
    let changed = Host { rounds: 0.1, ..USUAL };
    for exponent in [1.0, 0.1] {
        let ratio = crossing(1000.0, exponent);
        let still = Trials::new(&ratio, USUAL, Second::Crossovers, 200);
        let moved = Trials::new(&ratio, changed, Second::Crossovers, 200);
        assert!(moved.coverage(&[1000.0]) >= 0.85, "{exponent}: {}", moved.coverage(&[1000.0]));
        assert!(moved.width(&[1000.0]) > 1.5 * still.width(&[1000.0]));
        assert!(moved.share_with(1) >= 0.98, "{exponent}: {}", moved.share_with(1));
    }
}

#[test]
fn points_that_agree_give_narrower_intervals() {
    let quiet = Trials::new(&crossing(1000.0, 1.0), Host { points: 0.0, ..USUAL }, Second::Crossovers, 200);
    let usual = Trials::new(&crossing(1000.0, 1.0), USUAL, Second::Crossovers, 200);
    assert!(quiet.width(&[1000.0]) < 0.6 * usual.width(&[1000.0]));
    assert!(COVERAGE.contains(&quiet.coverage(&[1000.0])), "{}", quiet.coverage(&[1000.0]));
}

#[test]
fn without_noise_the_crossing_is_exact_and_its_interval_too() {
    let sizes = [10_u32, 40, 160, 640, 2560];
    let samples: Vec<(Vec<u64>, Vec<u64>)> =
        sizes.iter().map(|&n| (vec![u64::from(n) * 1_000_000; 5], vec![320_000_000; 5])).collect();
    let points: Vec<PairedSamples<'_>> = sizes
        .iter()
        .zip(&samples)
        .map(|(&objects, (a, b))| PairedSamples { objects, first_ns: a, second_ns: b })
        .collect();
    let found = compare(&points).unwrap();
    let p = found.positions()[0];
    assert!((p.objects / 320.0 - 1.0).abs() < 1e-6 && p.high / p.low < 1.0 + 1e-6, "{p:?}");
}

#[test]
fn the_interval_of_a_given_crossover_ends_where_the_samples_tell() {
    let points = sweep(&crossing(1000.0, 1.0), USUAL, Second::Crossovers, 3);
    let comparison = PairedComparison::new(&paired(&points)).unwrap();
    let p = comparison.outcome().positions()[0];
    assert_eq!(comparison.interval(p.objects, true), Some((p.low, p.high)));
    // A crossover beside the crossing: from there over the crossing to its far end.
    assert_eq!(comparison.interval(200.0, true), Some((200.0, p.high)));
    let (low, high) = comparison.interval(5000.0, true).unwrap();
    assert!((low / p.low - 1.0).abs() < 1e-12 && high == 5000.0);
    // Of the other direction the samples show none: it holds what they leave open, or all up to the end.
    assert_eq!(comparison.interval(p.objects, false), Some((p.low, p.high)));
    let (low, high) = comparison.interval(300.0, false).unwrap();
    assert!((low / 10.0 - 1.0).abs() < 1e-9 && high == 300.0, "{low} to {high}");
    assert!(comparison.interval(9.0, true).is_none() && comparison.interval(2e6, true).is_none());
    assert!(comparison.interval(10.0, true).is_some() && comparison.interval(1e6, true).is_some());
}

#[test]
fn too_little_gives_none_and_anything_else_an_ordered_interval() {
    let empty = PairedSamples { objects: 10, first_ns: &[], second_ns: &[1] };
    assert_eq!(compare(&[empty; 5]), None);
    let mut points = sweep(&crossing(1000.0, 1.0), USUAL, Second::Nothing, 1);
    points.truncate(2);
    assert_eq!(compare(&paired(&points)), None);
    // Gaps, sizes side by side, single frames, values of any size, zeros, and no order at all.
    let mut random = Random::new(5);
    for _ in 0..300 {
        let count = 3 + (random.uniform() * 9.0) as usize;
        let mut samples = || {
            let frames = (random.uniform() * 4.0) as usize;
            (0..frames).map(|_| (random.uniform().powi(8) * 1e19) as u64).collect::<Vec<u64>>()
        };
        let lists: Vec<_> = (0..count).map(|_| (samples(), samples())).collect();
        let sizes: Vec<u32> = (0..count).map(|_| (random.uniform().powi(6) * f64::from(u32::MAX)) as u32).collect();
        let points: Vec<PairedSamples<'_>> = sizes
            .iter()
            .zip(&lists)
            .map(|(&objects, (a, b))| PairedSamples { objects, first_ns: a, second_ns: b })
            .collect();
        for p in compare(&points).iter().flat_map(PairedOutcome::positions) {
            assert!(p.low <= p.objects && p.objects <= p.high && p.low >= 0.99 && p.high < 4.4e9, "{p:?}");
        }
    }
}
