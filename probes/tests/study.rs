//! `sapwise study` on stored reports, and on what is no good report.

mod common;

use common::{failure, sapwise, success};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn dataset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets").join(name)
}

fn stored(profile: &str) -> PathBuf {
    dataset(&format!("earlier/amd-epyc-2c-{profile}--2026-11-21.json"))
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// A copy of the whole machine's report, changed, as another machine.
fn changed(folder: &Path, name: &str, change: impl FnOnce(&mut Value)) -> PathBuf {
    let mut report = read(&stored("full"));
    report["hardware"]["machine"]["physical_id"] = json!(format!("{:016x}", name.len()));
    change(&mut report);
    let path = folder.join(name);
    fs::write(&path, report.to_string()).unwrap();
    path
}

/// The answer on standard output, which the folder holds too.
fn study(reports: &[PathBuf], out: &Path) -> Value {
    let answer = success(sapwise().arg("study").args(reports).arg("--json").arg("--out").arg(out));
    let answer: Value = serde_json::from_str(&answer).unwrap();
    assert_eq!(answer, read(&out.join("study.json")));
    for file in answer["files"].as_array().unwrap() {
        assert!(out.join(file["path"].as_str().unwrap()).is_file(), "{file}");
    }
    answer
}

fn rows(csv: &Path) -> Vec<BTreeMap<String, String>> {
    csv::Reader::from_path(csv).unwrap().deserialize().map(Result::unwrap).collect()
}

fn says(answer: &Value, words: &str) -> bool {
    answer["missing"].as_array().unwrap().iter().any(|m| m.as_str().unwrap().contains(words))
}

#[test]
fn figures_come_from_the_reports_that_they_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("study");
    let profiles = ["full", "1t", "avx2", "avx2-1t", "two-gpus"];
    let reports: Vec<PathBuf> = profiles.iter().map(|p| stored(p)).chain([dataset("published")]).collect();
    let answer = study(&reports, &out);
    assert_eq!((answer["reports"].as_array().unwrap().len(), &answer["physical_machines"]), (8, &json!(1)));
    // Every value of the machines stands in the report that its row names.
    let files: BTreeMap<&str, &str> = answer["reports"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| (r["label"].as_str().unwrap(), r["file"].as_str().unwrap()))
        .collect();
    let mut looked_at = 0;
    for row in rows(&out.join("tables/parameters.csv")).iter().filter(|r| r["processor"] == "machine") {
        let file = files[row["reports"].as_str()];
        let own =
            reports.iter().find(|r| r.ends_with(file)).cloned().unwrap_or_else(|| dataset("published").join(file));
        let own = read(&own);
        let mut parameters = own["hardware"]["parameters"].as_array().unwrap().iter();
        let p = parameters.find(|p| p["name"] == row["parameter"].as_str()).unwrap();
        match p["value"].as_f64() {
            Some(value) => assert!((row["value"].parse::<f64>().unwrap() / value - 1.0).abs() < 1e-12, "{file} {p}"),
            None => assert_eq!(row["value"], "", "{file} {p}"),
        }
        looked_at += 1;
    }
    assert!(looked_at > 150, "{looked_at}");
    // Every median time stands in one row, with what it is of.
    let timings = rows(&out.join("tables/timings.csv"));
    let named = |r: &BTreeMap<String, String>| {
        r["algorithm"] == "grid-sap@cpu2" && r["threads"] == "2" && r["method"] == "grid-sap"
    };
    assert!(
        timings.iter().any(|r| named(r) && r["scenario"] == "uniform" && r["median_ns"].parse::<f64>().unwrap() > 0.0)
    );
    // Vectors were taken from two threads and from one, and both reports show it; two pairs are too few for a verdict.
    let taken = rows(&out.join("tables/restrictions.csv"));
    let own = |algorithm: &str| {
        taken.iter().find(|r| {
            r["taken"].starts_with("simd: avx2") && r["algorithm"] == algorithm && r["objects"].starts_with("1000")
        })
    };
    let grid_sap = own("grid-sap@cpu1").unwrap();
    assert_eq!((grid_sap["pairs"].as_str(), grid_sap["reports"].split(' ').count()), ("2", 4), "{grid_sap:?}");
    assert_eq!(grid_sap["verdict"], "cannot be told from these machines");
    let proof = rows(&out.join("tables/restriction-proofs.csv"));
    assert!(proof.iter().any(|r| r["parameter"] == "simd_lanes" && r["ratio"] == "0.5"), "{proof:?}");
    // What a single machine can't tell is said, and no link is made up.
    assert!(says(&answer, "it takes 5") && !out.join("tables/influence.csv").exists());
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    assert!(page.contains("figure-7-threads") && page.contains("figure-6-gpus") && page.contains("field-map"));
    let there = folder.path().display().to_string();
    assert!(!page.contains(&there) && !fs::read_to_string(out.join("study.json")).unwrap().contains(&there));
}

