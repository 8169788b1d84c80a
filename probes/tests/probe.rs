//! `sapwise probe`: reports that read back, interrupts, disks that fail, and the profiles of a machine.

mod common;

use common::{failure, sapwise, success};
#[cfg(all(unix, feature = "long-tests"))]
use common::{interrupt_when, program, send};
use sapwise_lab::report::Report;
use sapwise_tune::ParameterId;
use std::fs;
use std::path::Path;

/// A sweep of one scenario with two sizes.
const TINY: [&str; 5] = ["probe", "--scenario", "uniform", "--max-objects", "20"];

fn read(path: &Path) -> Report {
    sapwise_lab::report::read(&fs::read_to_string(path).unwrap()).unwrap().value
}

#[test]
fn a_probe_writes_a_report_that_reads_back_with_every_parameter_and_point() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report.json");
    let text = success(sapwise().args(TINY).args(["--seed", "9", "--out"]).arg(&out));
    assert!(text.contains("usable_cores") && text.contains("uniform") && text.contains("Next:"), "{text}");
    let report = read(&out);
    let names: Vec<&str> = report.hardware.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ParameterId::ALL);
    // Sizes with similar times are visited again after the ascent, and so is a size between them.
    let sizes: Vec<u32> = report.points.iter().map(|p| p.load.objects).collect();
    assert!(sizes[..2] == [10, 20] && sizes.iter().all(|n| (10..=20).contains(n)), "{sizes:?}");
    assert!(report.points.iter().all(|p| p.timings.iter().all(|t| t.samples_ns.len() >= 3)));
    assert_eq!(report.provenance.command, "probe --seed 9 --max-objects 20 --scenario uniform");
    assert_eq!(report.provenance.seed, 9);
    // Only the remarks of a machine that other programs use.
    assert_eq!(report.remarks, report.hardware.disturbed());
    assert_eq!(report.provenance.optimised, !cfg!(debug_assertions));
    // One point a line, so that a report can be read and compared by people.
    let lines = fs::read_to_string(&out).unwrap();
    let points = lines.lines().filter(|l| l.trim_start().starts_with("{\"scenario\"")).count();
    assert_eq!(points, report.points.len());
    success(sapwise().arg("check").arg(&out));
}

#[cfg(feature = "long-tests")]
#[test]
fn json_alone_writes_no_file_and_the_default_is_report_json() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = sapwise();
    command.current_dir(folder.path()).args(TINY).args(["--threads", "1", "--json"]);
    let report = sapwise_lab::report::read(&success(&mut command)).unwrap().value;
    assert_eq!(report.provenance.threads, Some(1));
    assert!(report.algorithms.iter().all(|t| t.id.threads() == 1), "{:?}", report.algorithms);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    success(sapwise().current_dir(folder.path()).args(["probe", "--hardware-only"]));
    let report = read(&folder.path().join("report.json"));
    assert!(report.points.is_empty() && report.algorithms.is_empty());
}

#[test]
fn a_folder_that_takes_no_file_is_told_before_measuring() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    failure(sapwise().args(TINY).arg("--out").arg(file.join("report.json")), 1, &["name another"]);
    fs::create_dir(folder.path().join("report.json")).unwrap();
    failure(sapwise().current_dir(folder.path()).args(TINY), 1, &["--out", "report.json is a folder"]);
}

#[cfg(all(target_os = "linux", feature = "long-tests"))]
#[test]
fn a_full_disk_keeps_the_report_in_the_folder_for_temporary_files() {
    let folder = tempfile::tempdir().unwrap();
    let complaint =
        failure(sapwise().env("TMPDIR", folder.path()).args(TINY).args(["--out", "/dev/full"]), 1, &["/dev/full"]);
    let kept: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(kept.len(), 1, "{kept:?}");
    assert!(complaint.contains(&*kept[0].to_string_lossy()), "{complaint}");
    assert!(read(&kept[0]).points.len() >= 2);
}

#[cfg(all(unix, feature = "long-tests"))]
#[test]
fn an_interrupt_keeps_what_was_measured_and_leaves_a_report_that_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report.json");
    let beside = folder.path().join("report.json.unfinished");
    for (before, kept) in [(None, &out), (Some("hours of measuring"), &beside)] {
        if let Some(text) = before {
            fs::write(&out, text).unwrap();
        }
        let mut probe = program();
        probe.args(["probe", "--max-objects", "30"]).arg("--out").arg(&out);
        for scenario in sapwise_scenes::Scenario::ALL {
            probe.args(["--scenario", scenario.as_str()]);
        }
        let holds = format!("error: interrupted: {} holds", kept.display());
        interrupt_when(&mut probe, || out.with_added_extension("unfinished").exists(), &holds);
        let report = read(kept);
        assert!(!report.points.is_empty());
        assert!(report.remarks.iter().any(|r| r.starts_with("interrupted after ")), "{:?}", report.remarks);
        assert!(!report.remarks.iter().any(|r| r.starts_with("unfinished")), "{:?}", report.remarks);
        if let Some(text) = before {
            assert_eq!(fs::read_to_string(&out).unwrap(), text);
        }
        let files = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(files, 1 + usize::from(before.is_some()), "a temporary file is left");
    }
}

