//! `sapwise check` and `sapwise train` on sound and on damaged files.

mod common;

use common::{failure, list, output, sapwise, small_report, success, tuning, write};
use sapwise_lab::Report;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// A sound and undisturbed report of two threads of an invented machine, with twelve points.
fn report() -> Value {
    let mut report = small_report("0");
    report["label"] = "real_restricted".into();
    report["provenance"]["threads"] = 2.into();
    for parameter in report["hardware"]["parameters"].as_array_mut().unwrap() {
        parameter["foreign_load"] = 0.01.into();
        if parameter["name"].as_str().unwrap().starts_with("scaling_") {
            parameter["value"] = 1.9.into();
        }
    }
    report
}

/// The findings, one for each file, of a check that ends with this status.
fn check(files: &[PathBuf], status: i32) -> Vec<Value> {
    let told = output(sapwise().args(["check", "--json"]).args(files), status);
    let answer: Value = serde_json::from_str(&told).unwrap();
    list(&answer["files"]).to_vec()
}

#[test]
fn sound_files_pass() {
    let folder = tempfile::tempdir().unwrap();
    let report = write(folder.path(), "report.json", report().to_string());
    let tuning = write(folder.path(), "tuning.json", tuning(&[(0, "brute@cpu1")]).to_string());
    let again = write(folder.path(), "again.json", fs::read(&report).unwrap());
    let told = success(sapwise().arg("check").args([&report, &tuning, &again]));
    let next = format!("Next: sapwise study {} {} --out study", report.display(), again.display());
    assert!(told.contains(&next) && told.contains("2 of 2 reports can be believed"), "{told}");
    let findings = check(&[report, tuning], 0);
    assert!(findings.iter().all(|f| f["sound"] == true && f["current"] == true), "{findings:?}");
    assert_eq!((&findings[0]["schema"], &findings[0]["applicable"]), (&"report/3".into(), &false.into()));
    assert_eq!((&findings[1]["schema"], &findings[1]["applicable"]), (&"tuning/3".into(), &true.into()));
    assert!(findings[0]["notes"].to_string().contains("measured on another machine: AMD EPYC"), "{findings:?}");
}

#[test]
fn stale_and_inapplicable_files_fail_and_say_which_algorithm() {
    let folder = tempfile::tempdir().unwrap();
    let mut old = report();
    for algorithm in old["algorithms"].as_array_mut().unwrap() {
        algorithm["revision"] = 999_999.into();
    }
    let old = write(folder.path(), "old.json", old.to_string());
    let steps = [(0, "brute@cpu4096"), (9, "octree@cpu1"), (99, "grid-sap@gpu99"), (999, "sap@cpu2048")];
    let elsewhere = write(folder.path(), "elsewhere.json", tuning(&steps).to_string());
    let findings = check(&[old, elsewhere], 1);
    assert_eq!((&findings[0]["sound"], &findings[0]["current"]), (&true.into(), &false.into()));
    assert!(findings[0]["problems"].to_string().contains("brute has revision 999999"), "{findings:?}");
    assert_eq!(findings[1]["applicable"], false);
    // One line for all algorithms that want more cores.
    assert_eq!(list(&findings[1]["problems"]).len(), 3, "{findings:?}");
    for text in ["brute@cpu4096, sap@cpu2048", "up to 4096 threads", "octree@cpu1", "grid-sap@gpu99"] {
        assert!(findings[1]["problems"].to_string().contains(text), "{findings:?}");
    }
}

