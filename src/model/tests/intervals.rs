//! Intervals from folds that are written down, so that their ends are known.

use super::*;
use crate::json;

const ERROR: f64 = 0.2;

/// One that counts its objects and one that costs the same at any number of them: they cross at a thousand.
fn truth() -> Vec<MethodModel> {
    let of = |name: &str, term, unit| MethodModel {
        method: name.to_owned(),
        terms: vec![ModelTerm { term, scale: Scale::Cycle, unit }],
        ..method(BackendClass::Cpu, Scale::Cycle)
    };
    vec![of("sap", Term::Objects, 4.0), of("grid-sap", Term::Call, 4000.0)]
}

/// One machine left out, with the cost of `sap` higher by `shift` than in the model.
fn fold(shift: f64, error: f64) -> Fold {
    let role = |method: &str| Role { method: method.to_owned(), backend: BackendClass::Cpu, several: false };
    let errors = |method: &str, against: Vec<(u32, u32, LnErrors)>| RoleErrors {
        role: role(method),
        machines: 1,
        ln_errors: [2.0 * error; QUANTILES.len()],
        against,
    };
    let method = |m: MethodModel, factor: f64| FoldMethod {
        method: m.method,
        backend: m.backend,
        objects: (m.min_objects, m.max_objects),
        terms: m.terms.iter().map(|t| (t.term, t.scale, t.unit * factor)).collect(),
        otherwise: Vec::new(),
        intercept: 0.0,
        slopes: Vec::new(),
    };
    let [sweep, strips] = <[MethodModel; 2]>::try_from(truth()).unwrap();
    Fold {
        machines: 1,
        methods: vec![method(sweep, shift.exp()), method(strips, 1.0)],
        errors: vec![errors("sap", vec![(1, 1, [error; QUANTILES.len()])]), errors("grid-sap", Vec::new())],
    }
}

/// A model with a fold for each shift.
fn with_folds(shifts: &[f64]) -> Model {
    let validation = Validation { physical_machines: shifts.len(), ..model(Vec::new()).validation };
    let folds = shifts.iter().map(|&shift| fold(shift, ERROR)).collect();
    Model { folds, validation, ..model(truth()) }
}

const SHIFTS: [f64; 10] = [-0.1, -0.08, -0.05, 0.0, 0.0, 0.01, 0.02, 0.05, 0.1, 0.15];

fn machine() -> Hardware {
    Hardware {
        parameters: parameters(&[
            (parameter::USABLE_CORES, 1.0),
            (parameter::CLOCK_MEASURED_GHZ, 4.0),
            (parameter::CACHE_LLC_BYTES, 3e7),
        ]),
        ..hardware()
    }
}

fn prediction(model: &Model) -> Prediction {
    model.predict(&machine(), &ids(&["sap@cpu1", "grid-sap@cpu1"])).unwrap()
}

fn tuning(model: &Model) -> crate::Tuning {
    let loads: Vec<Load> = (1..=20).map(|k| Load { objects: 1 << k, ..Load::default() }).collect();
    prediction(model).tuning("uniform", &loads)
}

fn border(model: &Model) -> (f64, Option<(f64, f64)>) {
    let tuning = tuning(model);
    assert_eq!((tuning.defect(), tuning.crossovers.len()), (None, 1));
    (tuning.crossovers[0].objects, tuning.crossovers[0].interval())
}

#[test]
fn a_border_ends_where_no_machine_would_turn_it() {
    let (objects, interval) = border(&with_folds(&SHIFTS));
    let (low, high) = interval.unwrap();
    assert!((objects / 1000.0 - 1.0).abs() < 0.005, "{objects}");
    // Of ten machines all must agree: the dearest sweep crosses first, the cheapest last.
    let expected = (1000.0 * (-0.15 - ERROR).exp(), 1000.0 * (0.1 + ERROR).exp());
    assert!(
        (low / expected.0 - 1.0).abs() < 0.015 && (high / expected.1 - 1.0).abs() < 0.015,
        "{low} to {high}, {expected:?}"
    );
    // Of thirty, 27.9 must: two of the three that are far off may disagree.
    let (low, high) = border(&with_folds(&[SHIFTS, SHIFTS, SHIFTS].concat())).1.unwrap();
    let expected = (1000.0 * (-0.15 - ERROR).exp(), 1000.0 * (0.1 + ERROR).exp());
    assert!(
        (low / expected.0 - 1.0).abs() < 0.015 && (high / expected.1 - 1.0).abs() < 0.015,
        "{low} to {high}, {expected:?}"
    );
    // One far off among forty others changes nothing, one among nine everything.
    let mut others = vec![0.0; 40];
    let without = border(&with_folds(&others)).1.unwrap();
    others[0] = 3.0;
    assert_eq!(border(&with_folds(&others)).1.unwrap(), without);
    assert!(border(&with_folds(&others[..10])).1.unwrap().0 < 0.1 * without.0);
}

