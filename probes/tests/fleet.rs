//! `sapwise probe` into a folder that nodes share, and a tuning for each kind of node from it.

mod common;

use common::{failure, sapwise, success};
use std::fs;
use std::path::{Path, PathBuf};

/// What a node is asked to measure.
const TINY: [&str; 7] = ["probe", "--no-gpus", "--quick", "--scenario", "uniform", "--max-objects", "10"];

fn probe(node: &str, folder: &Path) -> assert_cmd::Command {
    let mut command = sapwise();
    command.env("SAPWISE_NODE", node).args(TINY).arg("--out").arg(folder);
    command
}

fn reports(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

fn change(path: &Path, change: impl FnOnce(&mut sapwise_lab::Report)) {
    let mut report = sapwise_lab::report::read(&fs::read_to_string(path).unwrap()).unwrap().value;
    change(&mut report);
    fs::write(path, sapwise_lab::report::write(&report).unwrap()).unwrap();
}

#[test]
fn nodes_put_their_reports_into_one_folder_and_go_on_where_they_stopped() {
    let folder = tempfile::tempdir().unwrap();
    success(&mut probe("qx-first", folder.path()));
    success(&mut probe("qx-second", folder.path()));
    let files = reports(folder.path());
    assert_eq!(files.len(), 2);
    for file in &files {
        let (name, text) = (file.file_name().unwrap().to_str().unwrap(), fs::read_to_string(file).unwrap());
        assert!(!name.contains("qx-") && !text.contains("qx-"), "{name}");
        // What other programs took meanwhile is not the subject.
        change(file, |report| report.label = sapwise_lab::report::Label::RealFull);
    }
    let before = fs::read(&files[0]).unwrap();
    for node in ["qx-first", "qx-second"] {
        let told = success(&mut probe(node, folder.path()));
        assert!(told.contains("is complete: nothing is measured"), "{told}");
    }
    assert_eq!(fs::read(&files[0]).unwrap(), before);
    let complaint = failure(probe("qx-first", folder.path()).args(["--seed", "7"]), 1);
    assert!(complaint.contains("was measured by `sapwise probe") && complaint.contains("--out"), "{complaint}");
    // One that was cut short is measured again.
    change(&files[0], |report| report.remarks.push("interrupted after 1 of 2 scenarios".to_owned()));
    success(&mut probe("qx-first", folder.path()));
    success(&mut probe("qx-second", folder.path()));
    assert!(!fs::read_to_string(&files[0]).unwrap().contains("interrupted after"));
    assert_eq!(reports(folder.path()), files);
}

/// The standard output of a command that tells a failure there.
fn failure_text(command: &mut assert_cmd::Command) -> String {
    let ended = command.assert().code(1);
    String::from_utf8(ended.get_output().stdout.clone()).unwrap()
}

#[test]
fn each_kind_of_machine_gets_a_tuning_that_a_program_picks_by_its_identity() {
    let [reports, tunings] = [(), ()].map(|()| tempfile::tempdir().unwrap());
    for node in ["a", "b"] {
        // Four sizes: curves of a measured tuning need three points, which two sizes had only where there was time to visit one again.
        let sizes = ["--max-objects", "60", "--out"];
        success(sapwise().env("SAPWISE_NODE", node).args(&TINY[..5]).args(sizes).arg(reports.path()));
    }
    for file in self::reports(reports.path()) {
        change(&file, |report| report.label = sapwise_lab::report::Label::RealFull);
    }
    // A larger machine of another make, and one that was not left alone.
    let first = &self::reports(reports.path())[0];
    for (name, id, label) in [
        ("large.json", "1", sapwise_lab::report::Label::RealFull),
        ("shared.json", "2", sapwise_lab::report::Label::RealContended),
    ] {
        let file = reports.path().join(name);
        fs::copy(first, &file).unwrap();
        change(&file, |report| {
            report.hardware.machine.physical_id = id.repeat(16);
            report.label = label;
        });
    }
    let out = tunings.path().join("made");
    let predict = |more: &[&str]| {
        let mut command = sapwise();
        command.args(["predict", "--no-gpus", "--report"]).arg(reports.path()).args(more);
        command
    };
    let told = failure_text(predict(&["--out"]).arg(&out));
    assert!(told.contains("2 tunings written") && told.contains("were cut short or disturbed"), "{told}");
    let machine = sapwise::measure::machine();
    let own = out.join(machine.tuning_file(sapwise::usable_cores(), &[]));
    let tuning = sapwise::json::tuning(&fs::read_to_string(&own).unwrap()).unwrap();
    assert_eq!(tuning.source, sapwise::Source::Predicted);
    assert_eq!(fs::read_dir(&out).unwrap().count(), 2);
    fs::remove_file(reports.path().join("shared.json")).unwrap();
    success(predict(&["--measured", "--out"]).arg(&out));
    let tuning = sapwise::json::tuning(&fs::read_to_string(&own).unwrap()).unwrap();
    assert_eq!(tuning.source, sapwise::Source::Measured);
    let complaint = failure(&mut predict(&[]), 2);
    assert!(complaint.contains("--out"), "{complaint}");
    let complaint = failure(predict(&["--out"]).arg(reports.path()), 2);
    assert!(complaint.contains("holds the reports"), "{complaint}");
}
