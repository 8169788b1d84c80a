pub(super) mod drawn;

use super::*;
use crate::tuning::{CostTerm, Term};

pub(super) fn cost(id: &str, terms: &[(Term, f64)], spread_ln: f64) -> AlgorithmCost {
    let terms = terms.iter().map(|&(term, unit_ns)| CostTerm { term, unit_ns }).collect();
    AlgorithmCost { algorithm: id.parse().unwrap(), revision: 1, curve: CostCurve::new(terms), spread_ln }
}

fn loads() -> Vec<Load> {
    (1..=20).map(|k| Load { objects: 1 << k, ..Load::default() }).collect()
}

#[test]
fn crossovers_lie_where_curves_cross_within_their_intervals() {
    // 0.5 n (n - 1) = 100 n at n = 201; 100 n = 20 n + 80 000 at n = 1000.
    let costs = vec![
        cost("brute@cpu1", &[(Term::AllPairs, 1.0)], 0.05),
        cost("sap@cpu1", &[(Term::Objects, 100.0)], 0.05),
        cost("grid-sap@cpu2", &[(Term::Call, 80_000.0), (Term::Objects, 20.0)], 0.05),
    ];
    let tuning = Tuning::from_costs(Source::Measured, "uniform", costs, &loads());
    assert_eq!(tuning.defect(), None);
    let names: Vec<String> = tuning.steps.iter().map(|s| s.algorithm.to_string()).collect();
    assert_eq!(names, ["brute@cpu1", "sap@cpu1", "grid-sap@cpu2"]);
    assert!((tuning.crossovers[0].objects / 201.0 - 1.0).abs() < 0.02, "{:?}", tuning.crossovers);
    assert!((tuning.crossovers[1].objects / 1000.0 - 1.0).abs() < 0.02, "{:?}", tuning.crossovers);
    let b = &tuning.crossovers[0];
    let (low, high) = b.interval().unwrap();
    assert!(low < 195.0 && high > 208.0 && low > 150.0 && high < 260.0, "{b:?}");
    assert_eq!(tuning.step(5).unwrap().algorithm.method(), "brute");
    assert_eq!(tuning.step(u32::MAX).unwrap().algorithm.method(), "grid-sap");
}

#[test]
fn for_running_gives_the_fields_of_a_tree_to_pair_cache() {
    let cost =
        |id: &str, call_ns: f64, unit_ns: f64| cost(id, &[(Term::Call, call_ns), (Term::Objects, unit_ns)], 0.05);
    let all = |with: &[&str]| {
        let mut costs = vec![cost("brute@cpu1", 0.0, 100.0), cost("bvh@cpu1", 8000.0, 20.0)];
        costs.push(cost("brute@cpu2", 2000.0, 50.0));
        costs.extend([cost("sap@cpu2", 40_000.0, 10.0), cost("bvh@gpu0", 1.0e6, 1.0)]);
        costs.extend(with.iter().map(|id| cost(id, 1.0e5, 19.0)));
        Tuning::from_costs(Source::Measured, "uniform", costs, &loads())
    };
    let tuning = all(&["pair-cache@cpu1", "pair-cache@cpu2"]).for_running();
    assert_eq!(tuning.defect(), None);
    let names: Vec<String> = tuning.steps.iter().map(|s| s.algorithm.to_string()).collect();
    assert_eq!(names, ["brute@cpu1", "pair-cache@cpu1", "pair-cache@cpu2", "bvh@gpu0"]);
    let sides = tuning.crossovers.iter().map(|c| [c.below.to_string(), c.above.to_string()]);
    assert!(sides.eq(names.windows(2).map(|pair| [pair[0].clone(), pair[1].clone()])), "{:?}", tuning.crossovers);
    assert_eq!(tuning.costs.len(), 4);
    // `pair-cache@cpu2` would replace others, and is missing.
    let whole = all(&["pair-cache@cpu1"]);
    assert_eq!(whole.clone().for_running(), whole);
}

