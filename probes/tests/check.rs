//! `sapwise check` and `sapwise train` on sound and on damaged files.

mod common;

use common::{failure, sapwise, success};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// A report of a machine that there is not, with one point.
fn report() -> Value {
    let samples = |ns: u64| json!([ns, ns + 1, ns + 2]);
    json!({
        "schema": "report/1",
        "label": "simulated",
        "provenance": {
            "version": "0.1.0", "date": "2026-01-01", "command": "probe --seed 1", "seed": 1, "threads": null,
            "simd": null, "optimised": true, "seconds": 1.0
        },
        "hardware": {
            "machine": {
                "physical_id": "0000000000000000", "cpu": "none", "vendor": "none", "arch": "x86_64", "os": "linux",
                "simd": "portable", "hypervisor": "none"
            },
            "parameters": [{
                "name": "usable_cores", "value": 64.0, "dispersion": null, "samples": 1, "spoiled": 0,
                "foreign_load": null, "how": "reported", "source": "test"
            }]
        },
        "algorithms": [{"id": "brute@cpu1", "revision": revision()}, {"id": "brute@cpu64", "revision": revision()}],
        "points": [{
            "scenario": "uniform",
            "load": {"objects": 10, "axis_candidates": 4.0, "strip_candidates": 4.0, "pairs": 2.0, "moved": 1.0},
            "pairs": 2, "fingerprint": "00000000000000ff", "foreign_load": null, "spoiled": 0,
            "timings": [
                {"algorithm": "brute@cpu1", "samples_ns": samples(100), "error": null},
                {"algorithm": "brute@cpu64", "samples_ns": samples(9000), "error": null}
            ]
        }],
        "remarks": []
    })
}

/// Revision of the brute force in this build.
fn revision() -> u32 {
    let registry = sapwise::Registry::with_cores(1);
    registry.entries().iter().find(|e| e.id.method() == "brute").unwrap().revision
}

fn fields(steps: &Value) -> Value {
    json!({
        "schema": "fields/1", "source": "default", "model": null, "extrapolated": false, "warnings": [],
        "scenario": "uniform", "steps": steps, "crossovers": [], "interval_basis": "", "costs": []
    })
}

fn write(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, content).unwrap();
    path
}

/// Exit status and the findings, one for each file.
fn check(files: &[PathBuf]) -> (i32, Vec<Value>) {
    let ended = sapwise().args(["check", "--json"]).args(files).output().unwrap();
    let complaint = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(!complaint.contains("panicked"), "{complaint}");
    let answer: Value = serde_json::from_slice(&ended.stdout).unwrap();
    (ended.status.code().unwrap(), answer["files"].as_array().unwrap().clone())
}

#[test]
fn sound_files_pass() {
    let folder = tempfile::tempdir().unwrap();
    let report = write(folder.path(), "report.json", report().to_string());
    let steps = json!([{"from_objects": 0, "algorithm": "brute@cpu1"}]);
    let fields = write(folder.path(), "fields.json", fields(&steps).to_string());
    let (status, findings) = check(&[report, fields]);
    assert_eq!(status, 0, "{findings:?}");
    assert!(findings.iter().all(|f| f["sound"] == true && f["current"] == true), "{findings:?}");
    assert_eq!((&findings[0]["schema"], &findings[0]["applicable"]), (&"report/1".into(), &false.into()));
    assert_eq!((&findings[1]["schema"], &findings[1]["applicable"]), (&"fields/1".into(), &true.into()));
    assert!(findings[0]["notes"].to_string().contains("no evidence of accuracy"), "{findings:?}");
}

#[test]
fn stale_and_inapplicable_files_fail_and_say_which_algorithm() {
    let folder = tempfile::tempdir().unwrap();
    let mut old = report();
    for algorithm in old["algorithms"].as_array_mut().unwrap() {
        algorithm["revision"] = 999_999.into();
    }
    let old = write(folder.path(), "old.json", old.to_string());
    let steps = json!([
        {"from_objects": 0, "algorithm": "brute@cpu4096"}, {"from_objects": 9, "algorithm": "octree@cpu1"},
        {"from_objects": 99, "algorithm": "strips@gpu99"}
    ]);
    let elsewhere = write(folder.path(), "elsewhere.json", fields(&steps).to_string());
    let (status, findings) = check(&[old, elsewhere]);
    assert_eq!(status, 1);
    assert_eq!((&findings[0]["sound"], &findings[0]["current"]), (&true.into(), &false.into()));
    assert!(findings[0]["problems"].to_string().contains("brute has revision 999999"), "{findings:?}");
    assert_eq!(findings[1]["applicable"], false);
    for text in ["brute@cpu4096", "octree@cpu1", "strips@gpu99"] {
        assert!(findings[1]["problems"].to_string().contains(text), "{findings:?}");
    }
}

