//! Every report and model in the repository is sound, current and leads to a choice; damaged files are refused in words.

use sapwise::hardware::{GpuParameterId, ParameterId};
use sapwise::json::{self, Document};
use sapwise::report::Label;
use sapwise::{AlgorithmId, BackendClass, Model, Registry, Report};
use std::path::{Path, PathBuf};

/// The reports in `datasets/`, which the packed library does not hold.
fn reports() -> Vec<(PathBuf, Report)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("datasets");
    let Ok(entries) = std::fs::read_dir(&folder) else { return Vec::new() };
    let files = entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "json"));
    let reports: Vec<(PathBuf, Report)> =
        files.map(|p| (p.clone(), json::report(&std::fs::read_to_string(&p).unwrap()).unwrap())).collect();
    assert!(!reports.is_empty(), "no report in datasets/");
    reports
}

/// Our algorithms on a machine of that many cores, also those that this build lacks a feature for.
fn algorithms(cores: u32) -> Vec<(AlgorithmId, u32)> {
    Registry::with_cores(cores).entries().iter().map(|e| (e.id.clone(), e.revision)).collect()
}

#[test]
fn every_report_is_complete_and_its_label_is_true() {
    for (path, report) in reports() {
        let path = path.display();
        assert!(report.provenance.optimised, "{path}");
        let names: Vec<&str> = report.hardware.parameters.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ParameterId::ALL, "{path}");
        let restricted = report.provenance.threads.is_some() || report.provenance.simd.is_some();
        let stronger = [Label::RealContended, Label::RealSoftwareGpu].contains(&report.label);
        assert_eq!(report.label == Label::RealRestricted, restricted && !stronger, "{path}");
        for gpu in &report.hardware.gpus {
            let names: Vec<&str> = gpu.parameters.iter().map(|p| p.name.as_str()).collect();
            assert_eq!(names, GpuParameterId::OF_ONE, "{path}: gpu{}", gpu.gpu.index);
        }
        for group in &report.hardware.gpu_groups {
            let names: Vec<&str> = group.parameters.iter().map(|p| p.name.as_str()).collect();
            assert_eq!(names, GpuParameterId::GROUP, "{path}: {:?}", group.gpus);
        }
        for point in &report.points {
            let samples: Vec<usize> =
                point.timings.iter().filter(|t| t.error.is_none()).map(|t| t.samples_ns.len()).collect();
            assert!(samples.iter().all(|n| (3..=40).contains(n)), "{path}: {samples:?} samples in {}", point.scenario);
        }
        // What was written is what is read, to the last digit.
        let text = json::write_report(&report).unwrap();
        assert!(json::report(&text).unwrap() == report, "{path}");
    }
}

#[test]
fn the_built_in_model_knows_every_method_of_this_build_and_predicts_for_every_report() {
    let model = Model::built_in().unwrap();
    #[cfg(feature = "gpu")]
    for (id, revision) in
        reports().iter().flat_map(|(_, r)| sapwise::gpu::algorithms(r.hardware.gpus.iter().map(|g| &g.gpu)))
    {
        assert_eq!(model.method(&id).map(|m| m.revision), Some(revision), "{id}: train on new reports");
    }
    for entry in Registry::with_cores(1).entries().iter().filter(|e| e.id.backend().class() == BackendClass::Cpu) {
        assert_eq!(model.method(&entry.id).map(|m| m.revision), Some(entry.revision), "{}: train on new reports", entry.id);
    }
    // Where other programs ran on the same cores, nothing is trained.
    let on_its_own = |r: &Report| r.label != Label::RealContended || r.provenance.threads.is_some();
    for (path, report) in reports().into_iter().filter(|(_, r)| on_its_own(r)) {
        let trained_on = model.trained_on.iter().any(|t| path.ends_with(&t.file));
        assert!(trained_on, "{} is not in the built-in model; train it again", path.display());
        let cores = report.hardware.value(ParameterId::UsableCores).unwrap() as u32;
        let algorithms = algorithms(cores);
        let prediction = model.predict(&report.hardware, &algorithms).unwrap();
        assert_eq!(prediction.costs.len(), algorithms.len(), "{}: {:?}", path.display(), prediction.warnings);
        assert!(!prediction.extrapolated, "{}: {:?}", path.display(), prediction.warnings);
    }
}

