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
        "schema": "report/2",
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

fn tuning(steps: &Value) -> Value {
    json!({
        "schema": "tuning/2", "source": "default", "model": null, "extrapolated": false, "warnings": [],
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
    let tuning = write(folder.path(), "tuning.json", tuning(&steps).to_string());
    let again = write(folder.path(), "again.json", fs::read(&report).unwrap());
    let told = success(sapwise().arg("check").args([&report, &tuning, &again]));
    let next = format!("Next: sapwise study {} {} --out study", report.display(), again.display());
    assert!(told.contains(&next), "{told}");
    let (status, findings) = check(&[report, tuning]);
    assert_eq!(status, 0, "{findings:?}");
    assert!(findings.iter().all(|f| f["sound"] == true && f["current"] == true), "{findings:?}");
    assert_eq!((&findings[0]["schema"], &findings[0]["applicable"]), (&"report/2".into(), &false.into()));
    assert_eq!((&findings[1]["schema"], &findings[1]["applicable"]), (&"tuning/2".into(), &true.into()));
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
        {"from_objects": 99, "algorithm": "grid-sap@gpu99"}, {"from_objects": 999, "algorithm": "sap@cpu2048"}
    ]);
    let elsewhere = write(folder.path(), "elsewhere.json", tuning(&steps).to_string());
    let (status, findings) = check(&[old, elsewhere]);
    assert_eq!(status, 1);
    assert_eq!((&findings[0]["sound"], &findings[0]["current"]), (&true.into(), &false.into()));
    assert!(findings[0]["problems"].to_string().contains("brute has revision 999999"), "{findings:?}");
    assert_eq!(findings[1]["applicable"], false);
    // A line for what wants more cores, however many algorithms that are.
    assert_eq!(findings[1]["problems"].as_array().map(Vec::len), Some(3), "{findings:?}");
    for text in ["brute@cpu4096, sap@cpu2048", "up to 4096 threads", "octree@cpu1", "grid-sap@gpu99"] {
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
        (path("cut.json", &good.as_bytes()[..good.len() / 3]), "the text ends too early"),
        (path("empty.json", b""), "line 1 column 0"),
        (path("future.json", with("/schema", "report/3".into()).as_bytes()), "report/3"),
        (path("nested.json", nested.as_bytes()), "line 1 column"),
        (path("deep.json", format!("{{\"schema\": \"report/2\", \"x\": {nested}}}").as_bytes()), "x is no key"),
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
        (path("steps.json", tuning(&json!([])).to_string().as_bytes()), "steps"),
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
    let tuning = write(folder.path(), "tuning.json", tuning(&steps).to_string());
    let out = folder.path().join("model.json");
    let complaint = failure(sapwise().arg("train").arg(&tuning).arg("--out").arg(&out), 1);
    assert!(complaint.contains("tuning.json is no report"), "{complaint}");
    let empty = folder.path().join("empty");
    fs::create_dir(&empty).unwrap();
    let complaint = failure(sapwise().arg("train").arg(&empty).arg("--out").arg(&out), 1);
    assert!(complaint.contains("no *.json"), "{complaint}");
    assert!(!out.exists());
}

/// What `damage` does to a report of this build that a machine was measured for, and what is told of it.
type Case = (&'static str, Value, &'static str);

/// The findings on a sound report, each with one thing changed.
fn damaged(cases: &[Case]) -> Vec<Value> {
    let folder = tempfile::tempdir().unwrap();
    let file = |(k, (pointer, value, _)): (usize, &Case)| {
        let mut report = measured();
        let at = report.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}"));
        *at = value.clone();
        write(folder.path(), &format!("{k}.json"), report.to_string())
    };
    let files: Vec<PathBuf> = cases.iter().enumerate().map(file).collect();
    check(&files).1
}

