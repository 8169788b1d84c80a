//! `sapwise convert` on files of the first release.

mod common;

use common::{failure, sapwise, success};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn old(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/lab/tests/fixtures/old").join(name)
}

#[test]
fn old_files_are_refused_by_the_name_of_the_verb_and_sound_once_converted() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new");
    for name in ["report-1.json", "tuning-1.json", "fields-1.json"] {
        let refused = sapwise().arg("check").arg(old(name)).output().unwrap();
        let told = String::from_utf8(refused.stdout).unwrap();
        assert!(
            refused.status.code() == Some(1) && told.contains("sapwise convert FILE... --out DIR"),
            "{name}: {told}"
        );
    }
    let files = ["report-1.json", "tuning-1.json", "fields-1.json"].map(old);
    let told = success(sapwise().arg("convert").args(files).arg("--out").arg(&out));
    assert!(told.contains("report/2 in ") && told.contains("left out: correction: "), "{told}");
    for (name, schema) in [("report-1.json", "report/2"), ("tuning-1.json", "tuning/2"), ("fields-1.json", "tuning/2")]
    {
        let answer = sapwise().args(["check", "--json"]).arg(out.join(name)).output().unwrap().stdout;
        let answer: Value = serde_json::from_slice(&answer).unwrap();
        assert_eq!(answer["files"][0]["schema"], schema, "{answer}");
    }
}

#[test]
fn what_is_not_converted_is_told_and_nothing_is_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("fields-1.json");
    fs::copy(old("fields-1.json"), &copy).unwrap();
    // The folder of the file itself.
    let told = failure(sapwise().arg("convert").arg(&copy).arg("--out").arg(folder.path()), 2);
    assert!(told.contains("is a file that is read"), "{told}");
    // The same name twice.
    failure(
        sapwise().arg("convert").args([&copy, &old("fields-1.json")]).arg("--out").arg(folder.path().join("new")),
        2,
    );
    let (first, second) = (folder.path().join("first"), folder.path().join("second"));
    success(sapwise().arg("convert").arg(&copy).arg("--out").arg(&first));
    let mut again = sapwise();
    let again = again.args(["convert", "--json"]).arg(first.join("fields-1.json")).arg(old("report-1-cut.json"));
    let again = again.arg("--out").arg(&second).output().unwrap();
    assert_eq!(again.status.code(), Some(1));
    let answer: Value = serde_json::from_slice(&again.stdout).unwrap();
    let problem = |k: usize| answer["files"][k]["problem"].as_str().unwrap_or_default().to_owned();
    assert!(problem(0).contains("tuning/2 already") && problem(1).contains("no JSON"), "{answer}");
    assert_eq!(fs::read_dir(&second).unwrap().count(), 0);
}