#[test]
fn damaged_files_are_named_with_the_place_and_hide_no_others() {
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
        (path("future.json", with("/schema", "report/4".into()).as_bytes()), "report/4"),
        (path("nested.json", nested.as_bytes()), "line 1 column"),
        (path("deep.json", format!("{{\"schema\": \"report/3\", \"x\": {nested}}}").as_bytes()), "x is no key"),
        (path("unknown.json", good.replacen("\"label\"", "\"lable\"", 1).as_bytes()), "lable"),
        (path("zero.json", with("/points/0/timings/0/samples_ns/0", 0.into()).as_bytes()), "0 ns"),
        (path("negative.json", with("/points/0/load/pairs", (-1.0).into()).as_bytes()), "negative"),
        (path("nan.json", good.replacen("\"value\":2.0", "\"value\":NaN", 1).as_bytes()), "line 1 column"),
        (path("infinite.json", good.replacen("\"value\":2.0", "\"value\":1e999", 1).as_bytes()), "number out of range"),
        (path("latin1.json", b"{\n\"schema\": \"\xe9\"}"), "line 2"),
        (path("binary.json", &[0, 159, 146, 150]), "UTF-8"),
        (folder.path().join("huge.json"), "64 MiB"),
        (folder.path().join("absent.json"), "absent.json"),
        (path("steps.json", tuning(&[]).to_string().as_bytes()), "steps"),
    ];
    let last = path("good.json", good.as_bytes());
    let files: Vec<PathBuf> = cases.iter().map(|c| c.0.clone()).chain([last]).collect();
    let findings = check(&files, 1);
    assert_eq!(findings.len(), files.len());
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
    let tuning = write(folder.path(), "tuning.json", tuning(&[(0, "brute@cpu1")]).to_string());
    let out = folder.path().join("model.json");
    failure(sapwise().arg("train").arg(&tuning).arg("--out").arg(&out), 1, &["tuning.json is no report"]);
    let empty = folder.path().join("empty");
    fs::create_dir(&empty).unwrap();
    failure(sapwise().arg("train").arg(&empty).arg("--out").arg(&out), 1, &["no *.json"]);
    assert!(!out.exists());
}

/// The place and the value of a change in a sound report, and a part of the finding.
type Case = (&'static str, Value, &'static str);

/// The findings on sound reports, each with one thing changed, of a check that ends with this status.
fn changed(cases: &[Case], status: i32) -> Vec<Value> {
    let folder = tempfile::tempdir().unwrap();
    let file = |(k, (pointer, value, _)): (usize, &Case)| {
        let mut report = report();
        let at = report.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}"));
        *at = value.clone();
        write(folder.path(), &format!("{k}.json"), report.to_string())
    };
    let files: Vec<PathBuf> = cases.iter().enumerate().map(file).collect();
    check(&files, status)
}

#[test]
fn impossible_figures_and_revealing_texts_are_problems_that_name_them() {
    let folder = tempfile::tempdir().unwrap();
    let sound = check(&[write(folder.path(), "sound.json", report().to_string())], 0);
    assert_eq!((&sound[0]["problems"], &sound[0]["sound"]), (&json!([]), &true.into()), "{sound:?}");
    let parameter = |k: usize, key: &str| -> &'static str { format!("/hardware/parameters/{k}/{key}").leak() };
    let timing = json!({"algorithm": "brute@cpu1", "samples_ns": [100, 101], "error": null});
    let twice = json!([timing, timing]);
    let silent = json!([{"algorithm": "brute@cpu1", "samples_ns": [], "error": null}]);
    let cases: Vec<Case> = vec![
        (parameter(0, "value"), 5000.0.into(), "usable_cores is 5000"),
        (parameter(0, "value"), 1.0.into(), "brute@cpu2 ran on more threads than the usable cores"),
        (parameter(0, "value"), 4.0.into(), "the report is of 2 threads"),
        (parameter(0, "foreign_load"), 1.5.into(), "no share"),
        (parameter(3, "value"), 100.0.into(), "clock_measured_ghz is 100"),
        (parameter(4, "value"), 8.0.into(), "simd_lanes is 8"),
        (parameter(16, "value"), 0.0.into(), "bandwidth_one_thread_gb_per_s is 0"),
        (parameter(21, "value"), 5.0.into(), "2 threads can't be more than 2 times as fast"),
        ("/provenance/date", "2026-02-30".into(), "no day"),
        ("/provenance/date", "yesterday".into(), "no day"),
        ("/provenance/simd", "avx2".into(), "avx2 was forced, and avx512 was in use"),
        ("/provenance/seconds", (-3.0).into(), "it took -3 s"),
        ("/points/1/foreign_load", 2.0.into(), "point 1 (uniform at 18 objects): a foreign load"),
        ("/points/1/fingerprint", "ff".into(), "16 hex digits"),
        ("/points/1/pairs", 154.into(), "154 pairs"),
        ("/points/1/timings", twice, "stands there twice"),
        ("/points/1/timings", silent, "0 samples and the error None"),
        ("/points/1/timings/0/samples_ns", json!([1, 2, 9_000_000_000_u64]), "samples add up to 9.2 s"),
        ("/provenance/command", "probe --out /home/me/r.json".into(), "holds the folder of a user"),
        ("/remarks", json!(["a remark", "see C:\\Users\\me"]), "holds the folder of a user"),
    ];
    for ((pointer, value, text), finding) in cases.iter().zip(changed(&cases, 1)) {
        let problems = list(&finding["problems"]);
        let told = problems.iter().any(|p| p.as_str().unwrap().contains(text));
        assert!(told, "{pointer} as {value}: {text:?} is not in {problems:?}");
    }
}