#[test]
fn a_machine_outside_the_training_is_told_and_a_missing_parameter_leaves_out_what_needs_it() {
    let model = Model::built_in().unwrap();
    let Some((_, mut report)) = reports().into_iter().find(|(_, r)| r.label == Label::RealFull) else { return };
    let algorithms = algorithms(2);
    let set = |report: &mut Report, name: &str, value: Option<f64>| {
        report.hardware.parameters.iter_mut().find(|p| p.name == name).unwrap().value = value;
    };
    set(&mut report, ParameterId::ForkJoinColdNs, None);
    let prediction = model.predict(&report.hardware, &algorithms).unwrap();
    assert!(prediction.costs.iter().all(|c| c.algorithm.threads() == 1));
    assert!(prediction.warnings.iter().any(|w| w.contains(ParameterId::ForkJoinColdNs)), "{:?}", prediction.warnings);
    set(&mut report, ParameterId::ClockMeasuredGhz, Some(9.0));
    assert!(model.predict(&report.hardware, &algorithms).unwrap().extrapolated);
    let other_revision: Vec<_> = algorithms.iter().map(|(id, revision)| (id.clone(), revision + 1)).collect();
    let error = model.predict(&report.hardware, &other_revision).unwrap_err();
    assert!(error.contains("train on new reports"), "{error}");
    set(&mut report, ParameterId::ClockMeasuredGhz, Some(4500.0));
    let error = model.predict(&report.hardware, &algorithms).unwrap_err();
    assert!(error.contains("clock_measured_ghz is 4500"), "{error}");
}

/// Files as each schema version was first written. They are never changed: what was once written stays readable.
#[test]
fn every_schema_version_stays_readable() {
    assert!(matches!(json::read(include_str!("fixtures/report-1.json")), Ok(Document::Report(_))));
    let Ok(Document::Report(report)) = json::read(include_str!("fixtures/report-1-gpu.json")) else { panic!("no report") };
    assert_eq!((report.hardware.gpus.len(), report.hardware.gpu_groups.len()), (2, 1));
    assert_eq!(report.hardware.gpu(1).unwrap().value(GpuParameterId::DispatchNs), Some(2500.0));
    assert_eq!(report.hardware.gpu_group(&[0, 1]).unwrap().value(GpuParameterId::GroupUploadRatio), Some(1.5));
    let text = json::write_report(&report).unwrap();
    assert!(json::report(&text).unwrap() == *report);
    assert!(
        matches!(json::read(include_str!("fixtures/model-1.json")), Ok(Document::Model(m)) if m.methods.iter().all(|m| m.backend == BackendClass::Cpu))
    );
    let folds = include_str!("fixtures/model-1-folds.json");
    let Ok(Document::Model(model)) = json::read(folds) else { panic!("no model") };
    assert_eq!((model.folds.len(), model.clouds.len()), (2, 1));
    assert!(json::model(&json::write_model(&model).unwrap()).unwrap() == *model);
    assert!(json::read(&folds.replacen("[0.012,", "[0.9,", 1)).unwrap_err().to_string().contains("a fold: errors of"));
    let Ok(Document::Tuning(tuning)) = json::read(include_str!("fixtures/tuning-1.json")) else { panic!("no tuning") };
    let text = json::write(&tuning).unwrap();
    assert_eq!(json::tuning(&text).unwrap(), *tuning);
    let ranking = tuning.rank(&sapwise::Load { objects: 10, ..Default::default() }, |_| true).unwrap();
    assert_eq!(tuning.costs[ranking.best].algorithm.to_string(), "brute@cpu1");
}

#[test]
fn damaged_files_are_refused_with_the_place() {
    let whole = include_str!("../models/default.json");
    assert!(matches!(json::read(whole), Ok(Document::Model(_))));
    let refused = |text: &str| json::read(text).unwrap_err().to_string();
    assert!(refused(&whole[..whole.len() / 2]).contains("line"));
    assert!(refused("").contains("line"));
    assert!(refused(&whole.replace("model/1", "model/9")).contains("model/9"));
    assert!(refused(&whole.replacen("\"name\"", "\"nome\"", 1)).contains("nome"));
    assert!(refused(&whole.replacen("\"unit\": ", "\"unit\": -", 1)).contains("unit"));
    let nested = format!("{{\"schema\": \"model/1\", \"name\": {}{}}}", "[".repeat(10_000), "]".repeat(10_000));
    assert!(!refused(&nested).is_empty());
}