#[test]
fn the_papers_claims_are_compared_with_its_own_table() {
    let folder = tempfile::tempdir().unwrap();
    let answer = study(&[dataset("published"), stored("1t")], folder.path());
    let claims = answer["claims"].as_array().unwrap();
    let of = |words: &str| claims.iter().find(|c| c["claim"].as_str().unwrap().contains(words)).unwrap();
    assert_eq!(of("clock rate is almost")["by_its_table"], "confirmed");
    assert_eq!(of("from CPU to GPU is almost")["by_its_table"], "refuted");
    let download = of("from GPU to CPU is similar");
    // The paper does not say on which two.
    assert_eq!(download["by_its_table"], "undecidable");
    // 2309.6 over 559.52 MB/s.
    assert!(download["by_its_table_because"].as_str().unwrap().contains("4.13"), "{download}");
    let memory = of("memory size");
    assert!(memory["by_its_table_because"].as_str().unwrap().contains("power -0.24"), "{memory}");
    assert!(claims.iter().all(|c| ["undecidable", "not asked"].contains(&c["by_these_reports"].as_str().unwrap())));
}

#[test]
fn simulated_machines_are_studied_by_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let machines = folder.path().join("machines");
    success(sapwise().args(["simulate", "--machines", "7", "--out"]).arg(&machines));
    let out = folder.path().join("study");
    let text =
        success(sapwise().args(["study", "--simulated"]).args([&machines, &stored("1t")]).arg("--out").arg(&out));
    assert!(text.contains("8 reports read, the timings of 7 studied; simulated machines"), "{text}");
    let links = rows(&out.join("tables/influence.csv"));
    let link =
        |parameter: &str, of: &str| links.iter().find(|l| l["parameter"] == parameter && l["outcome"] == of).unwrap();
    let clock = link("clock_measured_ghz", "time of brute@cpu1");
    assert!(clock["rank_correlation"].parse::<f64>().unwrap() < 0.0, "{clock:?}");
    assert_eq!(clock["rank_machines"], "7");
    // No prediction reads the size of the memory, so none can show that it does not matter.
    let memory = link("memory_bytes", "time of brute@cpu1");
    assert!(memory["fitted_without_rise"].is_empty() && !memory["rank_correlation"].is_empty(), "{memory:?}");
    assert!(fs::read_to_string(out.join("index.html")).unwrap().contains("These machines are simulated"));
    // The other way round none of them is.
    let answer = study(&[machines, stored("1t")], &folder.path().join("real"));
    let left = answer["reports"].as_array().unwrap().iter().filter(|r| !r["left_out"].is_null()).count();
    assert_eq!(left, 7);
}

