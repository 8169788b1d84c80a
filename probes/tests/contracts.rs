//! The JSON of `train`, `predict`, `run` and `study`, which other programs read.

mod common;

use common::{answer, failure, list, sapwise, small_report, write};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Stores the report with values at JSON pointers changed.
fn report(folder: &Path, name: &str, changes: &[(&str, Value)]) -> PathBuf {
    let mut report = small_report("a");
    for (pointer, value) in changes {
        *report.pointer_mut(pointer).unwrap() = value.clone();
    }
    write(folder, name, report.to_string())
}

fn assert_keys(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some_and(|v| !v.is_null()), "{key} is missing: {value}");
    }
}

fn assert_tuning(tuning: &Value, source: &str) {
    assert_keys(tuning, &["schema", "source", "extrapolated", "warnings", "scenario", "steps", "crossovers", "costs"]);
    assert!(tuning.get("model").is_some());
    assert_eq!((&tuning["schema"], &tuning["source"]), (&"tuning/3".into(), &source.into()));
    assert_eq!((&tuning["scenario"], &tuning["steps"][0]["from_objects"]), (&"uniform".into(), &0.into()));
    list(&tuning["steps"]).iter().for_each(|step| assert_keys(step, &["from_objects", "algorithm"]));
    for crossover in list(&tuning["crossovers"]) {
        assert_keys(crossover, &["below", "above", "objects"]);
        // An interval is claimed if the training held out two machines or more and this one is like them.
        let extrapolated = tuning["extrapolated"] == true;
        let claimed =
            crossover["low"].is_null() == crossover["high"].is_null() && (!extrapolated || crossover["low"].is_null());
        assert!(claimed && (source != "measured" || !crossover["low"].is_null()), "{crossover}");
    }
}

/// Trains on the report under the names of two machines.
fn train(folder: &Path) -> (PathBuf, Value) {
    let a = report(folder, "a.json", &[]);
    // One sample differs, so that it isn't taken for the same measurement.
    let slower = ("/points/0/timings/0/samples_ns/0", 123_456.into());
    let b = report(folder, "b.json", &[slower, ("/hardware/machine/physical_id", "00000000000000bb".into())]);
    let model = folder.join("model.json");
    let trained = answer(sapwise().arg("train").args([a, b]).arg("--json").arg("--out").arg(&model));
    (model, trained)
}

#[test]
fn train_and_predict_keep_their_contracts() {
    let folder = tempfile::tempdir().unwrap();
    let (model, trained) = train(folder.path());
    assert_keys(&trained, &["validation", "model", "notes"]);
    let validation = &trained["validation"];
    assert_eq!((&validation["physical_machines"], &validation["profiles"]), (&2.into(), &2.into()));
    let methods = list(&validation["methods"]);
    assert!(methods.len() >= 9, "{methods:?}");
    let figures = ["name", "mean_regret", "share_over_10_percent"];
    methods.iter().for_each(|m| assert_keys(m, &figures));

    let own = report(folder.path(), "own.json", &[]);
    let out = folder.path().join("tuning.json");
    let mut predict = sapwise();
    predict.arg("predict").arg("--report").arg(&own).arg("--model").arg(&model).arg("--json").arg("--out").arg(&out);
    let tuning = answer(&mut predict);
    assert_tuning(&tuning, "predicted");
    assert_eq!(tuning["model"], "model");
    assert_eq!(serde_json::from_str::<Value>(&fs::read_to_string(&out).unwrap()).unwrap(), tuning);
}

#[test]
fn a_measured_tuning_comes_from_the_report_alone() {
    let folder = tempfile::tempdir().unwrap();
    let own = report(folder.path(), "own.json", &[]);
    let measured = |words: &[&str]| {
        let mut predict = sapwise();
        predict.args(["predict", "--measured", "--report"]).arg(&own).args(words);
        predict
    };
    let tuning = answer(&mut measured(&["--json"]));
    assert_tuning(&tuning, "measured");
    assert_eq!(tuning["model"], Value::Null);
    let untimed = "pair-cache: left out, since the report has not timed it";
    assert!(tuning["warnings"].as_array().unwrap().contains(&untimed.into()), "{tuning}");
    failure(&mut measured(&["--scenario", "gravity"]), 1, &["gravity", "it holds: "]);
}

