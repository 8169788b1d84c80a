//! `sapwise probe --profiles`: its list, its refusals, and how it continues.

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
    std::fs::write(folder.path().join("full.json"), "{}").unwrap();
    failure(&mut tiny(folder.path()), 1, &["full.json", "name another folder with --out"]);
}

#[cfg(all(unix, feature = "long-tests"))]
#[test]
fn after_an_interrupt_the_same_command_continues() {
    use common::{interrupt_when, program};
    use std::fs;
    let folder = tempfile::tempdir().unwrap();
    let until = |profile: &str| {
        let mut command = program();
        command.args(TINY).arg("--out").arg(folder.path());
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
    assert!(!success(tiny(folder.path()).arg("--dry-run")).contains("complete"));
    label("real_full");
    let before = fs::read(&full).unwrap();
    let lower =
        sapwise::algorithm::SimdLevel::ALL.into_iter().rev().find(|&l| l < sapwise::algorithm::SimdLevel::detected());
    let second = lower.map_or("full-again".to_owned(), |level| level.to_string());
    until(&format!("{second}.json"));
    assert_eq!(fs::read(&full).unwrap(), before, "a complete report was replaced");
    assert!(success(tiny(folder.path()).arg("--dry-run")).contains("complete"));
    // Another command must not replace the reports of this one.
    failure(tiny(folder.path()).args(["--seed", "2"]), 1, &["another command"]);
}
