use super::*;
use crate::belief::{Deviations, KnowledgeGradient, Part, width_correlation};
use sapwise::{AlgorithmId, CostCurve};

fn cost(id: &str, call_ns: f64) -> AlgorithmCost {
    let terms = vec![CostTerm { term: Term::Call, unit_ns: call_ns }, CostTerm { term: Term::Objects, unit_ns: 2.0 }];
    AlgorithmCost::new(id.parse().unwrap(), 1, CostCurve::new(terms), 0.3)
}

fn costs() -> Vec<AlgorithmCost> {
    [("brute@cpu1", 100.0), ("grid-sap@cpu1", 300.0), ("grid-sap@cpu2", 3e3), ("sap@cpu8", 9e3), ("grid-sap@gpu0", 1e5)]
        .map(|(id, ns)| cost(id, ns))
        .into()
}

/// Without factors on terms, which make costs bend: what follows from straight lines then holds to the last digits.
fn straight() -> Prior {
    let part = Part { constant_ln: 0.15, curve_ln: 0.15 };
    let parts = Deviations { shared: part, method: part, width: part, algorithm: part, term_ln: 0.0, ..Prior::ASSUMED.cpu };
    Prior { cpu: parts, gpu: parts }
}

fn load(objects: u32) -> Load {
    Load::of_objects(objects)
}

/// Algorithm, objects, real over predicted time, noise.
const OBSERVED: [(usize, u32, f64, f64); 9] = [
    (0, 10, 1.4, 0.02),
    (2, 1000, 0.7, 0.0),
    (1, 3000, 1.2, 0.1),
    (4, 100_000, 2.0, 0.01),
    (2, 1100, 0.72, 0.05),
    (3, 1_000_000, 0.9, 0.0),
    (3, 1_000_000, 0.95, 0.0),
    (1, 40_000_000, 1.3, 0.2),
    (0, 2, 1.5, 0.0),
];

fn observe(posterior: &mut Posterior, &(algorithm, objects, ratio, noise_ln): &(usize, u32, f64, f64)) {
    let ns = posterior.costs[algorithm].curve.cost_ns(&load(objects)) * ratio;
    assert!(posterior.observe(algorithm, &load(objects), ns, noise_ln));
}

/// Solves `a x = b` for each column of `b` by Gauss and Jordan; `a` is n x n.
fn solve(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = a.len();
    let mut rows: Vec<Vec<f64>> = a.iter().zip(b).map(|(a, b)| a.iter().chain(b).copied().collect()).collect();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| rows[i][k].abs().total_cmp(&rows[j][k].abs())).unwrap();
        rows.swap(k, pivot);
        let row = rows[k].iter().map(|v| v / rows[k][k]).collect::<Vec<f64>>();
        for other in rows.iter_mut() {
            let factor = other[k];
            other.iter_mut().zip(&row).for_each(|(o, r)| *o -= factor * r);
        }
        rows[k] = row;
    }
    rows.into_iter().map(|r| r[n..].to_vec()).collect()
}

