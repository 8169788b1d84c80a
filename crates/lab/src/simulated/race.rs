//! The sweep over a simulated machine: samples with noise, and a race that the hopeless leave.

use super::cost::Costs;
use super::loads::Loads;
use crate::report::{Point, Timing};
use crate::sweep::{Standing, median};
use sapwise::{AlgorithmId, Load};
use sapwise_scenes::{Random, Scenario};

/// Samples of a point in all, so that the report of a machine with many cores is no larger than that of others. As a real sweep
/// has them: its time is shared by the algorithms.
const SAMPLES: usize = 160;
/// Bounds of the frames of a point: the fewest that a real point of a quick sweep has, and half of the most.
const FRAMES: std::ops::RangeInclusive<usize> = 5..=20;
/// Nanoseconds of a tick of the clock.
const TICK_NS: f64 = 10.0;

/// Times the algorithms over all loads, scenario by scenario. `name` parts the noise of this machine from that of others.
pub(super) fn race(costs: &Costs<'_>, algorithms: &[AlgorithmId], loads: &Loads, seed: u64, name: &str) -> Vec<Point> {
    let mut random = Random::named(seed, &[name, "samples"]);
    let frames = (SAMPLES / algorithms.len().max(1)).clamp(*FRAMES.start(), *FRAMES.end());
    let mut points = Vec::new();
    for (scenario, loads) in &loads.0 {
        let mut standings = vec![Standing::default(); algorithms.len()];
        for load in loads {
            let racing = |k: &usize| !standings[*k].out;
            let known: Vec<(usize, f64)> = (0..algorithms.len())
                .filter(racing)
                .filter_map(|k| Some((k, costs.frame_ns(&algorithms[k], load)?)))
                .collect();
            let timings = samples(costs, &known, algorithms, frames, &mut random);
            let medians: Vec<f64> = timings.iter().filter_map(|t| median(&t.samples_ns)).collect();
            let best = medians.iter().copied().fold(f64::INFINITY, f64::min);
            for ((k, _), median) in known.iter().zip(medians) {
                standings[*k].judge(median / best, algorithms[*k].method(), load.objects);
            }
            points.push(point(*scenario, *load, timings, &mut random));
        }
    }
    points
}

/// The samples of those who are still in the race, a frame's disturbance being shared by all of them.
fn samples(
    costs: &Costs<'_>,
    known: &[(usize, f64)],
    algorithms: &[AlgorithmId],
    frames: usize,
    random: &mut Random,
) -> Vec<Timing> {
    let factors = costs.cpu();
    let of_frame: Vec<f64> = (0..frames).map(|_| random.log_normal(factors.noise / 2.0)).collect();
    let mut sample = |ns: f64, of_frame: f64| {
        let disturbed = random.uniform() < factors.outliers;
        // An interrupt, or another program for a while: by some microseconds and by up to a few times.
        let outlier = if disturbed { 4000.0 + ns * (random.normal().abs() * 0.7) } else { 0.0 };
        let ns = ns * of_frame * random.log_normal(factors.noise) + outlier;
        ((ns / TICK_NS).round() * TICK_NS).max(TICK_NS) as u64
    };
    let timing = |&(k, ns): &(usize, f64)| Timing {
        algorithm: algorithms[k].clone(),
        samples_ns: of_frame.iter().map(|&f| sample(ns, f)).collect(),
        error: None,
    };
    known.iter().map(timing).collect()
}

fn point(scenario: Scenario, load: Load, timings: Vec<Timing>, random: &mut Random) -> Point {
    Point {
        scenario: scenario.to_string(),
        load,
        pairs: load.pairs as u64,
        // No algorithm has run, so none has found pairs.
        fingerprint: "0".repeat(16),
        foreign_load: Some((random.uniform() * 3000.0).round() / 100_000.0),
        spoiled: 0,
        core_to_core_ns: None,
        timings,
    }
}