#[test]
fn doubts_and_notes_leave_a_file_sound() {
    let point = |load: f64| {
        let mut point = report()["points"][0].clone();
        point["foreign_load"] = load.into();
        point
    };
    let loaded = json!([point(0.3), point(0.2), point(0.01), point(0.01)]);
    let calm = json!([point(0.3), point(0.01), point(0.01), point(0.01)]);
    // A disturbed measurement of one thread makes several look better than they are.
    let mut beyond = report()["hardware"]["parameters"].clone();
    beyond[21]["value"] = 3.0.into();
    let mut moved = report()["points"].clone();
    moved.as_array_mut().unwrap().iter_mut().for_each(|p| p["core_to_core_ns"] = json!([23.0, 24.0]));
    [0, 1].iter().for_each(|&k: &usize| moved[k]["core_to_core_ns"] = json!([23.0, 175.0]));
    // One that was surely beaten rests and has fewer samples than the others.
    let rested = json!([
        {"algorithm": "brute@cpu1", "samples_ns": [100, 101, 102], "error": null},
        {"algorithm": "brute@cpu2", "samples_ns": [900, 901], "error": null}
    ]);
    let cut = json!(["interrupted after uniform at 10 objects; the rest is missing"]);
    let cases: Vec<Case> = vec![
        ("/points", loaded, "over 5 % of the CPU at 2 of 4 points (50 %)"),
        ("/remarks", cut, "it was cut short: interrupted after uniform"),
        ("/hardware/parameters", beyond, "2 threads can't be more than 2 times as fast"),
        ("/points", moved, "the cores of the machine moved"),
        ("/remarks", json!(["the restriction threads does not show"]), "remark: the restriction threads does not show"),
        ("/points", calm, ""),
        ("/points/1/timings", rested, ""),
    ];
    for (k, ((pointer, value, text), finding)) in cases.iter().zip(changed(&cases, 0)).enumerate() {
        assert_eq!(finding["problems"], json!([]), "{pointer} as {value}");
        let key = if k < 3 { "doubts" } else { "notes" };
        assert!(finding[key].to_string().contains(text), "{pointer} as {value}: {finding}");
        assert_eq!(list(&finding["doubts"]).len(), usize::from(k < 3), "{finding}");
    }
}

