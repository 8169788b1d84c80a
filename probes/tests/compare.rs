//! `sapwise compare` as people and programs meet it, on reports of simulated machines.

mod common;

use common::{failure, sapwise, success};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// The reports of two simulated machines.
fn machines(folder: &Path) -> [Value; 2] {
    let out = folder.join("machines");
    let answer = success(sapwise().args(["simulate", "--machines", "2", "--json", "--out"]).arg(&out));
    let answer: Value = serde_json::from_str(&answer).unwrap();
    [0, 1].map(|k| {
        let path = answer["files"][k].as_str().unwrap();
        serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
    })
}

/// Writes the report as if the latency between cores had been this at all of its points.
fn write(folder: &Path, name: &str, report: &Value, core_to_core_ns: f64) -> PathBuf {
    let mut report = report.clone();
    for point in report["points"].as_array_mut().unwrap() {
        point["core_to_core_ns"] = json!([core_to_core_ns, core_to_core_ns]);
    }
    let path = folder.join(name);
    fs::write(&path, report.to_string()).unwrap();
    path
}

#[test]
fn compare_tells_how_well_reports_agree_and_refuses_what_can_not_be_compared() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let [machine, other] = machines(folder);
    // As if `pair-cache` had run elsewhere, three times as slow.
    let mut slower = machine.clone();
    for point in slower["points"].as_array_mut().unwrap() {
        for timing in point["timings"].as_array_mut().unwrap() {
            if timing["algorithm"].as_str().unwrap().starts_with("pair-cache@cpu") {
                let samples = timing["samples_ns"].as_array_mut().unwrap();
                samples.iter_mut().for_each(|ns| *ns = (ns.as_u64().unwrap() * 3).into());
            }
        }
    }
    let alike = [write(folder, "a.json", &machine, 23.0), write(folder, "b.json", &machine, 25.0)];
    let elsewhere = write(folder, "c.json", &slower, 170.0);
    let other = write(folder, "other.json", &other, 23.0);

    let json = |words: &[&str]| -> Value {
        let text = success(sapwise().args(["compare", "--json"]).args(words).args(&alike).arg(&elsewhere));
        serde_json::from_str(&text).unwrap()
    };
    let all = json(&[]);
    assert_eq!((&all["reports"], all["steadiness"].as_array().unwrap().len()), (&json!(3), 3));
    assert!(!all["parameters"].as_array().unwrap().is_empty(), "{all}");
    let lost = |answer: &Value, whose: &str| answer["losses"][whose].as_f64().unwrap();
    assert!(lost(&all, "others") > lost(&all, "own") + 0.01, "{}", all["losses"]);
    let steady = json(&["--steady"]);
    assert_eq!(steady["reports"], 2);
    assert!((lost(&steady, "others") - lost(&steady, "own")).abs() < 1e-12, "{}", steady["losses"]);
    assert!(
        steady["crossovers"].as_array().unwrap().iter().all(|b| b["largest_deviation"] == 0.0),
        "{}",
        steady["crossovers"]
    );

    let text = success(sapwise().arg("compare").args(&alike).arg(&elsewhere));
    for expected in [
        "3 reports of one machine",
        "latency between cores 23 to 170 ns",
        "bandwidth_one_thread_gb_per_s",
        "Mean regret",
        "brute@cpu1 to",
    ] {
        assert!(text.contains(expected), "{expected:?} is missing: {text}");
    }
    let text = success(sapwise().args(["compare", "--steady"]).args(&alike).arg(&elsewhere));
    assert!(text.starts_with("c.json is left out") && text.contains("2 reports of one machine"), "{text}");

    let refused = |paths: &[&PathBuf]| failure(sapwise().arg("compare").args(paths), 1);
    assert!(refused(&[&alike[0]]).contains("two or more"));
    let complaint = refused(&[&alike[0], &alike[1], &folder.join(".").join("a.json")]);
    assert!(complaint.contains("a.json is given twice"), "{complaint}");
    let complaint = refused(&[&alike[0], &other]);
    assert!(complaint.contains("other.json and a.json differ in the physical machine"), "{complaint}");
    assert!(refused(&[&alike[0], &folder.join("absent.json")]).contains("absent.json"));
    failure(sapwise().arg("compare"), 2);
}
