//! The built-in model is current, stored files stay readable, and damaged and old files are refused.

use sapwise::Registry;
use sapwise::algorithm::{BackendClass, Entry, Load};
use sapwise_tune::{Hardware, Machine, Model, Parameter, ParameterId, json};
use serde_json::Value;
use std::sync::Arc;

#[test]
fn the_built_in_model_knows_every_method_of_this_build() {
    let model = Model::built_in().unwrap();
    let mut entries = Registry::with_cores(1).entries().to_vec();
    entries.retain(|e| e.id.backend().class() == BackendClass::Cpu);
    #[cfg(feature = "gpu")]
    {
        use sapwise_tune::{GpuIdentity, GpuKind};
        let gpus = [0, 1].map(|index| GpuIdentity::new(index, "made up", GpuKind::Software));
        entries.extend(sapwise_gpu::algorithms(&gpus));
    }
    for Entry { id, revision, .. } in entries {
        assert_eq!(model.method(&id).map(|m| m.revision), Some(revision), "{id}: train on new reports");
    }
}

/// Files as each schema version was first written. Nobody changes them.
#[test]
fn every_schema_version_stays_readable() {
    let model = json::model(include_str!("fixtures/model-5.json")).unwrap();
    assert!(model.methods.len() == 3 && model.methods.iter().all(|m| m.backend == BackendClass::Cpu));
    let written = json::Format::MODEL.write(&model).unwrap();
    assert!(json::model(&written).unwrap() == model);
    let tuning = json::tuning(include_str!("fixtures/tuning-3.json")).unwrap();
    assert_eq!(json::tuning(&json::write_tuning(&tuning).unwrap()).unwrap(), tuning);
    let (best, _) = tuning.cheapest(&Load::of_objects(10), |_| true).unwrap();
    assert_eq!(tuning.costs[best].algorithm.to_string(), "brute@cpu1");
}

#[test]
fn damaged_files_are_refused_with_the_place() {
    let whole = include_str!("../../../models/default.json");
    json::model(whole).unwrap();
    let nested = format!("{{\"schema\": \"model/5\", \"name\": {}{}}}", "[".repeat(10_000), "]".repeat(10_000));
    for (damaged, place) in [
        (&whole[..whole.len() / 2], "line"),
        ("", "line"),
        (&whole.replace("model/5", "model/9"), "model/9"),
        (&whole.replacen("\"method\"", "\"methode\"", 1), "methods[0]"),
        (&whole.replacen("\"unit\": ", "\"unit\": -", 1), "unit"),
        // Found by the fuzz target `files`: its costs were no numbers.
        (&whole.replacen("\"axis_candidates\": ", "\"axis_candidates\": -", 1), "places[0]"),
        (&nested, ""),
    ] {
        let error = json::model(damaged).unwrap_err().to_string();
        assert!(!error.is_empty() && error.contains(place), "{place}: {error}");
    }
}

/// A prediction of the built-in model for a machine of two cores, as a file.
fn tuning_file() -> Value {
    let figure = |id: ParameterId| match id {
        ParameterId::CacheLlcBytes => 3.2e7,
        ParameterId::ForkJoinColdNs => 60_000.0,
        ParameterId::UsableCores => 2.0,
        ParameterId::ScalingTwoThreadsRatio | ParameterId::ScalingAllThreadsRatio => 1.9,
        ParameterId::SimdLanes => 8.0,
        _ => 3.0,
    };
    let parameters = ParameterId::ALL.map(|id| Parameter::reported(id, figure(id), "test")).to_vec();
    let loads: Vec<Load> = (3..20).map(|k| Load::of_objects(1 << k)).collect();
    let hardware = Hardware::new(Machine::default(), parameters);
    let model = Model::built_in().unwrap();
    let prediction = model.predict(&hardware, Registry::with_cores(2).entries()).unwrap();
    serde_json::from_str(&json::write_tuning(&prediction.tuning("uniform", &loads)).unwrap()).unwrap()
}

#[test]
fn works_are_written_once_and_shared_again() {
    let file = tuning_file();
    let tuning = json::tuning(&file.to_string()).unwrap();
    assert!(file["works"].as_array().unwrap().len() < tuning.costs.len());
    let work = |id: &str| &tuning.costs.iter().find(|c| c.algorithm.to_string() == id).unwrap().curve.work;
    assert!(Arc::ptr_eq(work("pair-cache@cpu1"), work("pair-cache@cpu2")));
    let fallback = work("pair-cache@cpu1").fallback.as_ref().unwrap();
    assert!(Arc::ptr_eq(&fallback.work, work("bvh@cpu1")));
    assert_eq!(serde_json::from_str::<Value>(&json::write_tuning(&tuning).unwrap()).unwrap(), file);
}

#[test]
fn impossible_tunings_are_refused_by_name() {
    let refused = |text: &str, change: &dyn Fn(&mut Value)| {
        let mut file = tuning_file();
        change(&mut file);
        let error = json::tuning(&file.to_string()).unwrap_err().to_string();
        assert!(error.contains(text), "{text}: {error}");
        error
    };
    let cut = refused("there is no work", &|f| f["works"].as_array_mut().unwrap().truncate(1));
    assert!(cut.contains("@cpu"), "{cut}");
    refused("more weights than places", &|f| f["places"].as_array_mut().unwrap().truncate(3));
    refused("impossible weight", &|f| f["works"][0]["residual"][0] = 1e300.into());
    refused("stands there twice", &|f| {
        let first = f["costs"][0].clone();
        f["costs"].as_array_mut().unwrap().push(first);
    });
    refused("does not stand before it", &|f| {
        let last = f["works"].as_array().unwrap().len() - 1;
        f["works"][last]["fallback"] = serde_json::json!({ "work": last, "factor": 1.0 });
    });
    refused("helpers have fewer than two threads", &|f| {
        f["costs"][0]["helpers"] = serde_json::json!({
            "threads": 1, "call_ns": 0.0, "late_ns": 0.0, "speed_up": 1.0, "boxes_per_thread": 0
        });
    });
}
