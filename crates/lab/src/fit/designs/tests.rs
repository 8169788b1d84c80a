use super::*;
use crate::fit::rows::{Row, rows};
use crate::fit::weights::weights;
use crate::report::Label;
use crate::synthetic::{Machine, gpu_truth, profiles, truth};
use sapwise::AlgorithmId;
use sapwise::tuning::Term;
use sapwise_tune::hardware::{GpuParameterId, ParameterId};
use sapwise_tune::{GpuKind, Model};

fn fitted(profiles: &[Profile]) -> (Vec<MethodModel>, Vec<String>) {
    let (model, notes) = whole(profiles);
    (model.methods, notes)
}

fn whole(profiles: &[Profile]) -> (Model, Vec<String>) {
    let designs = Designs::new(profiles);
    let (methods, notes) = designs.fit(&vec![true; profiles.len()]).unwrap();
    let mut model = Model::new("test", methods, Vec::new());
    model.places = Arc::clone(&designs.basis.places);
    (model, [designs.notes, notes].concat())
}

/// Returns predicted over measured time for the measured rows of a profile.
fn ratios(model: &Model, profile: &Profile, of: impl Fn(&AlgorithmId) -> bool) -> Vec<f64> {
    let costs = model.predict(&profile.hardware, &profile.with_revisions(&profile.available())).unwrap().costs;
    let rows = rows(profile, 0, None).into_iter().filter(|r| !r.floor && of(profile.id(r.algorithm)));
    let ratio = |r: Row| {
        let cost = costs.iter().find(|c| c.algorithm == *profile.id(r.algorithm)).unwrap();
        cost.curve.cost_ns(&r.load) / r.ns
    };
    rows.map(ratio).collect()
}

fn physics(model: &Model) -> Model {
    let mut physics = model.clone();
    physics.methods.iter_mut().for_each(|m| *m = m.without_residual());
    physics
}

#[test]
fn coefficients_are_recovered_from_six_machines_and_predict_the_seventh() {
    let all = profiles(Machine::family().into_iter().map(Machine::exact));
    let (model, notes) = whole(&all[..6]);
    assert!(notes.is_empty() && model.methods.len() == truth().len(), "{notes:?}");
    for truth in truth() {
        let found = model.methods.iter().find(|m| m.method == truth.method).unwrap();
        // `sap` left the race before its boxes left the cache.
        for t in truth.terms.iter().filter(|t| truth.method != "sap" || t.term != Term::ColdObjects) {
            let unit = found.terms.iter().find(|f| (f.term, f.scale) == (t.term, t.scale)).map_or(0.0, |f| f.unit);
            assert!((unit / t.unit - 1.0).abs() < 0.05, "{}: {t:?} became {unit}; {:?}", truth.method, found.terms);
        }
        assert!(found.spread_ln < 0.005, "{found:?}");
        let (found, truth) = (found.helpers.unwrap(), truth.helpers.unwrap());
        let off = [found.late_share - truth.late_share, found.serial_share - truth.serial_share];
        assert!(off.iter().all(|o| o.abs() < 0.11), "{found:?}");
    }
    let off = ratios(&model, &all[6], |_| true);
    assert!(off.len() > 100 && off.iter().all(|r| r.ln().abs() < 0.1), "{off:?}");
}

#[test]
fn coefficients_on_gpus_are_recovered_and_predict_the_machine_held_out() {
    let all = profiles(Machine::family_with_gpus().into_iter().map(Machine::exact));
    let (model, notes) = whole(&all[..7]);
    assert!(notes.is_empty() && model.methods.len() == truth().len() + gpu_truth().len(), "{notes:?}");
    for truth in gpu_truth() {
        let alike = |m: &&MethodModel| m.method == truth.method && m.backend == BackendClass::Gpu;
        let found = model.methods.iter().find(alike).unwrap();
        assert_eq!((found.max_threads, &found.gpu_kinds[..]), (2, &[GpuKind::Discrete, GpuKind::Integrated][..]));
        for t in &truth.terms {
            let unit = found.terms.iter().find(|f| (f.term, f.scale) == (t.term, t.scale)).map_or(0.0, |f| f.unit);
            assert!((unit / t.unit - 1.0).abs() < 0.05, "{}: {t:?} became {unit}; {:?}", truth.method, found.terms);
        }
        assert!(found.spread_ln < 0.005 && found.helpers.is_none(), "{found:?}");
    }
    let off = ratios(&model, &all[7], |id| id.backend().class() == BackendClass::Gpu);
    assert!(off.len() > 30 && off.iter().all(|r| r.ln().abs() < 0.05), "{off:?}");
}

