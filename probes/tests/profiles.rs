//! `sapwise probe --profiles`: what it lists, how it goes on, and the proof in its reports.

mod common;

#[cfg(unix)]
use common::{TERMINATED, send};
use common::{failure, sapwise, success};
use sapwise_lab::Report;
use sapwise_lab::report::Restricted;
use std::fs;
use std::path::Path;
#[cfg(unix)]
use std::path::PathBuf;

const TINY: [&str; 8] = ["probe", "--profiles", "--quick", "--no-gpus", "--scenario", "uniform", "--max-objects", "10"];

fn tiny(folder: &Path) -> assert_cmd::Command {
    let mut command = sapwise();
    command.env_remove("LP_NUM_THREADS").args(TINY).arg("--out").arg(folder);
    command
}

/// The reports in a folder whose names end with a profile's.
#[cfg(unix)]
fn reports(folder: &Path, profile: &str) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let of = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        name.ends_with(".json")
            && name.split_once("--").is_some_and(|(stem, _)| stem.ends_with(&format!("c-{profile}")))
    };
    entries.map(|e| e.unwrap().path()).filter(of).collect()
}

fn read(path: &Path) -> Report {
    sapwise_lab::report::read(&fs::read_to_string(path).unwrap()).unwrap().value
}

#[test]
fn a_dry_run_lists_the_profiles_and_leaves_no_trace() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("reports");
    let text = success(tiny(&out).arg("--dry-run"));
    for name in ["c-full ", "c-memory ", "c-cache "] {
        assert!(text.contains(name), "{name} is not in {text}");
    }
    assert_eq!(text.contains("c-1t "), sapwise::usable_cores() > 1, "{text}");
    assert!(text.contains("--contended=cache") && text.contains("at most."), "{text}");
    assert!(!out.exists());
}

#[test]
fn what_the_family_sets_itself_is_wrong_usage() {
    for other in ["--threads=1", "--contended", "--hardware-only", "--json"] {
        let complaint = failure(sapwise().args(["probe", "--profiles", other]), 2);
        assert!(complaint.contains("--profiles") && complaint.contains("cannot be used"), "{complaint}");
    }
    for name in ["SAPWISE_SIMD", "LP_NUM_THREADS"] {
        let value = if name == "SAPWISE_SIMD" { "portable" } else { "1" };
        let complaint = failure(sapwise().args(["probe", "--profiles", "--dry-run"]).env(name, value), 2);
        assert!(complaint.contains(&format!("--profiles sets {name} itself")), "{complaint}");
    }
    assert!(failure(sapwise().args(["probe", "--dry-run"]), 2).contains("--profiles"));
    let complaint = failure(sapwise().args(["probe", "--profiles", "--scenario", "nowhere"]), 2);
    assert!(complaint.contains("nowhere"), "{complaint}");
}

