//! Simulated timings with known crossings: 5 % noise, one sample in twenty up to five times too slow.

use super::*;

struct Timings(Vec<(u32, Vec<u64>, Vec<u64>)>);

impl Timings {
    fn crossover(&self, seed: u64) -> Option<Crossover> {
        let points: Vec<Paired<'_>> =
            self.0.iter().map(|(objects, a, b)| Paired { objects: *objects, first_ns: a, second_ns: b }).collect();
        crossover(&points, seed)
    }
}

fn uniform(random: &mut SplitMix) -> f64 {
    (random.next() >> 11) as f64 / (1_u64 << 53) as f64
}

fn normal(random: &mut SplitMix) -> f64 {
    (0..12).map(|_| uniform(random)).sum::<f64>() - 6.0
}

fn disturbed(ns: f64, random: &mut SplitMix) -> u64 {
    let outlier = if uniform(random) < 0.05 { 1.0 + 4.0 * uniform(random) } else { 1.0 };
    (ns * (0.05 * normal(random)).exp() * outlier).round().max(1.0) as u64
}

/// 25 sizes from 16 to 65 536, half an octave apart.
fn timings(first: impl Fn(f64) -> f64, second: impl Fn(f64) -> f64, frames: usize, seed: u64) -> Timings {
    let mut random = SplitMix(seed);
    let sizes = (0..25).map(|k| 2.0_f64.powf(4.0 + 0.5 * f64::from(k)).round());
    let point = |n: f64| {
        let mut draw = |ns: f64| (0..frames).map(|_| disturbed(ns, &mut random)).collect::<Vec<u64>>();
        (n as u32, draw(first(n)), draw(second(n)))
    };
    Timings(sizes.map(point).collect())
}

fn octaves(a: f64, b: f64) -> f64 {
    (a / b).log2().abs()
}

/// Share of trials whose interval holds the truth, and the largest error in octaves.
fn trial(first: fn(f64) -> f64, second: fn(f64) -> f64, truth: f64) -> (f64, f64) {
    let (mut held, mut worst) = (0, 0.0_f64);
    for seed in 0..60 {
        let Some(Crossover::At(p)) = timings(first, second, 7, 1000 + seed).crossover(seed) else { continue };
        worst = worst.max(octaves(p.objects, truth));
        held += u32::from(p.low <= truth && truth <= p.high && p.first_below);
    }
    (f64::from(held) / 60.0, worst)
}

#[test]
fn a_steep_crossing_is_found_to_a_tenth_of_an_octave() {
    // 0.5 n^2 = 40 n + 6000 ... at n = 156.6.
    let (held, worst) = trial(|n| 0.5 * n * n, |n| 40.0 * n + 6000.0, 40.0 + (1600.0_f64 + 12_000.0).sqrt());
    assert!(worst <= 0.1, "{worst}");
    assert!(held >= 0.8, "{held}");
}

#[test]
fn a_shallow_crossing_lies_in_its_interval() {
    let (held, worst) = trial(|n| 100.0 * n.powf(1.1), |n| 100.0 * n * 1000.0_f64.powf(0.1), 1000.0);
    assert!(worst <= 1.0, "{worst}");
    assert!(held >= 0.8, "{held}");
}

#[test]
fn one_that_is_always_cheaper_is_told_with_its_side() {
    for seed in 0..30 {
        let clear = timings(|n| 20.0 * n, |n| 24.0 * n, 7, seed);
        assert_eq!(clear.crossover(seed), Some(Crossover::AlwaysFirst));
        let near = timings(|n| 21.0 * n, |n| 20.0 * n, 7, seed);
        assert_eq!(near.crossover(seed), Some(Crossover::AlwaysSecond));
    }
}

#[test]
fn equal_costs_seldom_cross() {
    let crossing = |seed: &u64| {
        let equal = timings(|n| 20.0 * n, |n| 20.0 * n, 7, *seed);
        equal.crossover(*seed).is_some_and(|c| !c.positions().is_empty())
    };
    let crossed = (0..60).filter(crossing).count();
    assert!(crossed <= 12, "{crossed}");
}

#[test]
fn several_crossings_are_all_found() {
    // The logarithm of the ratio is a parabola in log2 n with its roots at 2^7 and 2^13.
    let first = |n: f64| 1000.0 * n * (0.05 * (n.log2() - 7.0) * (n.log2() - 13.0)).exp();
    for seed in 0..30 {
        let Some(Crossover::Several(list)) = timings(first, |n| 1000.0 * n, 7, seed).crossover(seed) else {
            panic!("no several at seed {seed}")
        };
        assert_eq!(list.len(), 2, "{list:?}");
        assert!(octaves(list[0].objects, 128.0) < 0.3 && octaves(list[1].objects, 8192.0) < 0.3, "{list:?}");
        assert!(!list[0].first_below && list[1].first_below);
    }
}

#[test]
fn too_little_gives_none_and_order_does_not_matter() {
    let mut t = timings(|n| 0.5 * n * n, |n| 40.0 * n + 6000.0, 7, 1);
    let forward = t.crossover(5);
    t.0.reverse();
    assert_eq!(t.crossover(5), forward);
    t.0.truncate(2);
    assert_eq!(t.crossover(5), None);
    let empty = Paired { objects: 10, first_ns: &[], second_ns: &[1] };
    assert_eq!(crossover(&[empty; 5], 0), None);
}

#[test]
fn twenty_five_sizes_of_twenty_frames_take_milliseconds() {
    let t = timings(|n| 0.5 * n * n, |n| 40.0 * n + 6000.0, 20, 1);
    let fastest = (0..5)
        .map(|seed| {
            let start = std::time::Instant::now();
            assert!(t.crossover(seed).is_some());
            start.elapsed()
        })
        .min();
    assert!(fastest.is_some_and(|d| d.as_millis() < 50), "{fastest:?}");
}
