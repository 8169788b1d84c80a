//! The output on a terminal and through a pipe.

mod common;

use common::{sapwise, small_report, success};
use std::fs;
#[cfg(target_os = "linux")]
use std::process::Command;

/// Returns what the prediction for a report shows on a terminal of a width. `None`, with a line that says so, without
/// the program `script`, which makes a terminal.
#[cfg(target_os = "linux")]
fn on_a_terminal(columns: u32, variables: &[(&str, &str)]) -> Option<String> {
    let quoted = |text: &str| format!("'{text}'");
    let program = quoted(&assert_cmd::cargo::cargo_bin!("sapwise").display().to_string());
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report.json");
    fs::write(&report, small_report("a").to_string()).unwrap();
    let report = quoted(&report.display().to_string());
    let mut command = Command::new("script");
    for name in ["NO_COLOR", "LC_ALL", "LC_CTYPE", "SAPWISE_SIMD"] {
        command.env_remove(name);
    }
    command.env("TERM", "xterm-256color").env("LANG", "C.UTF-8").envs(variables.iter().copied());
    // Without the progress, which a slow machine shows.
    let line = format!("stty rows 40 cols {columns} && {program} predict --no-gpus --report {report} 2>/dev/null");
    match command.args(["-qec", &line, "/dev/null"]).output() {
        Ok(ended) => {
            let text = String::from_utf8(ended.stdout).unwrap();
            assert!(ended.status.success(), "{text}");
            Some(text.replace('\r', ""))
        }
        Err(why) => {
            eprintln!("nothing is looked at on a terminal: script: {why}");
            None
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_terminal_has_bold_heads_and_may_refuse_colours() {
    let Some(text) = on_a_terminal(100, &[]) else { return };
    assert!(text.contains("\u{1b}[1mFastest by number of objects") && text.contains("\nNext: "), "{text}");
    for (name, value) in [("NO_COLOR", "1"), ("TERM", "dumb")] {
        let Some(text) = on_a_terminal(100, &[(name, value)]) else { return };
        assert!(!text.contains('\u{1b}') && text.contains("\nNext: "), "{name}: {text}");
    }
    let coloured = on_a_terminal(100, &[("NO_COLOR", "")]).unwrap();
    assert!(coloured.contains('\u{1b}'), "{coloured}");
}

#[test]
fn a_pipe_gets_no_colours() {
    let mut command = sapwise();
    command.env("TERM", "xterm-256color").env("CLICOLOR_FORCE", "1").env("LANG", "C.UTF-8");
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report.json");
    fs::write(&report, small_report("a").to_string()).unwrap();
    let text = success(command.args(["predict", "--no-gpus", "--report"]).arg(report));
    assert!(!text.contains('\u{1b}'), "{text}");
    assert!(text.contains("\nNext: "), "{text}");
}