#[test]
fn a_restriction_is_proven_against_the_report_without_it_and_one_that_does_not_show_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole.json");
    let out = folder.path().join("contended.json");
    let probe = |out: &Path| {
        let mut command = sapwise();
        command.args(["probe", "--no-gpus", "--hardware-only", "--out"]).arg(out);
        command
    };
    success(&mut probe(&whole));
    // A machine without any bandwidth, beside which nothing shows.
    let mut idle: serde_json::Value = serde_json::from_str(&fs::read_to_string(&whole).unwrap()).unwrap();
    for parameter in idle["hardware"]["parameters"].as_array_mut().unwrap() {
        let name = parameter["name"].as_str().unwrap().to_owned();
        // A value that does not follow from its samples would be refused.
        parameter.as_object_mut().unwrap().remove("raw");
        if name.starts_with("bandwidth_all") {
            parameter["value"] = 1e-9.into();
        } else if name.starts_with("latency_") {
            parameter["value"] = 1e9.into();
        }
    }
    let idle_path = folder.path().join("idle.json");
    fs::write(&idle_path, idle.to_string()).unwrap();
    let lifted = |path: &Path| format!("--unrestricted=contended_memory={}", path.display());
    let text = success(probe(&out).args(["--contended", &lifted(&idle_path)]));
    assert!(text.contains("remark: the restriction contended_memory does not show"), "{text}");
    let restriction = read(&out).provenance.restriction.unwrap();
    assert_eq!(restriction.kinds, [Restricted::ContendedMemory]);
    assert!(!restriction.proof[0].shows && restriction.proof[0].without == Some(1e-9), "{restriction:?}");
    let told = success(sapwise().arg("check").arg(&out));
    assert!(told.contains("note: the restriction contended_memory does not show"), "{told}");
    // And one beside which everything does.
    idle["hardware"]["parameters"].as_array_mut().unwrap().iter_mut().for_each(|p| {
        if p["name"].as_str().unwrap().starts_with("bandwidth_all") {
            p["value"] = 1e9.into();
        }
    });
    fs::write(&idle_path, idle.to_string()).unwrap();
    let text = success(probe(&out).args(["--contended", &lifted(&idle_path)]));
    assert!(!text.contains("does not show"), "{text}");
    let report = read(&out);
    assert!(report.provenance.restriction.unwrap().proof[0].shows);
    assert_eq!(read(&whole).provenance.restriction, None);
}

#[cfg(unix)]
#[test]
fn after_an_interrupt_the_same_command_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("reports");
    let until = |profile: &str| {
        let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("sapwise"));
        command.env_remove("SAPWISE_SIMD").env_remove("LP_NUM_THREADS").args(TINY).arg("--out").arg(&out);
        let mut family =
            command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
        while reports(&out, profile).is_empty() {
            assert_eq!(family.try_wait().unwrap(), None, "it ended before {profile} was there");
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        send("-TERM", &family);
        let ended = family.wait_with_output().unwrap();
        let complaint = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert_eq!(ended.status.code(), Some(TERMINATED), "{complaint}");
        assert!(complaint.contains("the same command resumes there"), "{complaint}");
        String::from_utf8_lossy(&ended.stdout).into_owned()
    };
    let text = until("full");
    assert!(text.contains("not measured yet"), "{text}");
    let full = reports(&out, "full");
    // Whatever else runs beside this test must not decide whether the report is one that other programs disturbed.
    let label = |label: &str| {
        let mut report: serde_json::Value = serde_json::from_str(&fs::read_to_string(&full[0]).unwrap()).unwrap();
        report["label"] = label.into();
        fs::write(&full[0], report.to_string()).unwrap();
    };
    label("real_contended");
    let listed = success(tiny(&out).arg("--dry-run"));
    assert!(!listed.contains("complete"), "{listed}");
    label("real_full");
    let before = fs::read(&full[0]).unwrap();
    assert_eq!(read(&full[0]).provenance.restriction, None);
    // Whichever is the second on this machine.
    let simd = sapwise::SimdLevel::ALL.into_iter().rev().find(|&l| l < sapwise::SimdLevel::detected());
    let second =
        simd.map(|l| l.to_string()).unwrap_or(if sapwise::usable_cores() > 1 { "1t" } else { "memory" }.to_owned());
    if simd.is_none() && sapwise::usable_cores() > 2 {
        eprintln!("skipped: the second profile has another name here");
        return;
    }
    let text = until(&second);
    assert!(text.contains("was complete"), "{text}");
    assert_eq!(fs::read(&full[0]).unwrap(), before, "a report that was there is another now");
    let restricted = read(&reports(&out, &second)[0]);
    let restriction = restricted.provenance.restriction.unwrap();
    assert!(restriction.proof.iter().any(|p| p.kind == restriction.kinds[0]), "{restriction:?}");
    let listed = success(tiny(&out).arg("--dry-run"));
    assert!(listed.contains("complete"), "{listed}");
    // What was measured by another command is not what is asked for.
    let listed = success(tiny(&out).args(["--seed", "2", "--dry-run"]));
    assert!(!listed.contains("complete"), "{listed}");
}
