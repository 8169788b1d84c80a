//! Predicted costs of one machine, corrected by its timings.
//!
//! The natural logarithm of measured over predicted time is a sum of parts. Algorithms share some: by class of
//! processor, by width, by method, and those of incremental algorithms. The rest is the algorithm's own: a constant
//! and a function of the load, a Gaussian process at the first places of the residuals. Every part has a normal prior
//! around zero, so that one ridge regression finds all of them.

use crate::data::Profile;
use crate::fit::load_residual::{Basis, NOISE_LN, noise_ln, places};
use crate::fit::rows::Row;
use crate::fit::terms::is_incremental;
use crate::text::position_or_push;
use linfa_linalg::cholesky::SolveC;
use ndarray::{Array1, Array2, ArrayView1, Axis, s};
use sapwise::algorithm::BackendClass;
use sapwise::internals::Residual;
use sapwise::tuning::AlgorithmCost;
use std::slice;
use std::sync::Arc;

/// Standard deviations of the parts before any timing, in natural logarithms: about the errors on held-out machines.
const CLASS_LN: f64 = 0.3;
const WIDTH_LN: f64 = 0.1;
const METHOD_LN: f64 = 0.1;
const INCREMENTAL_LN: f64 = 0.1;
/// The same for an algorithm's constant and for its function of the load.
const CONSTANT_LN: f64 = 0.05;
const CURVE_LN: f64 = 0.12;
/// Number of functions of the load of one algorithm. More follow the measured scenes more closely and others less.
const CURVE: usize = 6;
/// Weight of the assumed noise in a spread, as a number of timings.
const PRIOR: f64 = 8.0;
/// An error beyond this many standard deviations of its noise is clipped to that, in each of this many fits.
const REACH: f64 = 3.0;
const ROUNDS: usize = 4;

/// A part that algorithms share.
#[derive(Debug, PartialEq)]
enum Part<'a> {
    Class(BackendClass),
    Width(BackendClass, u32),
    Method(BackendClass, &'a str),
    Incremental,
}

impl Part<'_> {
    /// Returns the parts of a cost, each with its standard deviation.
    fn of(cost: &AlgorithmCost) -> impl Iterator<Item = (Part<'_>, f64)> {
        let (backend, method) = (cost.algorithm.backend(), cost.algorithm.method());
        let class = backend.class();
        let width = (backend.width() > 1).then(|| (Part::Width(class, backend.width()), WIDTH_LN));
        let incremental = is_incremental(method).then_some((Part::Incremental, INCREMENTAL_LN));
        let method = (Part::Method(class, method), METHOD_LN);
        [Some((Part::Class(class), CLASS_LN)), width, Some(method), incremental].into_iter().flatten()
    }
}

/// A timing of one algorithm.
struct Timing<'a> {
    /// Position among the costs.
    algorithm: usize,
    /// Values of the functions of the load.
    curve: ArrayView1<'a, f64>,
    /// Natural logarithm of measured over predicted time.
    ln: f64,
    /// One over the variance of its noise.
    precision: f64,
}

/// Returns the costs corrected by the timings of a profile. Each spread is that of the timings around the result.
pub(super) fn corrected(mut costs: Vec<AlgorithmCost>, profile: &Profile, rows: &[Row]) -> Vec<AlgorithmCost> {
    let profiles = slice::from_ref(profile);
    let known = costs.iter().find_map(residual).map(|r| Arc::clone(&r.places));
    let basis = Basis::new(known.unwrap_or_else(|| Arc::new(places(profiles, None))));
    let features = basis.features(profiles).remove(0);
    let curve = basis.places.loads().len().min(CURVE);
    let timing = |row: &Row| {
        let algorithm = costs.iter().position(|c| c.algorithm == *profile.id(row.algorithm))?;
        let of_load = &features[usize::from(by_motion(&costs[algorithm]))];
        let ln = (row.ns / costs[algorithm].curve.cost_ns(&row.load)).ln();
        let precision = noise_ln(row.behind).powi(-2);
        let curve = of_load.slice(s![row.spot as usize, ..curve]);
        ln.is_finite().then_some(Timing { algorithm, curve, ln, precision })
    };
    let timings: Vec<Timing<'_>> = rows.iter().filter(|r| !r.floor).filter_map(timing).collect();
    let (found, left) = Parts::new(&costs, curve).fit(&timings);
    for (k, (cost, (constant, curve))) in costs.iter_mut().zip(found).enumerate() {
        let by_motion = by_motion(cost);
        let none = || Residual::new(Arc::clone(&basis.places), Vec::new(), by_motion);
        let residual = cost.curve.residual.get_or_insert_with(none);
        let weights = basis.of_places(curve, by_motion);
        residual.constant += constant;
        residual.weights.resize(residual.weights.len().max(weights.len()), 0.0);
        residual.weights.iter_mut().zip(weights).for_each(|(sum, w)| *sum += w);
        let own = timings.iter().zip(&left).filter(|(t, _)| t.algorithm == k);
        let (count, sum) = own.fold((PRIOR, PRIOR), |(n, sum), (t, left)| (n + 1.0, sum + t.precision * left * left));
        cost.spread_ln = NOISE_LN * (sum / count).sqrt();
    }
    costs
}