/// Mean and covariance of all curves after `observed`, by one dense solution instead of one update after the other.
fn dense(before: &Posterior, observed: &[(usize, u32, f64, f64)]) -> (Vec<f64>, Vec<f64>) {
    let dimension = before.mean.len();
    let weights = |algorithm: usize, objects: u32| {
        let mut weights = vec![0.0; dimension];
        before.look(algorithm, &Counts::new(&load(objects))).1.weights().for_each(|(entry, weight)| weights[entry] = weight);
        weights
    };
    let design: Vec<Vec<f64>> = observed.iter().map(|o| weights(o.0, o.1)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let with: Vec<Vec<f64>> =
        design.iter().map(|h| before.covariance.chunks(dimension).map(|row| dot(row, h)).collect()).collect();
    let variance: Vec<Vec<f64>> = with
        .iter()
        .enumerate()
        .map(|(i, w)| {
            let noise = |j: usize| if i == j { before.noise(observed[i].0, observed[i].3) } else { 0.0 };
            design.iter().enumerate().map(|(j, h)| dot(w, h) + noise(j)).collect()
        })
        .collect();
    let surprises: Vec<Vec<f64>> = observed.iter().map(|o| vec![o.2.ln()]).collect();
    let weights = solve(&variance, &surprises);
    let mean = (0..dimension).map(|i| (0..observed.len()).map(|o| with[o][i] * weights[o][0]).sum()).collect();
    let explained = solve(&variance, &with);
    let covariance = (0..dimension * dimension).map(|at| {
        let (i, j) = (at / dimension, at % dimension);
        before.covariance[at] - (0..observed.len()).map(|o| with[o][i] * explained[o][j]).sum::<f64>()
    });
    (mean, covariance.collect())
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn updates_one_by_one_are_those_of_a_dense_gaussian_process() {
    let before = Posterior::new(costs(), &straight());
    let mut posterior = before.clone();
    OBSERVED.iter().for_each(|o| observe(&mut posterior, o));
    let (mean, covariance) = dense(&before, &OBSERVED);
    assert!(farthest(&mean, &posterior.mean) < 1e-9, "{}", farthest(&mean, &posterior.mean));
    assert!(farthest(&covariance, &posterior.covariance) < 1e-9, "{}", farthest(&covariance, &posterior.covariance));
    assert!(mean.iter().any(|m| m.abs() > 0.05));
}

#[test]
fn thousands_of_observations_leave_a_symmetric_matrix_without_a_negative_variance() {
    let mut prior = Prior::ASSUMED;
    (prior.cpu.noise_ln, prior.gpu.noise_ln) = (1e-3, 1e-3);
    let mut posterior = Posterior::new(costs(), &prior);
    let before = posterior.covariance.clone();
    for _ in 0..1000 {
        OBSERVED.iter().for_each(|o| observe(&mut posterior, o));
    }
    let dimension = posterior.mean.len();
    for i in 0..dimension {
        let variance = posterior.covariance[i * dimension + i];
        assert!(variance > -1e-12 && variance <= before[i * dimension + i] + 1e-12, "{i}: {variance}");
        for j in 0..i {
            assert_eq!(posterior.covariance[i * dimension + j].to_bits(), posterior.covariance[j * dimension + i].to_bits());
        }
    }
    posterior.forget(1.0);
    assert!(farthest(&before, &posterior.covariance) < 1e-12);
}

#[test]
fn an_observation_moves_relatives_in_the_order_of_their_nearness() {
    let mut posterior = Posterior::new(costs(), &Prior::ASSUMED);
    let objects = 1000;
    observe(&mut posterior, &(2, objects, 2.0, 0.0));
    let corrected = posterior.costs();
    let moved: Vec<f64> = (0..5)
        .map(|a| (corrected[a].curve.cost_ns(&load(objects)) / posterior.costs[a].curve.cost_ns(&load(objects))).ln())
        .collect();
    // Itself, its method alone, another method as wide, another method alone, another processor.
    assert!(moved[2] > 0.55 && moved[2] < 2.0_f64.ln(), "{moved:?}");
    assert!(moved[2] > moved[1] && moved[1] > moved[0] && moved[3] > moved[0] && moved[0] > 0.0, "{moved:?}");
    assert_eq!(moved[4], 0.0);
    // Three decades away less of it is left.
    let far = (corrected[2].curve.cost_ns(&load(1_000_000)) / posterior.costs[2].curve.cost_ns(&load(1_000_000))).ln();
    assert!(far > 0.0 && far < 0.75 * moved[2], "{far}");
    assert!(corrected[2].spread_ln < corrected[0].spread_ln && corrected[0].spread_ln < corrected[4].spread_ln);
    assert!(corrected.iter().all(|c| c.curve.defect().is_none()));
}

#[test]
fn the_joint_logarithms_are_those_of_the_corrected_costs() {
    let mut posterior = Posterior::new(costs(), &Prior::ASSUMED);
    OBSERVED.iter().for_each(|o| observe(&mut posterior, o));
    let corrected = posterior.costs();
    let mut joint = Joint::default();
    for objects in [1, 10, 777, 4096, 1_000_000, 50_000_000] {
        posterior.joint(&load(objects), &mut joint);
        for (a, cost) in corrected.iter().enumerate() {
            assert!((joint.mean_ln[a] - cost.curve.cost_ns(&load(objects)).ln()).abs() < 1e-9, "{a} at {objects}");
            for b in 0..corrected.len() {
                assert!((joint.covariance[a * 5 + b] - joint.covariance[b * 5 + a]).abs() < 1e-15);
            }
        }
    }
}

#[test]
fn times_that_can_not_be_teach_nothing() {
    let mut posterior = Posterior::new(costs(), &Prior::ASSUMED);
    let before = posterior.clone();
    for (ns, noise) in [(0.0, 0.0), (-1.0, 0.0), (f64::NAN, 0.0), (f64::INFINITY, 0.0), (100.0, f64::NAN)] {
        assert!(!posterior.observe(0, &load(10), ns, noise));
    }
    assert!(posterior.mean == before.mean && posterior.covariance == before.covariance);
    assert!(posterior.observe(0, &load(10), 1e300, 0.0));
    assert!(posterior.costs().iter().all(|c| c.curve.defect().is_none()));
}

#[test]
fn the_gain_of_an_observation_is_the_mean_fall_of_regret_over_what_it_may_say() {
    let mut posterior = Posterior::new(costs(), &straight());
    observe(&mut posterior, &OBSERVED[1]);
    let loads = [load(20), load(500), load(40_000)];
    let usable = [true, true, true, false, true];
    let mut gradient = KnowledgeGradient::new(&posterior, &loads, &usable);
    for algorithm in 0..5 {
        let gain = gradient.gain(&posterior, algorithm, &loads[1], 0.1);
        // A sum over the surprises, each taken in. What is expected before is the mean of what is expected after.
        let mut with = vec![0.0; posterior.mean.len()];
        let (_, slope) = posterior.look(algorithm, &Counts::new(&loads[1]));
        let deviation = posterior.covariances(&slope, 0.1, &mut with).sqrt();
        let step = 0.01;
        let mut fall = 0.0;
        for k in -600..=600 {
            let z = f64::from(k) * step;
            let mut after = posterior.clone();
            after.mean.iter_mut().zip(&with).for_each(|(mean, with)| *mean += z * with / deviation);
            let weight = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt() * step;
            for load in &loads {
                let least = |p: &Posterior| {
                    let of = |a: usize| p.look(a, &Counts::new(load)).0;
                    (0..5).filter(|&a| usable[a]).map(of).fold(f64::INFINITY, f64::min)
                };
                fall += weight * (least(&posterior) - least(&after)) / loads.len() as f64;
            }
        }
        assert!((gain - fall).abs() < 1e-5, "{algorithm}: {gain} {fall}");
        assert!(gain > 0.0 || algorithm == 4, "{algorithm}");
    }
}

#[test]
fn a_prior_that_can_not_be_is_told() {
    assert_eq!(Prior::ASSUMED.defect(), None);
    let with = |change: &dyn Fn(&mut Deviations)| {
        let mut prior = Prior::ASSUMED;
        change(&mut prior.gpu);
        prior.defect()
    };
    assert!(with(&|d| d.noise_ln = 0.0).is_some_and(|d| d.contains("GPU")));
    assert!(with(&|d| d.width.curve_ln = -0.1).is_some() && with(&|d| d.method.constant_ln = f64::NAN).is_some());
    assert!(with(&|d| d.length_octaves = 0.0).is_some() && with(&|d| d.shared.constant_ln = 6.0).is_some());
}

#[test]
fn widths_share_by_the_ratio_of_their_logarithms() {
    let of = |a: &str, b: &str| {
        let [a, b] = [a, b].map(|id| id.parse::<AlgorithmId>().unwrap());
        width_correlation(a.backend(), b.backend())
    };
    assert_eq!([of("a@cpu1", "b@cpu8"), of("a@gpu0", "a@gpu0"), of("a@cpu4", "b@cpu4")], [0.0, 0.0, 1.0]);
    assert!(of("a@cpu2", "a@cpu16") < of("a@cpu8", "a@cpu16"));
}

#[test]
fn what_is_learned_of_a_count_holds_for_loads_that_have_more_or_less_of_it() {
    let mut all = costs();
    all.truncate(2);
    for cost in &mut all {
        cost.curve.terms.push(CostTerm { term: Term::Pairs, unit_ns: 50.0 });
    }
    let mut posterior = Posterior::new(all, &Prior::ASSUMED);
    let with = |pairs: f64| load(1000).with_pairs(pairs);
    // Twice as long as predicted where there are pairs, as predicted where there are none.
    for _ in 0..20 {
        for (pairs, ratio) in [(0.0, 1.0), (10_000.0, 2.0)] {
            let ns = posterior.costs[1].curve.cost_ns(&with(pairs)) * ratio;
            assert!(posterior.observe(1, &with(pairs), ns, 0.0));
        }
    }
    let corrected = posterior.costs();
    let ratio =
        |a: usize, pairs: f64| corrected[a].curve.cost_ns(&with(pairs)) / posterior.costs[a].curve.cost_ns(&with(pairs));
    assert!(
        (ratio(1, 0.0) - 1.0).abs() < 0.1 && (ratio(1, 10_000.0) - 2.0).abs() < 0.2,
        "{} {}",
        ratio(1, 0.0),
        ratio(1, 1e4)
    );
    // Another method has a part of it.
    assert!(ratio(0, 10_000.0) > 1.2 && ratio(0, 10_000.0) < 0.95 * ratio(1, 10_000.0), "{}", ratio(0, 10_000.0));
    assert!(corrected.iter().all(|c| c.curve.defect().is_none()));
    let mut joint = Joint::default();
    posterior.joint(&with(300.0), &mut joint);
    assert!((joint.mean_ln[1] - corrected[1].curve.cost_ns(&with(300.0)).ln()).abs() < 1e-9);
}

#[test]
fn a_surprise_beyond_three_deviations_is_believed_step_by_step() {
    let moved = |ratio: f64, times: usize| {
        let mut posterior = Posterior::new(costs(), &straight());
        (0..times).for_each(|_| observe(&mut posterior, &(2, 1000, ratio, 0.0)));
        (posterior.costs()[2].curve.cost_ns(&load(1000)) / posterior.costs[2].curve.cost_ns(&load(1000))).ln()
    };
    // Four parts of 0.15 twice have a deviation of 0.42.
    assert!(moved(3.0, 1) > 0.95 * 3.0_f64.ln());
    assert!(moved(50.0, 1) < 1.3 && (moved(50.0, 1) - moved(500.0, 1)).abs() < 1e-12);
    assert!(moved(50.0, 20) > moved(50.0, 1) + 0.5);
}
