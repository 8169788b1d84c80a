use super::*;
use crate::synthetic::{Machine, gpu_truth, truth};
use sapwise::hardware::GpuParameterId;

fn profiles(machines: impl IntoIterator<Item = Machine>) -> Vec<Profile> {
    machines.into_iter().map(|m| Profile::of(&format!("{}.json", m.name), &m.report())).collect()
}

fn fitted(profiles: &[Profile]) -> (Vec<MethodModel>, Vec<String>) {
    let designs = Designs::new(profiles);
    let (models, notes) = designs.fit(&vec![true; profiles.len()]).unwrap();
    (models, [designs.notes.clone(), notes].concat())
}

/// The measured rows of a profile that belong to a model.
fn rows_of(profile: &Profile, method: &MethodModel) -> Vec<(AlgorithmId, Row)> {
    let rows = rows(profile, 0).into_iter().map(|r| (profile.id(r.algorithm).clone(), r));
    let own = |id: &AlgorithmId| id.method() == method.method && id.backend().class() == method.backend;
    rows.filter(|(id, r)| own(id) && !r.floor).collect()
}

#[test]
fn coefficients_are_recovered_from_six_machines_and_predict_the_seventh() {
    let all = profiles(Machine::family().into_iter().map(Machine::exact));
    let (models, notes) = fitted(&all[..6]);
    assert!(notes.is_empty() && models.len() == truth().len(), "{notes:?}");
    for truth in truth() {
        let found = models.iter().find(|m| m.method == truth.method).unwrap();
        for t in &truth.terms {
            let unit = found.terms.iter().find(|f| (f.term, f.scale) == (t.term, t.scale)).map_or(0.0, |f| f.unit);
            assert!((unit / t.unit - 1.0).abs() < 0.05, "{}: {t:?} became {unit}; {:?}", truth.method, found.terms);
        }
        assert!(found.spread_ln < 0.005, "{found:?}");
        for (id, row) in rows_of(&all[6], found) {
            let curve = found.curve(&all[6].hardware, id.backend()).unwrap();
            assert!((curve.cost_ns(&row.load) / row.ns - 1.0).abs() < 0.02, "{row:?}");
        }
    }
}

#[test]
fn coefficients_on_gpus_are_recovered_and_predict_the_machine_held_out() {
    let all = profiles(Machine::family_with_gpus().into_iter().map(Machine::exact));
    let (models, notes) = fitted(&all[..7]);
    assert!(notes.is_empty() && models.len() == truth().len() + gpu_truth().len(), "{notes:?}");
    for truth in gpu_truth() {
        let alike = |m: &&MethodModel| m.method == truth.method && m.backend == BackendClass::Gpu;
        let found = models.iter().find(alike).unwrap();
        assert_eq!((found.max_threads, &found.gpu_kinds[..]), (2, &[GpuKind::Discrete, GpuKind::Integrated][..]));
        for t in &truth.terms {
            let unit = found.terms.iter().find(|f| (f.term, f.scale) == (t.term, t.scale)).map_or(0.0, |f| f.unit);
            assert!((unit / t.unit - 1.0).abs() < 0.05, "{}: {t:?} became {unit}; {:?}", truth.method, found.terms);
        }
        assert!(found.spread_ln < 0.005, "{found:?}");
        let held = rows_of(&all[7], found);
        assert!(held.len() > 10);
        for (id, row) in held {
            let curve = found.curve(&all[7].hardware, id.backend()).unwrap();
            assert!((curve.cost_ns(&row.load) / row.ns - 1.0).abs() < 0.02, "{row:?}");
        }
    }
}

#[test]
fn one_machine_with_a_gpu_has_a_model_of_full_rank() {
    let all = profiles(Machine::family_with_gpus().into_iter().take(1));
    let (models, notes) = fitted(&all);
    assert!(notes.is_empty() && models.len() == truth().len() + gpu_truth().len(), "{notes:?}");
    for method in models {
        for (id, row) in rows_of(&all[0], &method) {
            let curve = method.curve(&all[0].hardware, id.backend()).unwrap();
            assert!((curve.cost_ns(&row.load) / row.ns).ln().abs() < 0.5, "{row:?}");
        }
    }
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
    assert!(notes.iter().all(|n| n.contains("dispatch_ns") && n.contains("gpu1")) && notes.len() == 3, "{notes:?}");
}

#[test]
fn the_residual_repairs_a_term_that_is_missing() {
    let mut all = profiles(Machine::family());
    for spot in all.iter_mut().flat_map(|p| &mut p.points) {
        let factor = (-0.02 * (f64::from(spot.load.objects).log2() - 11.0).powi(2)).exp();
        spot.medians.iter_mut().for_each(|m| m.1 *= factor);
    }
    let (models, _) = fitted(&all);
    let mut errors = (0.0, 0.0);
    for method in models {
        let bare = method.without_residual();
        let error = |m: &MethodModel| {
            let curve = |id: &AlgorithmId| m.curve(&all[3].hardware, id.backend()).unwrap();
            rows_of(&all[3], m).iter().map(|(id, r)| (curve(id).cost_ns(&r.load) / r.ns).ln().powi(2)).sum::<f64>()
        };
        errors = (errors.0 + error(&method), errors.1 + error(&bare));
    }
    assert!(errors.0 < 0.8 * errors.1, "{errors:?}");
}

#[test]
fn machines_count_the_same_however_many_profiles_they_have() {
    let mut all = profiles(Machine::family().into_iter().take(3));
    // The first machine comes with four profiles, one of them contended.
    for k in 0..3 {
        let mut twin = all[0].clone();
        twin.label = if k == 0 { Label::RealContended } else { Label::RealRestricted };
        all.push(twin);
    }
    let designs = Designs::new(&all);
    for design in &designs.methods {
        let rows: Vec<usize> = (0..design.rows.len()).collect();
        let weights = design.weights(&rows, &all, &designs.machines);
        let of = |chosen: &dyn Fn(usize) -> bool| -> f64 {
            rows.iter().filter(|k| chosen(design.rows[**k].profile)).map(|k| weights[*k]).sum()
        };
        for machine in 0..3 {
            assert!((of(&|p| designs.machines[p] == machine) - 1.0).abs() < 1e-9, "{}", design.name());
        }
        assert!((of(&|p| p == 3) / of(&|p| p == 0) - 0.25).abs() < 1e-9 && (of(&|p| p == 0) - 1.0 / 3.25).abs() < 1e-9);
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