/// Found by the fuzz target `files`: the written tuning could not be read again.
#[test]
fn a_slice_through_no_load_leaves_sound_tuning() {
    let costs =
        vec![cost("brute@cpu1", &[(Term::AllPairs, 1.0)], 0.05), cost("sap@cpu1", &[(Term::Objects, 100.0)], 0.05)];
    let tuning = Tuning::from_costs(Source::Predicted, "uniform", costs, &[]);
    assert!(tuning.steps.is_empty() && tuning.defect().is_none());
    assert_eq!(tuning.cheapest(&Load::of_objects(1000), |_| true).unwrap().0, 1);
    assert_eq!(Tuning { costs: Vec::new(), ..tuning }.defect(), Some(TuningError::NoFirstStep));
}

#[test]
fn an_interval_has_both_ends_or_none() {
    let costs =
        vec![cost("brute@cpu1", &[(Term::AllPairs, 1.0)], 0.05), cost("sap@cpu1", &[(Term::Objects, 100.0)], 0.05)];
    let tuning = Tuning::from_costs(Source::Measured, "uniform", costs, &loads());
    let defect = |low, high| {
        let mut tuning = tuning.clone();
        (tuning.crossovers[0].low, tuning.crossovers[0].high) = (low, high);
        tuning.defect()
    };
    assert_eq!((defect(None, None), defect(Some(0.0), Some(1e6))), (None, None));
    for (low, high) in [(Some(1.0), None), (None, Some(1e6)), (Some(300.0), Some(400.0)), (Some(-1.0), Some(1e6))] {
        assert!(defect(low, high).is_some(), "{low:?} {high:?}");
    }
}

#[test]
fn cheapest_is_one_of_the_usable() {
    let costs = vec![
        cost("a@cpu1", &[(Term::Call, 3.0)], 0.0),
        cost("b@cpu1", &[(Term::Call, 1.0)], 0.0),
        cost("c@cpu1", &[(Term::Call, 2.0)], 0.0),
    ];
    let tuning = Tuning::from_costs(Source::Measured, "uniform", costs, &loads());
    let load = Load::default();
    assert_eq!(tuning.cheapest(&load, |_| true), Some((1, 1.0)));
    assert_eq!(tuning.cheapest(&load, |k| k != 1), Some((2, 2.0)));
    assert_eq!(tuning.cheapest(&load, |_| false), None);
}

#[test]
fn the_usual_tuning_has_more_threads_for_more_objects() {
    let steps = |cores| -> Vec<(u32, String)> {
        let tuning = Tuning::usual(&Registry::with_cores(cores));
        assert_eq!(tuning.defect(), None);
        tuning.steps.iter().map(|s| (s.from_objects, s.algorithm.to_string())).collect()
    };
    let expected = |parallel: &[(u32, u32)]| -> Vec<(u32, String)> {
        let one = [(0, "brute@cpu1".to_owned()), (80, "pair-cache@cpu1".to_owned())];
        let several = parallel.iter().map(|&(from, threads)| (from, format!("pair-cache@cpu{threads}")));
        one.into_iter().chain(several.filter(|_| cfg!(feature = "parallel"))).collect()
    };
    assert_eq!(steps(1), expected(&[]));
    assert_eq!(steps(2), expected(&[(10_000, 2)]));
    assert_eq!(steps(6), expected(&[(10_000, 2), (40_000, 4), (90_000, 6)]));
    assert_eq!(steps(128), expected(&[(10_000, 2), (40_000, 4), (160_000, 8), (640_000, 16)]));
}

#[test]
fn hand_written_steps_are_checked() {
    let step = |from_objects, id: &str| Step { from_objects, algorithm: id.parse().unwrap() };
    assert!(Tuning::from_steps(vec![step(0, "brute@cpu1"), step(64, "grid-sap@cpu1")]).is_ok());
    assert!(Tuning::from_steps(vec![]).is_err());
    assert!(Tuning::from_steps(vec![step(5, "brute@cpu1")]).is_err());
    assert!(Tuning::from_steps(vec![step(0, "brute@cpu1"), step(0, "grid-sap@cpu1")]).is_err());
}