#[test]
fn what_a_report_lacks_is_told_and_nothing_is_made_up() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let no_parameters = changed(path, "a.json", |r| r["hardware"]["parameters"] = json!([]));
    let one_size = changed(path, "bb.json", |r| {
        r["points"].as_array_mut().unwrap().retain(|p| p["load"]["objects"] == 1000);
    });
    let no_timings = changed(path, "ccc.json", |r| r["points"] = json!([]));
    for (k, (report, words)) in [
        (no_parameters, "no model could be fitted"),
        (one_size, "it takes two reports"),
        (no_timings, "it holds no timings"),
        (stored("1t"), "no report has a GPU"),
    ]
    .into_iter()
    .enumerate()
    {
        let answer = study(std::slice::from_ref(&report), &path.join(format!("study-{k}")));
        assert!(says(&answer, words), "{report:?}: {}", answer["missing"]);
        assert!(says(&answer, "it takes two reports with timings"), "{report:?}: {}", answer["missing"]);
        let page = fs::read_to_string(path.join(format!("study-{k}/index.html"))).unwrap();
        assert!(!page.contains("NaN") && !page.contains(">inf"), "{report:?}");
    }
}

#[test]
fn files_that_are_no_reports_are_told_beside_those_that_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let reports = path.join("reports");
    fs::create_dir(&reports).unwrap();
    changed(&reports, "future.json", |r| r["schema"] = json!("report/3"));
    changed(&reports, "odd <b>&'; =1+1 é.json", |_| {});
    fs::write(reports.join("cut.json"), "{\"schema\": ").unwrap();
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/default.json"), reports.join("model.json")).unwrap();
    let out = path.join("study");
    let mut command = sapwise();
    command.arg("study").arg(&reports).arg("--out").arg(&out);
    let ended = command.output().unwrap();
    let complaint = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(0), "{complaint}");
    for (name, why) in [("future.json", "report/3"), ("cut.json", "EOF"), ("model.json", "is no report")] {
        assert!(complaint.lines().any(|l| l.contains(name) && l.contains(why)), "{name}: {complaint}");
    }
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    assert!(page.contains("odd &lt;b&gt;") && !page.contains("odd <b>"));
    let there = path.display().to_string();
    assert!(!page.contains(&there));
    fs::remove_file(reports.join("odd <b>&'; =1+1 é.json")).unwrap();
    let complaint = failure(sapwise().arg("study").arg(&reports).arg("--out").arg(path.join("none")), 1);
    assert!(complaint.contains("none of 3 files"), "{complaint}");
}

#[test]
fn wrong_usage_is_told_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let complaint = failure(sapwise().arg("study").arg(stored("1t")), 2);
    assert!(complaint.contains("--out"), "{complaint}");
    let mut command = sapwise();
    command.arg("study").arg(stored("1t")).arg("--reference").arg(stored("full")).arg("--out").arg(path.join("a"));
    assert!(failure(&mut command, 2).contains("is not among the reports"));
    fs::write(path.join("thesis.tex"), "").unwrap();
    let complaint = failure(sapwise().arg("study").arg(stored("1t")).arg("--out").arg(path), 1);
    assert!(complaint.contains("not empty") && complaint.contains("--out"), "{complaint}");
    assert_eq!(fs::read_dir(path).unwrap().count(), 1);
}

#[test]
fn any_two_machines_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let reports = ["full", "1t", "avx2"].map(stored);
    let out = folder.path().join("study");
    let mut command = sapwise();
    command.arg("study").args(&reports).arg("--reference").arg(&reports[2]).arg("--machine").arg(&reports[1]);
    success(command.arg("--out").arg(&out));
    let ratios = rows(&out.join("tables/figure-10-11.csv"));
    assert!(ratios.iter().all(|r| r["machine"].contains("-1t--") && r["reference"].contains("-avx2--")), "{ratios:?}");
    let lanes = ratios.iter().find(|r| r["name"] == "simd_lanes").unwrap();
    assert_eq!(lanes["ratio"], "2");
    assert!(ratios.iter().any(|r| r["what"] == "speed-up" && !r["ratio_lower_quartile"].is_empty()));
}