/// A report that a machine was measured for: restricted, proven and undisturbed.
fn measured() -> Value {
    let mut report = report();
    let parameter = |name: &str, value: f64| {
        json!({
            "name": name, "value": value, "dispersion": 0.01, "samples": 8, "spoiled": 0, "foreign_load": 0.01,
            "how": "measured", "source": "test"
        })
    };
    report["label"] = "real_restricted".into();
    report["provenance"]["threads"] = 64.into();
    report["provenance"]["restriction"] = json!({
        "kinds": ["threads"],
        "proof": [{"kind": "threads", "parameter": "usable_cores", "without": 128.0, "with": 64.0, "shows": true}]
    });
    let parameters = report["hardware"]["parameters"].as_array_mut().unwrap();
    parameters.extend([
        parameter("clock_measured_ghz", 4.0),
        parameter("simd_lanes", 4.0),
        parameter("cache_l1d_bytes", 32768.0),
        parameter("cache_l2_bytes", 1_048_576.0),
        parameter("bandwidth_one_thread_gb_per_s", 20.0),
        parameter("scaling_all_threads_ratio", 60.0),
    ]);
    let point = report["points"][0].clone();
    report["points"] = json!([point.clone(), point.clone(), point.clone(), point]);
    report
}

#[test]
fn impossible_figures_and_revealing_texts_are_problems_that_name_them() {
    let folder = tempfile::tempdir().unwrap();
    let (status, sound) = check(&[write(folder.path(), "sound.json", measured().to_string())]);
    assert_eq!((status, &sound[0]["problems"], &sound[0]["sound"]), (0, &json!([]), &true.into()), "{sound:?}");
    let parameter = |k: usize, key: &str| -> &'static str { format!("/hardware/parameters/{k}/{key}").leak() };
    let timings = json!([
        {"algorithm": "brute@cpu1", "samples_ns": [100, 101], "error": null},
        {"algorithm": "brute@cpu64", "samples_ns": [100, 101, 102], "error": null}
    ]);
    let twice = json!([timings[0], timings[0]]);
    let silent = json!([{"algorithm": "brute@cpu1", "samples_ns": [], "error": null}]);
    let cases: Vec<Case> = vec![
        (parameter(0, "value"), 5000.0.into(), "usable_cores is 5000"),
        (parameter(0, "value"), 1.5.into(), "usable_cores is 1.5"),
        (parameter(0, "value"), 32.0.into(), "brute@cpu64 ran on more threads than the usable cores"),
        (parameter(0, "value"), 128.0.into(), "the report is of 64 threads"),
        (parameter(0, "foreign_load"), 1.5.into(), "no share"),
        (parameter(1, "value"), 100.0.into(), "clock_measured_ghz is 100"),
        (parameter(1, "dispersion"), (-0.5).into(), "dispersion"),
        (parameter(2, "value"), 8.0.into(), "simd_lanes is 8"),
        (parameter(5, "value"), 0.0.into(), "bandwidth_one_thread_gb_per_s is 0"),
        (parameter(6, "value"), 130.0.into(), "64 threads can't be more than 64 times as fast"),
        ("/provenance/date", "2026-02-30".into(), "no day"),
        ("/provenance/date", "yesterday".into(), "no day"),
        ("/provenance/simd", "avx2".into(), "avx2 was forced, and portable was in use"),
        ("/provenance/seconds", (-3.0).into(), "it took -3 s"),
        ("/provenance/threads", Value::Null, "the restriction threads is not in the rest"),
        ("/provenance/restriction/proof/0/with", 32.0.into(), "the proof of threads has usable_cores as Some(32.0)"),
        ("/points/1/foreign_load", 2.0.into(), "point 1 (uniform at 10 objects): a foreign load"),
        ("/points/1/fingerprint", "ff".into(), "16 hex digits"),
        ("/points/1/pairs", 46.into(), "46 pairs"),
        ("/points/1/pairs", 3.into(), "2 and 3 pairs with one fingerprint"),
        ("/points/1/timings", twice, "stands there twice"),
        ("/points/1/timings", silent, "0 samples and the error None"),
        ("/points/1/timings/0/samples_ns", json!([1, 2, 9_000_000_000_u64]), "samples add up to 9.0 s"),
        ("/provenance/command", "probe --out /home/me/r.json".into(), "provenance.command holds the folder of a user"),
        ("/remarks", json!(["a remark", "see C:\\Users\\me"]), "remarks[1] holds the folder of a user"),
        ("/hardware/machine/cpu", "ask me@example.org".into(), "hardware.machine.cpu holds an address of e-mail"),
    ];
    for ((pointer, value, text), finding) in cases.iter().zip(damaged(&cases)) {
        let problems = finding["problems"].as_array().unwrap();
        let told = problems.iter().any(|p| p.as_str().unwrap().contains(text));
        assert!(told, "{pointer} as {value}: {text:?} is not in {problems:?}");
    }
}

