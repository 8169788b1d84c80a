//! The built-in model is current, stored files stay readable, and damaged and old files are refused.

use sapwise::Registry;
use sapwise::algorithm::{BackendClass, Load};
use sapwise_tune::{Model, json};

#[test]
fn the_built_in_model_knows_every_method_of_this_build() {
    let model = Model::built_in().unwrap();
    for entry in Registry::with_cores(1).entries().iter().filter(|e| e.id.backend().class() == BackendClass::Cpu) {
        assert_eq!(
            model.method(&entry.id).map(|m| m.revision),
            Some(entry.revision),
            "{}: train on new reports",
            entry.id
        );
    }
    #[cfg(feature = "gpu")]
    {
        use sapwise::algorithm::Entry;
        use sapwise_tune::{GpuIdentity, GpuKind};
        let gpus = [0, 1].map(|index| GpuIdentity::new(index, "made up", GpuKind::Software));
        for Entry { id, revision, .. } in sapwise_gpu::algorithms(&gpus) {
            assert_eq!(model.method(&id).map(|m| m.revision), Some(revision), "{id}: train on new reports");
        }
    }
}

/// Files as each schema version was first written. Nobody changes them.
#[test]
fn every_schema_version_stays_readable() {
    let model = json::model(include_str!("fixtures/model-3.json")).unwrap();
    assert!(model.methods.len() == 3 && model.methods.iter().all(|m| m.backend == BackendClass::Cpu));
    let written = json::write_model(&model).unwrap();
    assert!(json::model(&written).unwrap() == model);
    let tuning = json::tuning(include_str!("fixtures/tuning-2.json")).unwrap();
    assert_eq!(json::tuning(&json::write_tuning(&tuning).unwrap()).unwrap(), tuning);
    let ranking = tuning.rank(&Load::of_objects(10), |_| true).unwrap();
    assert_eq!(tuning.costs[ranking.best].algorithm.to_string(), "brute@cpu1");
}

#[test]
fn damaged_files_are_refused_with_the_place() {
    let whole = include_str!("../../../models/default.json");
    json::model(whole).unwrap();
    let refused = |text: &str| json::model(text).unwrap_err().to_string();
    assert!(refused(&whole[..whole.len() / 2]).contains("line"));
    assert!(refused("").contains("line"));
    assert!(refused(&whole.replace("model/3", "model/9")).contains("model/9"));
    assert!(refused(&whole.replacen("\"method\"", "\"methode\"", 1)).contains("methods[0]"));
    assert!(refused(&whole.replacen("\"unit\": ", "\"unit\": -", 1)).contains("unit"));
    // Found by the fuzz target `files`: its costs were no numbers.
    assert!(refused(&whole.replacen("\"axis_candidates\": ", "\"axis_candidates\": -", 1)).contains("places[0]"));
    let nested = format!("{{\"schema\": \"model/3\", \"name\": {}{}}}", "[".repeat(10_000), "]".repeat(10_000));
    assert!(!refused(&nested).is_empty());
}

#[test]
fn old_files_are_refused_by_name() {
    let model = json::model("{\"schema\": \"model/1\"}").unwrap_err().to_string();
    let tuning = json::tuning("{\"schema\": \"fields/1\"}").unwrap_err().to_string();
    assert!(model.contains("\"model/1\"") && model.contains("`sapwise train REPORTS... --out MODEL.json`"), "{model}");
    assert!(tuning.contains("\"fields/1\"") && tuning.contains("`sapwise predict --out TUNING.json`"), "{tuning}");
}
