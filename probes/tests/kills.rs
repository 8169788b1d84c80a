//! Verbs that are killed at any moment: every older file is whole, every newer one is complete, and the same command works again.
//!
//! `SAPWISE_KILLS=N` kills each verb N times; `tools/kills.sh` does.

mod common;

use common::{sapwise, success};
use sapwise_scenes::Frames;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// How often each verb is killed where nothing is said.
const KILLS: u64 = 4;

/// A path below the root of the repository.
fn stored(name: &str) -> String {
    format!("{}/../{name}", env!("CARGO_MANIFEST_DIR"))
}

/// Numbers from 0 to 1 that follow from the first.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Fails where a file of ours is half-written.
fn check_whole(path: &Path) {
    let text = || fs::read_to_string(path).unwrap();
    match path.extension().and_then(|e| e.to_str()).unwrap() {
        "json" => drop(serde_json::from_str::<serde_json::Value>(&text()).unwrap_or_else(|e| panic!("{path:?}: {e}"))),
        "html" => assert!(text().trim_end().ends_with("</html>"), "{path:?}"),
        "svg" => assert!(text().trim_end().ends_with("</svg>"), "{path:?}"),
        "csv" | "md" => assert!(text().ends_with('\n'), "{path:?}"),
        "png" => assert!(fs::read(path).unwrap().ends_with(b"IEND\xae\x42\x60\x82"), "{path:?}"),
        "npy" => assert_eq!(Frames::read(path).unwrap().len(), 40, "{path:?}"),
        other => panic!("what is {other}?"),
    }
}

/// The files below a folder, without what a killed program has left beside their places.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let name = entry.file_name().into_string().unwrap();
        if name.starts_with(".sapwise-") && name.ends_with(".tmp") {
            continue;
        }
        if entry.path().is_dir() {
            found.extend(files(&entry.path()));
        } else {
            found.push(entry.path());
        }
    }
    found.sort();
    found
}

/// Kills a verb that writes below `out` at moments spread over the time that it takes.
fn kill_and_look(words: &[&str], out: &Path, seed: u64) {
    let began = Instant::now();
    success(sapwise().args(words).current_dir(out));
    let whole = began.elapsed();
    let before = files(out);
    assert!(!before.is_empty());
    let kills = std::env::var("SAPWISE_KILLS").map_or(KILLS, |n| n.parse().expect("SAPWISE_KILLS is a number"));
    let mut random = Random(seed);
    random.next();
    for k in 0..kills {
        // Every other one near the end, where files are written.
        let share = if k % 2 == 0 { random.next() } else { 0.8 + 0.25 * random.next() };
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("sapwise"));
        command.env_remove("SAPWISE_SIMD").args(words).current_dir(out).stdout(Stdio::null()).stderr(Stdio::null());
        let mut running = command.spawn().unwrap();
        std::thread::sleep(whole.mul_f64(share));
        // It may have ended already.
        let _ = running.kill();
        running.wait().unwrap();
        let after = files(out);
        assert!(before.iter().all(|path| after.contains(path)), "{words:?}: {before:?} became {after:?}");
        after.iter().for_each(|path| check_whole(path));
    }
    success(sapwise().args(words).current_dir(out));
    assert_eq!(files(out), before, "{words:?} leaves something behind");
}

#[test]
fn a_study_that_is_killed_leaves_the_one_of_before() {
    let folder = tempfile::tempdir().unwrap();
    let reports = [
        stored("datasets/earlier/amd-epyc-2c-full--2026-11-21.json"),
        stored("datasets/earlier/amd-epyc-2c-1t--2026-11-21.json"),
    ];
    kill_and_look(&["study", &reports[0], &reports[1], "--out", "study"], folder.path(), 1);
}

#[test]
fn a_prediction_that_is_killed_leaves_the_tuning_of_before() {
    let folder = tempfile::tempdir().unwrap();
    let report = stored("datasets/earlier/amd-epyc-2c-full--2026-11-21.json");
    kill_and_look(&["predict", "--no-gpus", "--report", &report, "--measured", "--out", "tuning.json"], folder.path(), 2);
}

#[test]
fn a_run_that_is_killed_leaves_its_files_of_before() {
    let folder = tempfile::tempdir().unwrap();
    let report = stored("datasets/intel-xeon-2c-full--2026-11-23.json");
    let words =
        "run uniform --objects 300 --frames 40 --repeats 2 --no-gpus --record r.npy --trace t.csv --plot p.svg --tuning";
    let words: Vec<&str> = words.split(' ').chain([report.as_str()]).collect();
    kill_and_look(&words, folder.path(), 3);
}

#[test]
fn a_training_that_is_killed_leaves_the_model_of_before() {
    let folder = tempfile::tempdir().unwrap();
    success(sapwise().args(["simulate", "--machines", "4", "--out", "simulated"]).current_dir(folder.path()));
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let reports = folder.path().join("simulated").display().to_string();
    let words = ["train", "--simulated", &reports, "--out", "model.json", "--card", "card.md", "--plot", "held-out.png"];
    kill_and_look(&words, &out, 4);
}
