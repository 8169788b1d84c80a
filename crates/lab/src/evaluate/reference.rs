//! Our fits held against those of SciPy, scikit-learn and NumPy on stored numbers: `tests/fixtures/fits.json`, which
//! `tools/reference/fits.py` writes.

use super::direct::Line;
use crate::fit::columns::Columns;
use crate::fit::load_residual::{self, Remainder};
use crate::fit::nnls::nnls;
use crate::fit::robust::{HUBER, Problem};
use ndarray::{Array1, Array2};
use sapwise::stats::{quantile, relative_iqr, robust_deviation};
use sapwise::{Load, Places, Residual};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Of numbers that both sides compute in double precision by a direct method on columns of length one, with a condition
/// below 1e4.
const DIRECT: f64 = 1e-9;
/// Of the bend of Huber's loss, as a share. SciPy's side ends when it moves by less than 1e-6, ours after fifteen rounds.
const BEND: f64 = 1e-5;
/// How much larger our error may be than the least that SciPy finds, as a share. Around a minimum it grows with the square
/// of what the units are off, times ten to a thousand in these problems, so this holds them to about 1e-5.
const MINIMUM: f64 = 1e-8;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Answers {
    made_by: String,
    versions: BTreeMap<String, String>,
    nnls: Vec<NonNegative>,
    residual: Vec<OverLoads>,
    least_squares: Vec<Ordinary>,
    robust: Vec<Robust>,
    quantiles: Vec<Quantiles>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NonNegative {
    name: String,
    a: Vec<Vec<f64>>,
    b: Vec<f64>,
    x: Vec<f64>,
    residual: f64,
    unique: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OverLoads {
    by_motion: bool,
    /// Objects, pairs, strip candidates, axis candidates, moved.
    loads: Vec<[f64; 5]>,
    ln: Vec<f64>,
    behind: Vec<f64>,
    at: Vec<[f64; 5]>,
    predictions: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Ordinary {
    x: Vec<Vec<f64>>,
    y: Vec<f64>,
    at: Vec<f64>,
    prediction: f64,
    leverages: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Robust {
    name: String,
    terms: Vec<Vec<f64>>,
    ns: Vec<f64>,
    weights: Vec<f64>,
    groups: Vec<usize>,
    bend: f64,
    units: Vec<f64>,
    cost: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Quantiles {
    samples: Vec<f64>,
    shares: Vec<f64>,
    values: Vec<f64>,
    relative_iqr: f64,
}

fn answers() -> Answers {
    serde_json::from_str(include_str!("../../tests/fixtures/fits.json"))
        .expect("fits.json is what tools/reference/fits.py writes")
}

fn matrix(rows: &[Vec<f64>]) -> Array2<f64> {
    Array2::from_shape_fn((rows.len(), rows[0].len()), |(i, j)| rows[i][j])
}

fn near(ours: f64, theirs: f64, tolerance: f64) -> bool {
    (ours - theirs).abs() <= tolerance * theirs.abs().max(1.0)
}

#[test]
fn the_numbers_say_where_they_come_from() {
    let answers = answers();
    assert_eq!(answers.made_by, "tools/reference/fits.py");
    for package in ["python", "numpy", "scipy", "sklearn"] {
        assert!(answers.versions.contains_key(package), "{package}");
    }
    let counts = [answers.nnls.len(), answers.residual.len(), answers.least_squares.len()];
    assert!(counts.iter().all(|&c| c >= 2) && answers.robust.len() >= 4 && answers.quantiles.len() >= 4);
}

/// Units differ by many orders of magnitude, so each is compared after its column has length one.
#[test]
fn non_negative_least_squares_agree_with_scipy() {
    for problem in answers().nnls {
        let (a, b) = (matrix(&problem.a), Array1::from(problem.b));
        let x = nnls(&a, &b);
        let size = b.dot(&b).sqrt();
        let left = &b - &a.dot(&x);
        assert!(near(left.dot(&left).sqrt() / size, problem.residual / size, DIRECT), "{}: {left}", problem.name);
        assert!(x.iter().all(|v| *v >= 0.0));
        if problem.unique {
            for (column, (ours, theirs)) in a.columns().into_iter().zip(x.iter().zip(&problem.x)) {
                let length = column.dot(&column).sqrt() / size;
                assert!(((ours - theirs) * length).abs() < DIRECT, "{}: {x} {:?}", problem.name, problem.x);
            }
        }
    }
}

/// Each place has a variance of its own with us, of a ten-thousandth.
#[test]
fn the_residual_over_the_load_agrees_with_scikit_learns_gaussian_process() {
    for problem in answers().residual {
        let load =
            |l: &[f64; 5]| Load::of_objects(l[0] as u32).with_pairs(l[1]).with_candidates(l[3], l[2]).with_moved(l[4]);
        let places = Arc::new(Places::new(problem.loads.iter().map(load).collect()));
        let remainder = |k: usize| Remainder {
            load: load(&problem.loads[k]),
            ln: problem.ln[k],
            behind: problem.behind[k],
            contended: false,
        };
        let remainders: Vec<Remainder> = (0..problem.loads.len()).map(remainder).collect();
        let weights = load_residual::weights(&places, &remainders, problem.by_motion).unwrap();
        let residual = Residual::new(places, weights, problem.by_motion);
        assert!(problem.at.len() >= 5);
        for (at, theirs) in problem.at.iter().zip(&problem.predictions) {
            let ours = residual.ln(&load(at));
            assert!((ours - theirs).abs() < 1e-3, "{at:?}: {ours} {theirs}");
        }
    }
}

#[test]
fn least_squares_and_leverages_agree_with_scikit_learn_and_numpy() {
    for problem in answers().least_squares {
        let table = matrix(&problem.x);
        let (line, far_rows) = Line::least_squares(&table, &problem.y).unwrap();
        assert_eq!(line.columns.kept.len(), 4);
        assert!(
            near(line.at(&problem.at), problem.prediction, DIRECT),
            "{} {}",
            line.at(&problem.at),
            problem.prediction
        );
        let columns = Columns::new(&table, &vec![1.0; problem.y.len()]);
        for (ours, theirs) in columns.leverages().iter().zip(&problem.leverages) {
            assert!(near(*ours, *theirs, DIRECT), "{ours} {theirs}");
        }
        let limit = 2.0 * 5.0 / problem.y.len() as f64;
        assert_eq!(far_rows, problem.leverages.iter().filter(|h| **h > limit).count());
    }
}

/// Half of Huber's loss of the logarithms of modelled over measured time, as SciPy takes it.
fn cost(problem: &Problem, bend: f64, units: &[f64]) -> f64 {
    let modelled = problem.terms.dot(&Array1::from(units.to_vec()));
    let row = |k: usize| {
        let off = (modelled[k] / problem.ns[k]).ln().abs();
        problem.weights[k] * if off <= bend { 0.5 * off * off } else { bend * (off - 0.5 * bend) }
    };
    (0..problem.ns.len()).map(row).sum()
}

#[test]
fn robust_units_are_at_the_minimum_that_scipy_finds() {
    for stored in answers().robust {
        let problem = Problem {
            terms: matrix(&stored.terms),
            floors: vec![false; stored.ns.len()],
            ns: stored.ns,
            weights: stored.weights,
            groups: stored.groups,
        };
        let units = problem.units();
        let modelled = problem.terms.dot(&Array1::from(units.clone()));
        let bend = HUBER
            * robust_deviation(&modelled.iter().zip(&problem.ns).map(|(m, t)| (m / t).ln()).collect::<Vec<_>>())
                .unwrap();
        assert!(near(bend / stored.bend, 1.0, BEND), "{}: {bend} {}", stored.name, stored.bend);
        let [ours, theirs] = [&units, &stored.units].map(|units| cost(&problem, stored.bend, units));
        assert!(near(theirs / stored.cost, 1.0, DIRECT), "{}: {theirs} {}", stored.name, stored.cost);
        let more = ours / stored.cost - 1.0;
        assert!(more <= MINIMUM, "{}: {more} {units:?} {:?}", stored.name, stored.units);
        assert!(more >= -MINIMUM, "{}: SciPy stopped early, by {more}", stored.name);
    }
}

#[test]
fn quantiles_agree_with_numpy() {
    for problem in answers().quantiles {
        for (share, theirs) in problem.shares.iter().zip(&problem.values) {
            let ours = quantile(&problem.samples, *share).unwrap();
            assert!((ours / theirs - 1.0).abs() < 1e-14, "{share}: {ours} {theirs}");
        }
        let ours = relative_iqr(&problem.samples).unwrap();
        assert!((ours / problem.relative_iqr - 1.0).abs() < 1e-12, "{ours} {}", problem.relative_iqr);
    }
}