/// As `nohup` starts it.
#[cfg(all(unix, feature = "long-tests"))]
#[test]
fn a_signal_that_it_was_started_to_ignore_is_ignored() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report.json");
    let ready = folder.path().join("ready");
    let mut probe = std::process::Command::new("sh");
    probe.args(["-c", "trap '' HUP; : > \"$READY\"; exec \"$@\"", "sh"]).env("READY", &ready);
    probe.arg(assert_cmd::cargo::cargo_bin!("sapwise"));
    let mut probe = probe.args(TINY).arg("--out").arg(&out).stdout(std::process::Stdio::null()).spawn().unwrap();
    while !ready.exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    // Until it has written its report it measures for seconds, and catches signals all the time.
    while !out.exists() {
        send("-HUP", &probe);
        assert!(probe.try_wait().unwrap().is_none_or(|ended| ended.success()), "it was ended");
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    assert!(probe.wait().unwrap().success());
    assert!(read(&out).points.len() >= 2);
}

/// The profiles of a sweep of one scenario with one size.
const PROFILES: [&str; 8] =
    ["probe", "--profiles", "--quick", "--no-gpus", "--scenario", "uniform", "--max-objects", "10"];

fn profiles(folder: &Path) -> assert_cmd::Command {
    let mut command = sapwise();
    command.args(PROFILES).arg("--out").arg(folder);
    command
}

#[test]
fn a_dry_run_lists_the_profiles_and_leaves_no_trace() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("reports");
    let text = success(profiles(&out).arg("--dry-run"));
    assert!(text.contains("\nfull ") && text.contains("\nfull-again ") && text.contains("at most"), "{text}");
    let several = sapwise::algorithm::usable_cores() > 1;
    assert_eq!((text.contains("\n1t "), text.contains("\n1t-again ")), (several, several), "{text}");
    assert!(!out.exists());
}

#[test]
fn what_the_profiles_set_themselves_is_wrong_usage() {
    for other in ["--threads=1", "--hardware-only", "--json"] {
        failure(sapwise().args(["probe", "--profiles", other]), 2, &["--profiles", "cannot be used"]);
    }
    failure(
        sapwise().args(["probe", "--profiles", "--dry-run"]).env("SAPWISE_SIMD", "portable"),
        2,
        &["--profiles sets SAPWISE_SIMD itself"],
    );
    failure(sapwise().args(["probe", "--dry-run"]), 2, &["--profiles"]);
}

#[test]
fn a_file_that_is_no_report_is_never_replaced() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("full.json"), "{}").unwrap();
    failure(&mut profiles(folder.path()), 1, &["full.json", "name another folder with --out"]);
}

#[cfg(all(unix, feature = "long-tests"))]
#[test]
fn after_an_interrupt_the_same_command_continues() {
    use sapwise::algorithm::SimdLevel;
    let folder = tempfile::tempdir().unwrap();
    let until = |profile: &str| {
        let mut command = program();
        command.args(PROFILES).arg("--out").arg(folder.path());
        let complete = || fs::read_to_string(folder.path().join(profile)).is_ok_and(|t| !t.contains("interrupted "));
        interrupt_when(&mut command, complete, "the same command continues");
    };
    until("full.json");
    let full = folder.path().join("full.json");
    // The label must not depend on programs that run beside this test.
    let label = |label: &str| {
        let mut report: serde_json::Value = serde_json::from_str(&fs::read_to_string(&full).unwrap()).unwrap();
        report["label"] = label.into();
        fs::write(&full, report.to_string()).unwrap();
    };
    label("real_contended");
    assert!(!success(profiles(folder.path()).arg("--dry-run")).contains("complete"));
    label("real_full");
    let before = fs::read(&full).unwrap();
    let lower = SimdLevel::ALL.into_iter().rev().find(|&level| level < SimdLevel::detected());
    let second = lower.map_or("full-again".to_owned(), |level| level.to_string());
    until(&format!("{second}.json"));
    assert_eq!(fs::read(&full).unwrap(), before, "a complete report was replaced");
    assert!(success(profiles(folder.path()).arg("--dry-run")).contains("complete"));
    // Another command must not replace the reports of this one.
    failure(profiles(folder.path()).args(["--seed", "2"]), 1, &["another command"]);
}
