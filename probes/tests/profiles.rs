//! `sapwise probe --profiles`: what it lists, what it refuses, and how it continues.

mod common;

use common::{failure, sapwise, success};
use std::path::Path;

const TINY: [&str; 8] = ["probe", "--profiles", "--quick", "--no-gpus", "--scenario", "uniform", "--max-objects", "10"];

fn tiny(folder: &Path) -> assert_cmd::Command {
    let mut command = sapwise();
    command.args(TINY).arg("--out").arg(folder);
    command
}

#[test]
fn a_dry_run_lists_the_profiles_and_leaves_no_trace() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("reports");
    let text = success(tiny(&out).arg("--dry-run"));
    assert!(text.contains("\nfull ") && text.contains("\nfull-again ") && text.contains("at most"), "{text}");
    let several = sapwise::algorithm::usable_cores() > 1;
    assert_eq!((text.contains("\n1t "), text.contains("\n1t-again ")), (several, several), "{text}");
    assert!(!out.exists());
}

#[test]
fn what_the_profiles_set_themselves_is_wrong_usage() {
    for other in ["--threads=1", "--hardware-only", "--json"] {
        let complaint = failure(sapwise().args(["probe", "--profiles", other]), 2);
        assert!(complaint.contains("--profiles") && complaint.contains("cannot be used"), "{complaint}");
    }
    let complaint = failure(sapwise().args(["probe", "--profiles", "--dry-run"]).env("SAPWISE_SIMD", "portable"), 2);
    assert!(complaint.contains("--profiles sets SAPWISE_SIMD itself"), "{complaint}");
    assert!(failure(sapwise().args(["probe", "--dry-run"]), 2).contains("--profiles"));
}

#[test]
fn a_file_that_is_no_report_is_never_replaced() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("full.json"), "{}").unwrap();
    let complaint = failure(&mut tiny(folder.path()), 1);
    assert!(complaint.contains("full.json") && complaint.contains("name another folder with --out"), "{complaint}");
}

#[cfg(all(unix, feature = "long-tests"))]
#[test]
fn after_an_interrupt_the_same_command_continues() {
    use common::{TERMINATED, program, send};
    use std::fs;
    let folder = tempfile::tempdir().unwrap();
    let until = |profile: &str| {
        let mut command = program();
        command.args(TINY).arg("--out").arg(folder.path());
        let mut family = command.stderr(std::process::Stdio::piped()).spawn().unwrap();
        let complete = || fs::read_to_string(folder.path().join(profile)).is_ok_and(|t| !t.contains("interrupted "));
        while !complete() {
            assert_eq!(family.try_wait().unwrap(), None, "it ended before {profile} was there");
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        send("-TERM", &family);
        let ended = family.wait_with_output().unwrap();
        let complaint = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert_eq!(ended.status.code(), Some(TERMINATED), "{complaint}");
        assert!(complaint.contains("the same command continues"), "{complaint}");
    };
    until("full.json");
    let full = folder.path().join("full.json");
    // Whatever else runs beside this test must not decide whether other programs disturbed the report.
    let label = |label: &str| {
        let mut report: serde_json::Value = serde_json::from_str(&fs::read_to_string(&full).unwrap()).unwrap();
        report["label"] = label.into();
        fs::write(&full, report.to_string()).unwrap();
    };
    label("real_contended");
    assert!(!success(tiny(folder.path()).arg("--dry-run")).contains("complete"));
    label("real_full");
    let before = fs::read(&full).unwrap();
    let lower =
        sapwise::algorithm::SimdLevel::ALL.into_iter().rev().find(|&l| l < sapwise::algorithm::SimdLevel::detected());
    let second = lower.map_or("full-again".to_owned(), |level| level.to_string());
    until(&format!("{second}.json"));
    assert_eq!(fs::read(&full).unwrap(), before, "a complete report was replaced");
    assert!(success(tiny(folder.path()).arg("--dry-run")).contains("complete"));
    // Another command must not replace what this one has measured.
    let complaint = failure(tiny(folder.path()).args(["--seed", "2"]), 1);
    assert!(complaint.contains("another command"), "{complaint}");
}
