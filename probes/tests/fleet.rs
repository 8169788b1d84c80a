//! `sapwise probe` into a folder that nodes share, and a tuning for each kind of node from it.

mod common;

use common::{failure, output, sapwise, small_report, success};
use sapwise::tuning::Source;
use sapwise_lab::report::Label;
use std::fs;
use std::path::{Path, PathBuf};

/// The probe of a node.
const TINY: [&str; 7] = ["probe", "--no-gpus", "--quick", "--scenario", "uniform", "--max-objects", "10"];

fn probe(node: &str, folder: &Path) -> assert_cmd::Command {
    let mut command = sapwise();
    command.env("SAPWISE_NODE", node).args(TINY).arg("--out").arg(folder);
    command
}

fn change(path: &Path, change: impl FnOnce(&mut sapwise_lab::Report)) {
    let mut report = sapwise_lab::report::read(&fs::read_to_string(path).unwrap()).unwrap().value;
    change(&mut report);
    fs::write(path, sapwise_lab::report::write(&report).unwrap()).unwrap();
}

#[test]
fn a_node_measures_once_into_a_shared_folder_and_again_what_was_cut_short() {
    let folder = tempfile::tempdir().unwrap();
    success(&mut probe("qx-first", folder.path()));
    let files: Vec<PathBuf> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    let [file] = &files[..] else { panic!("not one report") };
    let (name, text) = (file.file_name().unwrap().to_str().unwrap(), fs::read_to_string(file).unwrap());
    assert!(!name.contains("qx-") && !text.contains("qx-"), "{name}");
    // Other programs may have disturbed it, which is not the subject.
    change(file, |report| report.label = Label::RealFull);
    let complete = fs::read(file).unwrap();
    let told = success(&mut probe("qx-first", folder.path()));
    assert!(told.contains("is complete: nothing is measured"), "{told}");
    failure(probe("qx-first", folder.path()).args(["--seed", "7"]), 1, &["was measured by `sapwise probe", "--out"]);
    assert_eq!(fs::read(file).unwrap(), complete);
    change(file, |report| report.remarks.push("interrupted after 1 of 2 scenarios".to_owned()));
    success(&mut probe("qx-first", folder.path()));
    assert!(!fs::read_to_string(file).unwrap().contains("interrupted after"));
    let missing = format!("{}/none/", folder.path().display());
    failure(sapwise().args(["probe", "--hardware-only", "--out", &missing]), 1, &["there is no such folder"]);
}

#[test]
fn each_kind_of_machine_gets_a_tuning_by_its_identity() {
    let [reports, tunings] = [(), ()].map(|()| tempfile::tempdir().unwrap());
    // Two of one kind, one of another, and one that was disturbed.
    for (name, machine) in [("first.json", "a"), ("second.json", "a"), ("other.json", "b"), ("shared.json", "c")] {
        fs::write(reports.path().join(name), small_report(machine).to_string()).unwrap();
    }
    change(&reports.path().join("shared.json"), |report| report.label = Label::RealContended);
    let out = tunings.path().join("made");
    let predict = |more: &[&str]| {
        let mut command = sapwise();
        command.args(["predict", "--no-gpus", "--report"]).arg(reports.path()).args(more);
        command
    };
    let told = output(predict(&["--out"]).arg(&out), 1);
    assert!(told.contains("2 tunings written") && told.contains("no tuning: other programs disturbed it"), "{told}");
    let first = fs::read_to_string(reports.path().join("first.json")).unwrap();
    let first = sapwise_lab::report::read(&first).unwrap().value;
    let own = out.join(first.hardware.machine.tuning_file(2, &[]));
    let source = || sapwise_tune::json::tuning(&fs::read_to_string(&own).unwrap()).unwrap().source;
    assert_eq!(source(), Source::Predicted);
    assert_eq!(fs::read_dir(&out).unwrap().count(), 2);
    fs::remove_file(reports.path().join("shared.json")).unwrap();
    success(predict(&["--measured", "--out"]).arg(&out));
    assert_eq!(source(), Source::Measured);
    let nowhere = tunings.path().join("nowhere");
    for name in ["first.json", "second.json", "other.json"] {
        change(&reports.path().join(name), |report| report.label = Label::Published);
    }
    failure(predict(&["--out"]).arg(&nowhere), 1, &["published parameters only"]);
    assert!(!nowhere.exists());
    failure(&mut predict(&[]), 2, &["--out"]);
    failure(predict(&["--out"]).arg(reports.path()), 2, &["holds the reports"]);
    failure(predict(&["--out"]).arg(reports.path().join("new/tunings")), 2, &["holds the reports"]);
}
