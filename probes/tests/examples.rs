//! The examples of the help and the commands after "Next:", run as they are printed.
#![cfg(unix)]

mod common;

use common::{npy, sapwise, small_report, success};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Verbs whose examples take seconds. Those of the others measure for minutes: their words are only parsed.
const SHORT: [&str; 6] = ["check", "devices", "pairs", "schema", "study", "train"];

/// A folder with the files that examples name.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let put = |to: &str, content: &str| {
        let to = folder.path().join(to);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::write(to, content).unwrap();
    };
    let [a, b] = ["a", "b"].map(|machine| small_report(machine).to_string());
    for name in ["report.json", "this-machine.json", "other-machine.json", "elsewhere.json"] {
        put(name, &a);
    }
    for name in ["datasets", "reports"] {
        put(&format!("{name}/a.json"), &a);
        put(&format!("{name}/b.json"), &b);
    }
    for name in ["mine.json", "models/mine.json"] {
        put(name, include_str!("../../models/default.json"));
    }
    let boxes: Vec<f32> = (0..20).flat_map(|k| [k as f32, 0.0, 0.0, k as f32 + 1.0, 1.0, 1.0]).collect();
    npy(folder.path(), "boxes.npy", "<f4", "20, 6", &boxes);
    folder
}

/// Runs a line as a shell does, with the command in its path.
fn shell(line: &str, folder: &Path) -> Output {
    let program = assert_cmd::cargo::cargo_bin!("sapwise");
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap_or_default());
    let mut command = Command::new("sh");
    command.env("PATH", path).env_remove("SAPWISE_SIMD").env_remove("CARGO");
    command.args(["-c", line]).current_dir(folder).output().unwrap()
}

fn verb(line: &str) -> &str {
    line.split(' ').nth(1).unwrap_or_default()
}

/// Runs a line if it is short; otherwise only parses it, with `--help` after its words.
fn run(line: &str, folder: &Path) -> String {
    let is_short = SHORT.contains(&verb(line)) || line.starts_with("sapwise predict --report");
    let line =
        if is_short { line.to_owned() } else { format!("{} --help", line.split('#').next().unwrap_or_default()) };
    let ended = shell(&line, folder);
    let complaint = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(0), "{line}: {complaint}");
    String::from_utf8(ended.stdout).unwrap()
}

fn verbs() -> Vec<String> {
    let help = success(sapwise().arg("--help"));
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = list.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help").map(str::to_owned).collect()
}

/// `tools/results.sh predict` writes it anew, after a change of the model or of its sample.
#[test]
fn the_sample_of_the_readme_is_what_predict_prints() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let report = root.join("datasets/amd-epyc-zen3-2c/full.json");
    let text = success(sapwise().args(["predict", "--report"]).arg(report));
    let (sample, next) = text.split_once("Next: ").unwrap();
    assert_eq!(sample, fs::read_to_string(root.join("results/predict.txt")).unwrap());
    assert!(sample.lines().count() < 12 && sample.lines().all(|line| line.chars().count() <= 80), "{text}");
    assert!(next.starts_with("sapwise predict --report "), "{next}");
}

#[test]
fn every_example_and_every_next_command_works_as_printed() {
    let folder = folder();
    let verbs = verbs();
    assert!(verbs.len() == 9 && !verbs.contains(&"part".to_owned()), "{verbs:?}");
    for verb in verbs {
        let help = success(sapwise().args([&verb, "--help"]));
        let lines =
            help.lines().filter_map(|line| Some(&line[line.find("sapwise ")?..]).filter(|_| line.starts_with("  ")));
        let examples: Vec<&str> = lines.filter(|line| line.starts_with(&format!("sapwise {verb}"))).collect();
        assert!(!examples.is_empty(), "{verb} has no example: {help}");
        for example in examples {
            let text = run(example, folder.path());
            for next in text.lines().filter_map(|line| line.trim().strip_prefix("Next: ")) {
                assert!(next.starts_with("sapwise "), "{example}: {next}");
                run(next, folder.path());
            }
        }
    }
}