fn residual(cost: &AlgorithmCost) -> Option<&Residual> {
    cost.curve.work.residual.as_ref().or(cost.curve.residual.as_ref())
}

fn by_motion(cost: &AlgorithmCost) -> bool {
    residual(cost).map_or_else(|| is_incremental(cost.algorithm.method()), |r| r.by_motion)
}

/// The correction of one cost: the natural logarithm of a factor, and the weights of the functions of the load.
type Correction = (f64, Vec<f64>);

/// The shared parts of some costs.
struct Parts<'a> {
    /// Each with its standard deviation.
    shared: Vec<(Part<'a>, f64)>,
    /// By cost: the positions of its shared parts.
    of_cost: Vec<Vec<usize>>,
    /// Number of functions of the load.
    curve: usize,
}

impl<'a> Parts<'a> {
    fn new(costs: &'a [AlgorithmCost], curve: usize) -> Self {
        let mut shared: Vec<(Part<'a>, f64)> = Vec::new();
        let mut position = |part| position_or_push(&mut shared, part);
        let of_cost = costs.iter().map(|cost| Part::of(cost).map(&mut position).collect()).collect();
        Self { shared, of_cost, curve }
    }

    /// Returns the position of an algorithm's constant, before its functions of the load.
    fn own(&self, algorithm: usize) -> usize {
        self.shared.len() + algorithm * (1 + self.curve)
    }

    /// Returns the position and the value of each part of a cost, whose weights have unit normal priors.
    fn features(&self, algorithm: usize, curve: ArrayView1<'_, f64>) -> Vec<(usize, f64)> {
        let own = self.own(algorithm);
        let shared = self.of_cost[algorithm].iter().map(|&k| (k, self.shared[k].1));
        let curve = curve.iter().enumerate().map(|(j, value)| (own + 1 + j, CURVE_LN * value));
        shared.chain([(own, CONSTANT_LN)]).chain(curve).collect()
    }

    /// Returns the correction of each cost, and the error of each timing that is left.
    fn fit(&self, timings: &[Timing<'_>]) -> (Vec<Correction>, Vec<f64>) {
        let size = self.own(self.of_cost.len());
        let features: Vec<_> = timings.iter().map(|t| self.features(t.algorithm, t.curve)).collect();
        let mut normal: Array2<f64> = Array2::eye(size);
        for (timing, features) in timings.iter().zip(&features) {
            for &(a, x) in features {
                features.iter().for_each(|&(b, y)| normal[[a, b]] += timing.precision * x * y);
            }
        }
        let mut targets: Vec<f64> = timings.iter().map(|t| t.ln).collect();
        let (mut weights, mut left) = (Array1::zeros(size), targets.clone());
        for _ in 0..ROUNDS {
            let mut right = Array2::zeros((size, 1));
            for ((timing, features), target) in timings.iter().zip(&features).zip(&targets) {
                features.iter().for_each(|&(a, x)| right[[a, 0]] += timing.precision * x * target);
            }
            weights = normal.clone().solvec(&right).expect("positive definite").remove_axis(Axis(1));
            for (k, (timing, features)) in timings.iter().zip(&features).enumerate() {
                let fitted: f64 = features.iter().map(|&(a, x)| x * weights[a]).sum();
                let reach = REACH / timing.precision.sqrt();
                left[k] = (timing.ln - fitted).clamp(-reach, reach);
                targets[k] = fitted + left[k];
            }
        }
        let found = |k: usize| {
            let none = Array1::zeros(self.curve);
            let constant = self.features(k, none.view()).iter().map(|&(a, x)| x * weights[a]).sum();
            let curve = weights.iter().skip(self.own(k) + 1).take(self.curve);
            (constant, curve.map(|w| CURVE_LN * w).collect())
        };
        ((0..self.of_cost.len()).map(found).collect(), left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;
    use sapwise::algorithm::Load;
    use sapwise::tuning::{CostCurve, CostTerm, Term};

    fn profile() -> Profile {
        Profile::of("", &Machine::family_with_gpus()[1].report())
    }

    /// Costs of all algorithms of a profile, 10 ns for each box.
    fn costs(profile: &Profile) -> Vec<AlgorithmCost> {
        let cost = |id| AlgorithmCost::new(id, 1, CostCurve::new(vec![CostTerm::new(Term::Objects, 10.0)]), 0.3);
        profile.algorithms.iter().map(|t| cost(t.id.clone())).collect()
    }

    fn position(profile: &Profile, id: &str) -> usize {
        profile.algorithms.iter().position(|t| t.id.to_string() == id).unwrap()
    }

    fn row(profile: &Profile, algorithm: usize, spot: usize, factor: f64) -> Row {
        let load = profile.points[spot].load;
        let ns = 10.0 * f64::from(load.objects) * factor;
        Row { profile: 0, algorithm: algorithm as u16, spot: spot as u32, load, ns, behind: 1.0, floor: false }
    }

    /// Returns the correction of each cost at a load, in natural logarithms.
    fn corrections(profile: &Profile, rows: &[Row], load: &Load) -> Vec<f64> {
        let corrected = corrected(costs(profile), profile, rows);
        assert!(corrected.iter().all(|c| c.curve.defect().is_none()));
        corrected.iter().map(|c| (c.curve.cost_ns(load) / (10.0 * f64::from(load.objects))).ln()).collect()
    }

    #[test]
    fn relatives_move_less_the_farther_they_are() {
        let profile = profile();
        let [one, two, other, gpu] =
            ["sap@cpu1", "sap@cpu2", "brute@cpu1", "grid-sap@gpu0"].map(|id| position(&profile, id));
        let moved = corrections(&profile, &[row(&profile, one, 3, 1.5)], &profile.points[3].load);
        assert!(moved[one] > moved[two] && moved[two] > moved[other] && moved[other] > 0.05, "{moved:?}");
        assert!((0.3..0.42).contains(&moved[one]) && moved[gpu] == 0.0, "{moved:?}");
    }

    #[test]
    fn many_timings_are_followed_but_not_a_disturbed_one() {
        let profile = profile();
        let one = position(&profile, "sap@cpu1");
        let factor = |k: usize| 0.7 * (0.2 * (f64::from(profile.points[k].load.objects).log2() / 4.0).sin()).exp();
        let mut rows: Vec<Row> = (0..profile.points.len()).map(|k| row(&profile, one, k, factor(k))).collect();
        rows[7].ns *= 1000.0;
        let spread = corrected(costs(&profile), &profile, &rows)[one].spread_ln;
        assert!((0.02..0.12).contains(&spread), "{spread}");
        for (k, spot) in profile.points.iter().enumerate() {
            let off = corrections(&profile, &rows, &spot.load)[one] - factor(k).ln();
            assert!(off.abs() < if k == 7 { 0.3 } else { 0.12 }, "{:?}: {off}", spot.load);
        }
    }

    #[test]
    fn impossible_times_correct_nothing() {
        let profile = profile();
        let rows = [f64::NAN, 0.0, -1.0, f64::INFINITY].map(|factor| row(&profile, 0, 3, factor));
        assert!(corrections(&profile, &rows, &profile.points[3].load).iter().all(|ln| *ln == 0.0));
    }
}
