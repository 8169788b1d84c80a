//! `sapwise study` on stored reports.

mod common;

use common::{answer, sapwise};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn dataset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets").join(name)
}

#[test]
fn a_study_has_a_page_with_figures_and_tidy_tables() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("study");
    let reports = [dataset("intel-xeon-16c/4t.json"), dataset("published")];
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