#[test]
fn of_a_folder_a_table_says_which_reports_agree() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, percent: u64, change: &dyn Fn(&mut Value)| {
        let mut report: Report = sapwise_lab::report::read(&report().to_string()).unwrap().value;
        let timings = report.points.iter_mut().flat_map(|p| &mut p.timings);
        timings.flat_map(|t| &mut t.samples_ns).for_each(|ns| *ns = *ns * percent / 100);
        let mut report = serde_json::from_str(&sapwise_lab::report::write(&report).unwrap()).unwrap();
        change(&mut report);
        write(folder.path(), name, report.to_string());
    };
    put("full.json", 100, &|_| {});
    put("full-again.json", 102, &|_| {});
    put("slow.json", 200, &|_| {});
    put("cut.json", 1000, &|report| report["remarks"] = json!(["interrupted at the first point"]));
    put("elsewhere.json", 300, &|report| report["hardware"]["machine"]["physical_id"] = "00000000000000aa".into());
    write(folder.path(), "bad.json", "{");
    let told = output(sapwise().arg("check").arg(folder.path()), 1);
    let row = |name: &str| {
        let row = told.lines().find(|line| line.contains(name) && !line.contains(": "));
        row.unwrap_or_else(|| panic!("no row of {name}: {told}"))
            .split("  ")
            .map(str::trim)
            .filter(|c| !c.is_empty())
            // Without the quartiles.
            .map(|cell| cell.split(" (").next().unwrap_or_default().to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(row("full.json")[2..4], ["good", "0.66"]);
    assert_eq!(row("slow.json")[2..4], ["DOUBTFUL", "1.98"]);
    assert_eq!(row("cut.json")[2..], ["DOUBTFUL", "-"]);
    assert_eq!(row("elsewhere.json")[2..], ["good", "-"]);
    assert!(row("full.json")[1] == row("slow.json")[1] && row("elsewhere.json")[1] != row("slow.json")[1], "{told}");
    for text in [
        "1.98 × the time of the other reports",
        "bad.json: BAD",
        "   1  AMD EPYC, 2 cores, avx512, host ",
        "3 of 5 reports can be believed",
    ] {
        assert!(told.contains(text), "{text}: {told}");
    }
    assert!(!told.contains("/full.json: "), "{told}");
    let json: Value = serde_json::from_str(&output(sapwise().args(["check", "--json"]).arg(folder.path()), 1)).unwrap();
    assert_eq!(list(&json["files"]).len(), 6);
    let reports = list(&json["kinds"][0]["reports"]);
    let slow = reports.iter().find(|r| r["file"].as_str().unwrap().ends_with("slow.json"));
    assert_eq!(slow.unwrap()["over_others"]["timings"], 72, "{json}");
    let empty = tempfile::tempdir().unwrap();
    failure(sapwise().arg("check").arg(empty.path()), 1, &["holds no *.json file"]);
}

#[test]
fn the_published_cards_are_sound_and_told_to_be_published() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets/published");
    let files = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let cards: Vec<PathBuf> = files.filter(|file| file.extension().is_some_and(|e| e == "json")).collect();
    assert_eq!(cards.len(), 3);
    for finding in check(&cards, 0) {
        assert_eq!((&finding["sound"], &finding["applicable"]), (&true.into(), &false.into()), "{finding}");
        let notes = list(&finding["notes"]);
        assert!(notes.iter().any(|n| n.as_str().unwrap().starts_with("published parameters")), "{finding}");
        assert!(!finding.to_string().contains("measured"), "{finding}");
    }
    let out = tempfile::tempdir().unwrap();
    failure(
        sapwise().args(["train", "--out"]).arg(out.path().join("m.json")).args(&cards),
        1,
        &["published parameters, without timings"],
    );
}

#[test]
fn keys_of_a_newer_version_are_ignored_and_told_once_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut newer = report();
    newer["schema"] = "report/3.9".into();
    newer["weather"] = "rain".into();
    for point in newer["points"].as_array_mut().unwrap() {
        point["load"]["depth"] = 3.into();
    }
    let newer = write(folder.path(), "newer.json", newer.to_string());
    let sentence = "newer.json is of report/3.9, which a newer version of sapwise wrote; ignored, because this version \
                    does not know it: points[].load.depth, weather";
    let findings = check(std::slice::from_ref(&newer), 0);
    assert!(findings[0]["notes"].to_string().contains(sentence), "{findings:?}");
    let out = folder.path().join("tuning.json");
    let mut steps = tuning(&[(0, "brute@cpu1")]);
    steps["schema"] = "tuning/3.1".into();
    steps["mood"] = "good".into();
    let steps = write(folder.path(), "newer-tuning.json", steps.to_string());
    let complaints = |words: &[&str], file: &Path| {
        let ended = sapwise().args(words).arg(file).output().unwrap();
        let told = String::from_utf8(ended.stderr).unwrap();
        told.lines().filter(|line| line.starts_with("warning: ")).map(str::to_owned).collect::<Vec<_>>()
    };
    let measured = ["predict", "--measured", "--out", out.to_str().unwrap(), "--report"];
    let replayed = ["run", "uniform", "--objects", "10", "--frames", "2", "--repeats", "1", "--no-gpus", "--tuning"];
    for told in [
        complaints(&measured, &newer),
        complaints(&["train", "--out", folder.path().join("m.json").to_str().unwrap()], &newer),
    ] {
        assert!(matches!(&told[..], [one] if one.ends_with(sentence)), "{told:?}");
    }
    let told = complaints(&replayed, &steps);
    assert!(matches!(&told[..], [one] if one.contains("is of tuning/3.1") && one.ends_with(": mood")), "{told:?}");
}