#[test]
fn the_errors_of_a_machine_count_by_how_many_of_its_points_have_them() {
    let mut model = with_folds(&[0.0; 10]);
    let id = |text: &str| text.parse::<AlgorithmId>().unwrap();
    let load = Load { objects: 1000, ..Load::default() };
    let end = |model: &Model| prediction(model).interval_ns(&id("sap@cpu1"), &load).unwrap();
    let (low, high) = end(&model);
    assert!(
        (low / (1000.0 * (-2.0 * ERROR).exp()) - 1.0).abs() < 1e-9
            && (high / (1000.0 * (2.0 * ERROR).exp()) - 1.0).abs() < 1e-9
    );
    // 9.9 of ten machines must lie within: 0.9 of the points of one whose other points are farther off.
    model.folds[3].errors[0].ln_errors = [0.1, 0.1, 0.1, 0.1, 0.7, 1.0, 1.0, 3.0];
    let (low, high) = end(&model);
    assert!(
        (high / (1000.0 * 0.7_f64.exp()) - 1.0).abs() < 1e-9 && (low / (1000.0 * (-0.7_f64).exp()) - 1.0).abs() < 1e-9,
        "{low} {high}"
    );
    assert_eq!(prediction(&model).interval_ns(&id("brute@cpu1"), &load), None);
}

#[test]
fn fewer_than_ten_machines_claim_no_interval_and_say_so() {
    let model = with_folds(&SHIFTS[..9]);
    assert_eq!(border(&model).1, None);
    let basis = tuning(&model).interval_basis;
    assert!(
        basis.contains("no interval can be claimed") && basis.contains("9 physical machines") && basis.contains("takes 10"),
        "{basis}"
    );
    let load = Load { objects: 1000, ..Load::default() };
    assert_eq!(prediction(&model).interval_ns(&"sap@cpu1".parse().unwrap(), &load), None);
    // Ten machines, of which nine timed both.
    let mut model = with_folds(&SHIFTS);
    model.folds[0].errors[0].against.clear();
    assert_eq!(border(&model).1, None);
    let basis = tuning(&model).interval_basis;
    assert!(basis.contains("jackknife+ from 10 physical machines") && basis.contains("1 of 1 borders have none"), "{basis}");
}

#[test]
fn a_model_from_before_there_were_folds_is_read_and_claims_no_interval() {
    let mut model = json::model(include_str!("../../../tests/fixtures/model-1.json")).unwrap();
    assert!(model.folds.is_empty() && model.clouds.is_empty());
    model.methods = truth();
    for (machines, text) in [(1, "1 physical machine,"), (12, "keeps no folds; train it again")] {
        model.validation.physical_machines = machines;
        assert_eq!(border(&model).1, None);
        assert!(tuning(&model).interval_basis.contains(text), "{}", tuning(&model).interval_basis);
    }
}

#[test]
fn outside_the_cloud_the_interval_widens_by_the_ratio_of_the_distances() {
    let mut model = with_folds(&[0.0; 10]);
    let (low, high) = border(&model).1.unwrap();
    let mut cloud = extrapolation::cloud();
    // The clock alone, four deviations from the mean where the farthest machine of the training was two.
    cloud.parameters = vec![CloudParameter {
        name: parameter::CLOCK_MEASURED_GHZ.to_owned(),
        mean_ln: 4.0_f64.ln() - 0.4,
        deviation_ln: 0.1,
    }];
    cloud.inverse = vec![vec![1.0]];
    model.clouds = vec![cloud];
    let (wide_low, wide_high) = border(&model).1.unwrap();
    for (wide, narrow) in [(wide_low, low), (wide_high, high)] {
        assert!(((wide / 1000.0).ln() / (narrow / 1000.0).ln() / 2.0 - 1.0).abs() < 0.06, "{wide} {narrow}");
    }
    assert!(tuning(&model).interval_basis.contains("2.0 times as large"));
    // Nearer than the farthest nothing is narrower.
    model.clouds[0].parameters[0].mean_ln = 4.0_f64.ln();
    assert_eq!(border(&model).1.unwrap(), (low, high));
}

#[test]
fn folds_are_written_one_a_line_and_read_back() {
    let mut model = with_folds(&SHIFTS);
    model.clouds = vec![extrapolation::cloud()];
    let text = json::write_model(&model).unwrap();
    assert_eq!(json::model(&text).unwrap(), model);
    assert_eq!(text.lines().filter(|l| l.starts_with("    {\"machines\"")).count(), 10);
    (model.folds, model.clouds) = (Vec::new(), Vec::new());
    assert_eq!(json::write_model(&model).unwrap(), json::write(&model).unwrap());
}

#[test]
fn folds_that_can_not_be_are_refused() {
    let defect = |change: &dyn Fn(&mut Fold)| {
        let mut model = with_folds(&SHIFTS);
        change(&mut model.folds[2]);
        model.defect()
    };
    assert_eq!(defect(&|_| {}), None);
    assert!(defect(&|f| f.methods[0].terms[0].2 = -1.0).is_some());
    assert!(defect(&|f| f.methods[0].terms[0].1 = Scale::GpuDispatch).is_some());
    assert!(defect(&|f| f.methods[1].intercept = f64::NAN).is_some());
    assert!(defect(&|f| f.errors[0].ln_errors[0] = 9.0).is_some());
    assert!(defect(&|f| f.errors[0].against[0].0 = 7).is_some());
    assert!(defect(&|f| f.errors[0].machines = 2).is_some());
}