#[test]
fn run_keeps_its_contract() {
    let folder = tempfile::tempdir().unwrap();
    let elsewhere =
        report(folder.path(), "other.json", &[("/hardware/machine/physical_id", "00000000000000cc".into())]);
    let mut run = sapwise();
    run.args(["run", "fragmentation", "--objects", "300", "--frames", "30", "--repeats", "2", "--json", "--tuning"]);
    let told = answer(run.arg(&elsewhere));
    let keys = "scenario frames objects repeats seed interrupted source extrapolated warnings adaptive windows fixed \
                left_out best_fixed over_best_fixed over_windows switches";
    let keys: Vec<&str> = keys.split(' ').collect();
    assert_keys(&told, &keys);
    assert_eq!((&told["scenario"], &told["frames"]), (&"fragmentation".into(), &30.into()));
    assert_eq!(told["repeats"], 2);
    assert_eq!((&told["source"], &told["interrupted"]), (&"measured".into(), &false.into()));
    assert_keys(&told["objects"], &["min", "max"]);
    assert_keys(&told["adaptive"], &["total_ms", "median_ms", "p99_ms", "worst_ms"]);
    assert!(told["fixed"]["brute@cpu1"]["total_ms"].as_f64().unwrap() > 0.0, "{told}");
    assert_eq!(told["left_out"], json!({}));
    assert!(told["warnings"].to_string().contains("another machine"), "{told}");
}

#[test]
fn run_refuses_tunings_and_reports_of_other_revisions() {
    let folder = tempfile::tempdir().unwrap();
    let old = report(folder.path(), "old.json", &[("/algorithms/0/revision", 999_999.into())]);
    let own = report(folder.path(), "own.json", &[]);
    let mut tuning = answer(sapwise().args(["predict", "--measured", "--json", "--report"]).arg(own));
    tuning["costs"][0]["revision"] = 999_999.into();
    let stale = write(folder.path(), "stale.json", tuning.to_string());
    for (file, name) in [(&old, "old.json"), (&stale, "stale.json")] {
        let texts = [name, "brute", "999999", "probe again"];
        failure(sapwise().args(["run", "uniform", "--tuning"]).arg(file), 1, &texts);
    }
}

#[test]
fn the_card_of_the_built_in_model_is_the_one_that_training_writes() {
    let stored = sapwise_lab::StoredModel::built_in().unwrap();
    let written = sapwise_lab::model_card::page(&stored.model, &stored.training, &[]);
    let card = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../models/README.md")).unwrap();
    // The card holds the notes of a training, the model does not.
    let (page, _notes) = card.split_once("\n## Notes\n").unwrap();
    let differs = page.lines().zip(written.lines()).find(|(card, written)| card != written);
    assert!(page == written, "models/README.md differs: {differs:?}");
}

#[test]
fn a_study_has_a_page_with_figures_and_tidy_tables() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("study");
    let datasets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets");
    let reports = ["intel-xeon-16c/4t.json", "published"].map(|name| datasets.join(name));
    let answer = answer(sapwise().arg("study").args(&reports).arg("--json").arg("--out").arg(&out));
    assert_eq!((&answer["reports"], &answer["studied"], &answer["hosts"]), (&4.into(), &1.into(), &1.into()));
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    assert!(page.contains("Quadro FX 5800") && page.contains("4 threads") && !page.contains("Figure 9: no report"));
    let mut timings = csv::Reader::from_path(out.join("timings.csv")).unwrap();
    let rows: Vec<BTreeMap<String, String>> = timings.deserialize().map(Result::unwrap).collect();
    let is_own = |r: &&BTreeMap<String, String>| r["algorithm"] == "grid-sap@cpu4" && r["threads"] == "4";
    assert!(rows.iter().find(is_own).unwrap()["median_ns"].parse::<f64>().unwrap() > 0.0);
    // The folder is of this machine alone.
    assert!(!page.contains(folder.path().to_str().unwrap()));
}