#[test]
fn damaged_files_are_told_with_their_place_and_do_not_hide_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str, content: &[u8]| write(folder.path(), name, content);
    let good = report().to_string();
    let with = |key: &str, value: Value| {
        let mut report = report();
        *report.pointer_mut(key).unwrap() = value;
        report.to_string()
    };
    let nested = "[".repeat(10_000) + &"]".repeat(10_000);
    let huge = fs::File::create(folder.path().join("huge.json")).unwrap();
    huge.set_len(65 << 20).unwrap();
    let cases: Vec<(PathBuf, &str)> = vec![
        (path("truncated.json", &good.as_bytes()[..good.len() / 2]), "line 1 column"),
        (path("empty.json", b""), "line 1 column 0"),
        (path("future.json", with("/schema", "report/2".into()).as_bytes()), "report/2"),
        (path("nested.json", nested.as_bytes()), "line 1 column"),
        (path("deep.json", format!("{{\"schema\": \"report/1\", \"x\": {nested}}}").as_bytes()), "line 1 column"),
        (path("unknown.json", good.replacen("\"label\"", "\"lable\"", 1).as_bytes()), "lable"),
        (path("zero.json", with("/points/0/timings/0/samples_ns/0", 0.into()).as_bytes()), "0 ns"),
        (path("negative.json", with("/points/0/load/pairs", (-1.0).into()).as_bytes()), "negative"),
        (path("nan.json", good.replacen("64.0", "NaN", 1).as_bytes()), "line 1 column"),
        (path("infinite.json", good.replacen("64.0", "1e999", 1).as_bytes()), "number out of range"),
        (path("latin1.json", b"{\n\"schema\": \"\xe9\"}"), "line 2"),
        (path("binary.json", &[0, 159, 146, 150]), "UTF-8"),
        (folder.path().join("huge.json"), "64 MiB"),
        (folder.path().to_path_buf(), "folder"),
        (folder.path().join("absent.json"), "absent.json"),
        (path("steps.json", fields(&json!([])).to_string().as_bytes()), "steps"),
    ];
    let last = path("good.json", good.as_bytes());
    let files: Vec<PathBuf> = cases.iter().map(|c| c.0.clone()).chain([last]).collect();
    let (status, findings) = check(&files);
    assert_eq!((status, findings.len()), (1, files.len()));
    for ((file, text), finding) in cases.iter().zip(&findings) {
        let problems = finding["problems"].to_string();
        assert!(finding["sound"] == false && problems.contains(text), "{}: {text} not in {problems}", file.display());
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        assert!(problems.contains(&name), "{name} not in {problems}");
    }
    assert_eq!(findings[files.len() - 1]["problems"], json!([]));
}

#[test]
fn train_refuses_what_is_no_report() {
    let folder = tempfile::tempdir().unwrap();
    let steps = json!([{"from_objects": 0, "algorithm": "brute@cpu1"}]);
    let fields = write(folder.path(), "fields.json", fields(&steps).to_string());
    let out = folder.path().join("model.json");
    let complaint = failure(sapwise().arg("train").arg(&fields).arg("--out").arg(&out), 1);
    assert!(complaint.contains("fields.json is no report"), "{complaint}");
    let empty = folder.path().join("empty");
    fs::create_dir(&empty).unwrap();
    let complaint = failure(sapwise().arg("train").arg(&empty).arg("--out").arg(&out), 1);
    assert!(complaint.contains("no *.json"), "{complaint}");
    assert!(!out.exists());
}

#[test]
fn the_published_cards_are_sound_and_told_to_be_published() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets/published");
    let cards: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(cards.len(), 3);
    let (status, findings) = check(&cards);
    assert_eq!(status, 0, "{findings:?}");
    for finding in findings {
        assert_eq!((&finding["sound"], &finding["applicable"]), (&true.into(), &false.into()), "{finding}");
        let notes = finding["notes"].as_array().unwrap();
        assert!(notes.iter().any(|n| n.as_str().unwrap().starts_with("published parameters")), "{finding}");
        assert!(!finding.to_string().contains("measured"), "{finding}");
    }
    let out = tempfile::tempdir().unwrap();
    let complaint = failure(sapwise().args(["train", "--out"]).arg(out.path().join("m.json")).args(&cards), 1);
    assert!(complaint.contains("published parameters, without timings"), "{complaint}");
}

#[test]
fn simulated_machines_train_apart_and_are_told_to_be_simulated() {
    let folder = tempfile::tempdir().unwrap();
    let specifications = Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets/simulated/specifications.json");
    let machines = folder.path().join("machines");
    let mut simulate = sapwise();
    simulate.arg("simulate").arg(specifications).args(["--machines", "2", "--json", "--out"]).arg(&machines);
    let answer: Value = serde_json::from_str(&success(&mut simulate)).unwrap();
    let files: Vec<PathBuf> = answer["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap().into()).collect();
    assert_eq!(files.len(), 2);
    let (status, findings) = check(&files);
    let told =
        |f: &Value| f["notes"].as_array().unwrap().iter().any(|n| n.as_str().unwrap().contains("no evidence of accuracy"));
    assert!(status == 0 && findings.iter().all(told), "{findings:?}");
    let model = folder.path().join("model.json");
    let train = |words: &[&str]| {
        let mut command = sapwise();
        command.arg("train").arg(&machines).args(words).arg("--out").arg(&model);
        command
    };
    let complaint = failure(&mut train(&[]), 1);
    assert!(complaint.contains("--simulated") && !model.exists(), "{complaint}");
    success(&mut train(&["--simulated"]));
    let (status, findings) = check(std::slice::from_ref(&model));
    assert!(status == 0 && told(&findings[0]), "{findings:?}");
    let predicted = success(sapwise().args(["predict", "--json", "--report"]).arg(&files[0]).arg("--model").arg(&model));
    assert!(predicted.contains("trained on simulated machines"), "{predicted}");
}
