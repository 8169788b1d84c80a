//! `tools/reference/regret.py`, which shares no code with this crate, finds the same regrets.

use super::*;
use crate::evaluate::SINGLE_BEST;
use crate::evaluate::scores::{OURS, RUNNING};
use crate::progress::Silent;
use crate::synthetic::Machine;
use crate::training::Regrets;
use crate::{report, without};
use sapwise::algorithm::BackendClass;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Returns the output of the script: the numbers of each line, by its first word. `None` without Python, which
/// `SAPWISE_REQUIRE_PYTHON=1` forbids.
fn printed(folder: &Path, first: &str, files: &[String]) -> Option<BTreeMap<String, Vec<f64>>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tools/reference/regret.py");
    let mut python = Command::new("python3");
    python.arg(script).arg(first).args(files).current_dir(folder);
    let output = match python.output() {
        Ok(output) => output,
        Err(why) => {
            let required = std::env::var("SAPWISE_REQUIRE_PYTHON").is_ok_and(|v| v == "1");
            assert!(!required, "SAPWISE_REQUIRE_PYTHON=1, and python3 can't be run: {why}");
            println!("not compared: python3 can't be run: {why}");
            return None;
        }
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let row = |line: &str| {
        let (name, numbers) = line.split_once(' ').unwrap();
        let numbers = numbers.split(|c: char| c.is_whitespace() || "()".contains(c));
        (name.to_owned(), numbers.filter_map(|n| n.parse().ok()).collect())
    };
    Some(text.lines().map(row).collect())
}

fn agree(what: &str, percent: &[f64], regrets: &[Regrets], within: f64) {
    let ours: Vec<f64> = regrets.iter().flat_map(|r| [100.0 * r.all, 100.0 * r.in_games]).collect();
    let same = percent.len() == ours.len() && percent.iter().zip(&ours).all(|(a, b)| (a - b).abs() < within);
    assert!(same, "{what}: {percent:?} in Python, {ours:?} here");
}

#[test]
fn a_second_implementation_finds_the_same_regrets() {
    let folder = tempfile::tempdir().unwrap();
    let mut machines = Machine::family();
    machines.truncate(4);
    machines[2].gpus = Machine::family_with_gpus()[2].gpus.clone();
    let (mut files, mut profiles) = (Vec::new(), Vec::new());
    for machine in &machines {
        let file = format!("{}/full.json", machine.name);
        std::fs::create_dir(folder.path().join(machine.name)).unwrap();
        std::fs::write(folder.path().join(&file), report::write(&machine.report()).unwrap()).unwrap();
        profiles.push(Profile::of(&file, &machine.report()));
        files.push(file);
    }
    let found = validate(&profiles, &Designs::new(&profiles), &Partition::new(&profiles), &Silent).unwrap();
    let of = |strategy: &str, unit: &str| {
        found.held_out.regrets.iter().find(|r| r.strategy == strategy && r.unit == unit).unwrap()
    };
    let Some(fixed) = printed(folder.path(), "--fixed", &files) else { return };
    for machine in &machines {
        let known = of(SINGLE_BEST, machine.name);
        agree(machine.name, &fixed[machine.name], &[known.seen, known.unseen.unwrap()], 2e-3);
    }

    // The GPU of the third machine is left out by the script, and by the validation, which knows no other one.
    let tunings = folder.path().join("tunings");
    for (profile, machine) in profiles.iter().zip(&machines) {
        let model = without(&profiles, &profile.file).unwrap().0;
        let on_cpu: Vec<_> =
            profile.available().into_iter().filter(|id| id.backend().class() == BackendClass::Cpu).collect();
        let tuning = model.predict(&profile.hardware, &profile.with_revisions(&on_cpu)).unwrap();
        let tuning = tuning.tuning("uniform", &profile.slice("uniform"));
        std::fs::create_dir_all(tunings.join(machine.name)).unwrap();
        std::fs::write(tunings.join(&profile.file), serde_json::to_string(&tuning).unwrap()).unwrap();
    }
    let judged = printed(folder.path(), "tunings", &files).unwrap();
    for (file, machine) in files.iter().zip(&machines) {
        let known = [OURS, RUNNING, "physics"].map(|strategy| of(strategy, machine.name).seen);
        agree(file, &judged[file], &known, 0.06);
    }
}
