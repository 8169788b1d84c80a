//! The time of the policy over that of the best single candidate on a thousand made-up machines: after a stall, with
//! drifting costs, beside another program and with the tuning of another machine. No clock is read.

use super::super::policy::Policy;
use super::learning::{Chance, Truth, run};
use super::tuning;
use crate::stats::mean;
use std::ops::Range;

/// Predicted nanoseconds for each box.
const PREDICTED: [(&str, f64); 4] =
    [("pair-cache@cpu1", 100.0), ("pair-cache@cpu2", 62.0), ("brute@cpu1", 150.0), ("brute@cpu2", 95.0)];
const SEEDS: u64 = 1000;
const OBJECTS: u32 = 1000;
/// Standard deviations of the logarithms by which costs differ from the prediction: by the same factor for all of a
/// machine, and by one for each candidate.
const CLASS_LN: f64 = 0.4;
const MEASURED_LN: f64 = 0.05;
const ANOTHER_LN: f64 = 0.3;

/// Returns the time within a range of frames over that of the best single candidate, less 1, as a mean over all seeds.
/// `own_ln`: by how much costs differ from the prediction.
/// `disturb` returns the factor on the cost of a candidate on some threads in a frame, from a number of the seed.
fn mean_regret(range: Range<usize>, own_ln: f64, disturb: impl Fn(u32, usize, u64) -> f64 + Copy + 'static) -> f64 {
    let regrets = (0..SEEDS).map(|seed| {
        let mut chance = Chance(seed);
        let class = (CLASS_LN * chance.normal()).exp();
        let costs = PREDICTED.map(|(_, ns)| ns * class * (own_ln * chance.normal()).exp());
        let one = move |k: usize, at: usize| costs[k] * disturb(1 + k as u32 % 2, at, seed);
        // `pair-cache` on two threads runs on one if that is faster.
        let truth = move |k: usize, n: f64, at: usize| n * if k == 1 { one(0, at).min(one(1, at)) } else { one(k, at) };
        let truth: &Truth = &truth;
        let of = |k: usize| range.clone().map(|at| truth(k, f64::from(OBJECTS), at)).sum::<f64>();
        let best_ns = (0..costs.len()).map(of).fold(f64::INFINITY, f64::min);
        let costs = tuning(&PREDICTED.map(|(id, ns)| (id, 0.0, ns)));
        let mut policy = Policy::new(costs, &[Some(0), Some(0), None, None], &[true; 4]);
        let frames = run(&mut policy, 0..range.end, OBJECTS, truth);
        frames[range.clone()].iter().map(|f| f.real_ns).sum::<f64>() / best_ns - 1.0
    });
    mean(&regrets.collect::<Vec<_>>())
}

/// Returns a number from 0 to 1 that depends on seed and frame.
fn chance(at: usize, seed: u64) -> f64 {
    let mut chance = Chance(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ at as u64);
    chance.next();
    chance.next()
}

#[test]
fn over_a_thousand_seeds_the_policy_recovers_from_what_disturbs_it() {
    let calm = |_: u32, _: usize, _: u64| 1.0;
    let stall = |_: u32, at: usize, _: u64| if at == 300 { 50.0 } else { 1.0 };
    let drift = |_: u32, at: usize, seed: u64| (0.3 * (at as f64 / 60.0 + seed as f64).sin()).exp();
    let beside = |threads: u32, at: usize, seed: u64| match threads {
        2 if at >= 300 && chance(at, seed) < 0.25 => 5.0,
        _ => 1.0,
    };
    let cases = [
        ("measured tuning", mean_regret(0..600, MEASURED_LN, calm), 0.01),
        ("after a stall", mean_regret(301..600, MEASURED_LN, stall), 0.01),
        ("with a clock that drifts", mean_regret(0..600, MEASURED_LN, drift), 0.01),
        ("beside another program", mean_regret(600..1200, MEASURED_LN, beside), 0.01),
        ("another machine's tuning", mean_regret(300..900, ANOTHER_LN, calm), 0.04),
    ];
    for (what, regret, most) in cases {
        println!("{what}, {SEEDS} seeds: mean regret {:.2} %", 100.0 * regret);
        assert!((-1.0e-9..=most).contains(&regret), "{what}: {regret}");
    }
}