#[test]
fn one_machine_with_a_gpu_has_a_model_of_full_rank() {
    let all = profiles(Machine::family_with_gpus().into_iter().take(1));
    let (model, notes) = whole(&all);
    assert!(notes.is_empty() && model.methods.len() == truth().len() + gpu_truth().len(), "{notes:?}");
    let off = ratios(&model, &all[0], |_| true);
    assert!(off.iter().all(|r| r.ln().abs() < 0.5), "{off:?}");
}

#[test]
fn software_adapters_serve_only_where_there_is_no_real_one() {
    let mut all = profiles(Machine::family_with_gpus().into_iter().take(3));
    let software = |p: &mut Profile| p.hardware.gpus.iter_mut().for_each(|g| g.gpu.kind = GpuKind::Software);
    software(&mut all[0]);
    let kinds = |all: &[Profile]| {
        let (models, notes) = fitted(all);
        let told = notes.iter().any(|n| n.contains("software adapters are left out"));
        (models.into_iter().find(|m| m.backend == BackendClass::Gpu).unwrap().gpu_kinds, told)
    };
    let (found, told) = kinds(&all);
    assert!(told && !found.contains(&GpuKind::Software), "{found:?}");
    all.iter_mut().for_each(software);
    assert_eq!(kinds(&all), (vec![GpuKind::Software], false));
}

#[test]
fn a_gpu_that_lacks_a_parameter_costs_its_own_rows_only() {
    let mut all = profiles(Machine::family_with_gpus().into_iter().take(3));
    let gpu = &mut all[1].hardware.gpus[1];
    gpu.parameters.retain(|p| p.name != GpuParameterId::DispatchNs);
    let (models, notes) = fitted(&all);
    assert_eq!(models.len(), truth().len() + gpu_truth().len());
    let told = |n: &String| n.contains("dispatch_ns") && n.contains("gpu1");
    // Of each method once on the GPU alone and once on both.
    assert!(notes.len() == 2 * gpu_truth().len() && notes.iter().all(told), "{notes:?}");
}

#[test]
fn the_residual_repairs_a_term_that_is_missing() {
    let mut all = profiles(Machine::family());
    for spot in all.iter_mut().flat_map(|p| &mut p.points) {
        let factor = (-0.02 * (f64::from(spot.load.objects).log2() - 11.0).powi(2)).exp();
        spot.medians.iter_mut().for_each(|m| m.1 *= factor);
    }
    let (model, _) = whole(&all);
    let error = |m: &Model| ratios(m, &all[3], |_| true).iter().map(|r| r.ln().powi(2)).sum::<f64>();
    let (with, without) = (error(&model), error(&physics(&model)));
    assert!(with < 0.5 * without, "{with} {without}");
}

#[test]
fn a_scenario_that_is_left_out_is_not_looked_at() {
    let mut all = profiles(Machine::family().into_iter().take(3));
    let fit = |all: &[Profile]| Designs::without(all, Some("clustered")).fit(&[true; 3]).unwrap().0;
    let before = fit(&all);
    // All algorithms take 100 times as long there, so their ratios to the best, which are weights, stay.
    for spot in all.iter_mut().flat_map(|p| &mut p.points).filter(|s| s.scenario == "clustered") {
        spot.medians.iter_mut().for_each(|m| m.1 *= 100.0);
    }
    assert_eq!(before, fit(&all));
}

#[test]
fn machines_count_the_same_however_many_profiles_they_have() {
    let mut all = profiles(Machine::family().into_iter().take(3));
    // The first machine comes with four profiles.
    for _ in 0..3 {
        all.push(Profile { label: Label::RealRestricted, ..all[0].clone() });
    }
    let designs = Designs::new(&all);
    for design in &designs.methods {
        let rows: Vec<&Row> = design.rows.iter().collect();
        let weights = weights(&rows, &designs.machines);
        let of = |chosen: &dyn Fn(usize) -> bool| -> f64 {
            rows.iter().zip(&weights).filter(|(r, _)| chosen(r.profile)).map(|(_, w)| w).sum()
        };
        for machine in 0..3 {
            assert!((of(&|p| designs.machines[p] == machine) - 1.0).abs() < 1e-9, "{}", design.name());
        }
        assert!((of(&|p| p == 3) - 0.25).abs() < 1e-9);
    }
}

#[test]
fn machines_that_lack_a_parameter_are_told() {
    let mut all = profiles(Machine::family().into_iter().take(2));
    all[0].hardware.parameters.retain(|p| p.name != ParameterId::ForkJoinColdNs);
    let (models, notes) = fitted(&all);
    assert_eq!(models.len(), truth().len());
    assert!(notes.iter().any(|n| n.contains(ParameterId::ForkJoinColdNs.as_str())), "{notes:?}");
}