#[test]
fn the_name_of_this_host_is_a_problem() {
    let common = ["localhost", std::env::consts::OS, std::env::consts::ARCH];
    let Some(host) = sysinfo::System::host_name().ok().filter(|h| h.len() > 3 && !common.contains(&h.as_str())) else {
        eprintln!("skipped: this host has no name of its own");
        return;
    };
    let cases: Vec<Case> = vec![("/remarks", json!([format!("made on {host}.")]), "the name of this host")];
    let finding = &damaged(&cases)[0];
    assert!(finding["problems"].to_string().contains("remarks[0] holds the name of this host"), "{finding}");
}

#[test]
fn a_file_that_is_too_large_is_a_problem() {
    let folder = tempfile::tempdir().unwrap();
    let filled = |bytes: usize| measured().to_string() + &" ".repeat(bytes);
    let small = write(folder.path(), "small.json", filled(900_000));
    let large = write(folder.path(), "large.json", filled(1_000_000));
    let (status, findings) = check(&[small, large]);
    assert_eq!((status, &findings[0]["problems"]), (1, &json!([])));
    assert!(findings[1]["problems"].to_string().contains("more than the 1000000"), "{findings:?}");
}

#[test]
fn doubtful_and_suspicious_figures_are_told_and_the_file_stays_sound() {
    let point = |load: f64| {
        let mut point = measured()["points"][0].clone();
        point["foreign_load"] = load.into();
        point
    };
    let loaded = json!([point(0.3), point(0.2), point(0.01), point(0.01)]);
    let cases: Vec<Case> = vec![
        ("/points", loaded, "over 5 % of the CPU at 2 of 4 points (50 %)"),
        ("/hardware/parameters/5/dispersion", 0.5.into(), "dispersion over 20 %: bandwidth_one_thread_gb_per_s (50 %)"),
        (
            "/remarks",
            json!(["interrupted after uniform at 10 objects; the rest is missing"]),
            "it was cut short: interrupted after uniform",
        ),
        (
            "/hardware/parameters/3/value",
            3e6.into(),
            "cache_l1d_bytes is 2.9 MiB and cache_l2_bytes is 1 MiB: one of them may be in another unit",
        ),
        (
            "/provenance/restriction/proof/0/shows",
            false.into(),
            "the restriction threads does not show: usable_cores is 64",
        ),
        ("/provenance/date", "9999-01-01".into(), "its date is to come"),
    ];
    for ((pointer, value, text), finding) in cases.iter().zip(damaged(&cases)) {
        assert_eq!(finding["problems"], json!([]), "{pointer} as {value}");
        let kind = if ["/points", "/remarks"].contains(pointer) { "doubts" } else { "notes" };
        assert!(finding[kind].to_string().contains(text), "{pointer} as {value}: {finding}");
        assert_eq!(
            finding.to_string().matches("interrupted after").count(),
            usize::from(*pointer == "/remarks"),
            "{finding}"
        );
    }
    // A disturbed measurement of one thread makes several look better than they are.
    let impossible = |k: usize| {
        let mut parameters = measured()["hardware"]["parameters"].clone();
        parameters[k]["value"] = 71.0.into();
        parameters
    };
    let finding = &damaged(&[("/hardware/parameters", impossible(6), "")])[0];
    assert!(finding["doubts"].to_string().contains("64 threads can't be more than 64 times as fast"), "{finding}");
    let labelled = |command: &str| {
        let mut report = measured();
        report["label"] = "real_contended".into();
        report["provenance"]["command"] = command.into();
        report["points"] = json!([point(0.3), point(0.3)]);
        report
    };
    let by_whom: Vec<Case> =
        vec![("", labelled("probe --seed 1"), ""), ("", labelled("probe --contended=cache --seed 1"), "")];
    let told: Vec<bool> =
        damaged(&by_whom).iter().map(|f| f["doubts"].to_string().contains("other programs")).collect();
    assert_eq!(told, [true, false]);
    // One that was surely beaten rests and has fewer samples than the others.
    let timings = json!([
        {"algorithm": "brute@cpu1", "samples_ns": [100, 101, 102], "error": null},
        {"algorithm": "brute@cpu64", "samples_ns": [900, 901], "error": null}
    ]);
    let rested = &damaged(&[("/points/1/timings", timings, "")])[0];
    assert_eq!(rested["problems"].as_array().map(Vec::len), Some(0), "{rested}");
    let few: Vec<Case> = vec![("/points", json!([point(0.3), point(0.01), point(0.01), point(0.01)]), "")];
    assert_eq!(damaged(&few)[0]["doubts"], json!([]));
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
    let machines = folder.path().join("machines");
    let mut simulate = sapwise();
    simulate.args(["simulate", "--machines", "2", "--json", "--out"]).arg(&machines);
    let answer: Value = serde_json::from_str(&success(&mut simulate)).unwrap();
    let files: Vec<PathBuf> = answer["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap().into()).collect();
    assert_eq!(files.len(), 2);
    let complaint = failure(&mut simulate, 1);
    assert!(complaint.contains("machines holds *.json files already; name another with --out"), "{complaint}");
    let (status, findings) = check(&files);
    let told = |f: &Value| {
        f["notes"].as_array().unwrap().iter().any(|n| n.as_str().unwrap().contains("no evidence of accuracy"))
    };
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
    let predicted =
        success(sapwise().args(["predict", "--json", "--report"]).arg(&files[0]).arg("--model").arg(&model));
    assert!(predicted.contains("trained on simulated machines"), "{predicted}");
}

#[test]
fn keys_of_a_newer_version_are_ignored_and_told_once_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut newer = measured();
    newer["schema"] = "report/2.9".into();
    newer["weather"] = "rain".into();
    for point in newer["points"].as_array_mut().unwrap() {
        point["load"]["depth"] = 3.into();
    }
    let newer = write(folder.path(), "newer.json", newer.to_string());
    let sentence = "newer.json is of report/2.9, which a newer version of sapwise wrote; ignored, because this version does not know it: \
                    points[].load.depth, weather";
    let (status, findings) = check(std::slice::from_ref(&newer));
    assert!(status == 0 && findings[0]["notes"].to_string().contains(sentence), "{findings:?}");
    let out = folder.path().join("tuning.json");
    let mut steps = tuning(&json!([{"from_objects": 0, "algorithm": "brute@cpu1"}]));
    steps["schema"] = "tuning/2.1".into();
    steps["mood"] = "good".into();
    let steps = write(folder.path(), "newer-tuning.json", steps.to_string());
    let complaints = |words: &[&str], file: &Path| {
        let ended = sapwise().args(words).arg(file).output().unwrap();
        let told = String::from_utf8(ended.stderr).unwrap();
        told.lines().filter(|line| line.starts_with("warning: ")).map(str::to_owned).collect::<Vec<_>>()
    };
    let measured = ["predict", "--measured", "--out", out.to_str().unwrap(), "--report"];
    let replayed = ["run", "uniform", "--objects", "10", "--frames", "2", "--repeats", "1", "--no-gpus", "--tuning"];
    for told in [complaints(&measured, &newer), complaints(&["train", "--out", "m.json"], &newer)] {
        assert!(matches!(&told[..], [one] if one.ends_with(sentence)), "{told:?}");
    }
    let told = complaints(&replayed, &steps);
    assert!(matches!(&told[..], [one] if one.contains("is of tuning/2.1") && one.ends_with(": mood")), "{told:?}");
}
