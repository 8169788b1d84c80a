//! `sapwise probe` into a folder that nodes share, and `sapwise fleet`, which reads it.

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
    success(probe("qx-first", folder.path()).env("SAPWISE_NODE", "qx-first"));
    success(probe("qx-second", folder.path()).env("SAPWISE_NODE", "qx-second"));
    assert!(!fs::read_to_string(&files[0]).unwrap().contains("interrupted after"));
    assert_eq!(reports(folder.path()), files);
}

#[test]
fn a_fleet_is_told_in_a_table_with_whoever_failed_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let stored = format!("{}/../datasets/intel-xeon-2c-full--2026-11-23.json", env!("CARGO_MANIFEST_DIR"));
    let at = |name: &str| folder.path().join(name);
    for name in ["a.json", "b.json"] {
        fs::copy(&stored, at(name)).unwrap();
    }
    let fleet = || {
        let mut command = sapwise();
        command.arg("fleet").arg(folder.path());
        command
    };
    let told = success(fleet().args(["--nodes", "2"]));
    assert!(
        told.contains("2 of 2 nodes can be believed") && told.contains("Kind 1: ") && told.contains("1.00"),
        "{told}"
    );
    let told = failure_text(fleet().args(["--nodes", "3"]));
    assert!(told.contains("2 of 3 nodes can be believed; 1 left no report"), "{told}");
    let complaint = failure(fleet().arg(at("a.json")), 1);
    assert!(complaint.contains("a.json is given twice"), "{complaint}");
    change(&at("a.json"), |report| {
        let samples = report.points.iter_mut().flat_map(|p| &mut p.timings).flat_map(|t| &mut t.samples_ns);
        samples.for_each(|ns| *ns *= 2);
    });
    fs::write(at("c.json"), "{").unwrap();
    fs::write(at("d.json.unfinished"), "{").unwrap();
    let told = failure_text(&mut fleet());
    assert!(told.contains("1 of 4 nodes can be believed"), "{told}");
    assert!(told.contains("Next: measure on the others again, or take their files away"), "{told}");
    let row = |name: &str| {
        told.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {told}")).to_owned()
    };
    assert!(row("a.json").contains("slow: it takes 2.00"), "{told}");
    assert!(row("b.json").contains("good") && row("d.json.unfinished").contains("unfinished"), "{told}");
    assert!(row("c.json").contains("is no sound file"), "{told}");
    let json: serde_json::Value = serde_json::from_str(&failure_text(fleet().arg("--json"))).unwrap();
    assert_eq!(json["failed"].as_array().unwrap().len(), 2);
    assert_eq!(json["nodes"][0]["file"], "a.json");
    // The other one has nothing left to be held against.
    change(&at("b.json"), |report| report.label = sapwise_lab::report::Label::Simulated);
    let told = failure_text(&mut fleet());
    assert!(
        told.contains("1 of 4 nodes can be believed") && told.contains("simulated: made from a specification"),
        "{told}"
    );
    let missing =
        failure(sapwise().args(["probe", "--hardware-only", "--out"]).arg(format!("{}/", at("none").display())), 1);
    assert!(missing.contains("there is no such folder"), "{missing}");
    let nothing = tempfile::tempdir().unwrap();
    let complaint = failure(sapwise().arg("fleet").arg(nothing.path()), 1);
    assert!(complaint.contains("holds no *.json file"), "{complaint}");
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
    assert!(told.contains("2 tunings written") && told.contains("can be believed"), "{told}");
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
