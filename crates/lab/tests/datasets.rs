//! Every report in the repository is sound and current, its label is true, and the built-in model predicts its
//! machine.

use sapwise::Registry;
use sapwise::algorithm::{Entry, Load};
use sapwise_lab::data::{host, read_reports};
use sapwise_lab::progress::Silent;
use sapwise_lab::read_model;
use sapwise_lab::report::{self, Label, Report};
use sapwise_tune::Model;
use sapwise_tune::hardware::{GpuParameterId, ParameterId};
use sapwise_tune::model::MethodModel;
use std::path::{Path, PathBuf};

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// The measured reports with their names.
fn reports() -> Vec<(String, Report)> {
    let mut reports = read_reports(&[repository("datasets")], &Silent).unwrap();
    reports.retain(|(_, report)| report.label != Label::Published);
    assert!(!reports.is_empty());
    reports
}

#[test]
fn every_report_is_complete_and_its_label_is_true() {
    for (path, report) in reports() {
        assert!(report.provenance.optimised, "{path}");
        // Names that no version measures any more are kept beside these.
        let known: Vec<ParameterId> = report.hardware.parameters.iter().filter_map(|p| p.name.parse().ok()).collect();
        assert_eq!(known, ParameterId::ALL, "{path}");
        let restricted = report.provenance.threads.is_some() || report.provenance.simd.is_some();
        let software = report.label == Label::RealSoftwareGpu;
        assert_eq!(report.label == Label::RealRestricted, restricted && !software, "{path}");
        for gpu in &report.hardware.gpus {
            let known: Vec<GpuParameterId> = gpu.parameters.iter().filter_map(|p| p.name.parse().ok()).collect();
            // Reports of the first version lack the last one.
            let (all, first) = (&GpuParameterId::OF_ONE[..], GpuParameterId::OF_ONE.split_last().unwrap().1);
            assert!(known == all || known == first, "{path}: gpu{}: {known:?}", gpu.gpu.index);
        }
        for group in &report.hardware.gpu_groups {
            let names: Vec<&str> = group.parameters.iter().map(|p| p.name.as_str()).collect();
            assert_eq!(names, GpuParameterId::GROUP.map(GpuParameterId::as_str), "{path}: {:?}", group.gpus);
        }
        for point in &report.points {
            let samples: Vec<usize> =
                point.timings.iter().filter(|t| t.error.is_none()).map(|t| t.samples_ns.len()).collect();
            assert!(samples.iter().all(|n| (3..=40).contains(n)), "{path}: {samples:?} samples in {}", point.scenario);
        }
        // A report reads back to the last digit.
        assert!(report::read(&report::write(&report).unwrap()).unwrap().value == report, "{path}");
    }
}

#[test]
fn the_built_in_model_predicts_for_every_report() {
    let (model, stored) = (Model::built_in().unwrap(), repository("models/default.json"));
    let training = read_model(&std::fs::read_to_string(stored).unwrap()).unwrap().training;
    let reports = reports();
    for trained_on in &training.trained_on {
        assert!(reports.iter().any(|(path, _)| *path == trained_on.file), "{} is gone", trained_on.file);
    }
    let cores = |report: &Report| report.hardware.value(ParameterId::UsableCores).unwrap() as u32;
    let is_known = |report: &Report| training.trained_on.iter().any(|t| t.host == host(&report.hardware));
    let most_known = reports.iter().map(|(_, r)| r).filter(|r| is_known(r)).map(cores).max().unwrap();
    for (path, report) in reports {
        let (cores, known) = (cores(&report), is_known(&report));
        let registry = Registry::with_cores(cores);
        let algorithms = registry.entries();
        let prediction = model.predict(&report.hardware, algorithms).unwrap();
        // A new method, or one whose revision has risen, waits for a model that knows it.
        let knows = |e: &&Entry| {
            let method = |m: &&MethodModel| m.method == e.id.method() && m.backend == e.id.backend().class();
            model.methods.iter().find(method).is_some_and(|m| m.revision == e.revision)
        };
        let expected = algorithms.iter().filter(knows).count();
        assert!(expected > 0 && prediction.costs.len() == expected, "{path}: {:?}", prediction.warnings);
        let trained = training.trained_on.iter().any(|t| t.file == path);
        assert!(!trained || !prediction.extrapolated, "{path}: {:?}", prediction.warnings);
        // More cores than it has seen lie outside of its ranges.
        assert!(known || cores <= most_known || prediction.extrapolated, "{path}");
        let (wider, extrapolated) = (prediction.wider.clone(), prediction.extrapolated);
        let loads: Vec<Load> = (4..20).map(|k| Load::of_objects(1 << k)).collect();
        for c in prediction.tuning("uniform", &loads).crossovers {
            let unknown = extrapolated || wider.contains(&c.below) || wider.contains(&c.above);
            assert_eq!(c.interval().is_none(), unknown, "{path}: {c:?}");
        }
    }
}
