//! A user's program with its own algorithm: the example `own_algorithm` from `probe` to `run`, compared with the plain
//! command.
//!
//! This program has its own `main` (`harness = false`): verbs start parts of a measurement as processes of their own
//! program, and the usual harness would run tests there. Started with [`AS_COMMAND`] it is the example.

mod common;
#[path = "../examples/own_algorithm.rs"]
mod own_algorithm;

use assert_cmd::Command;
use common::{answer, failure, list, npy, output, sapwise, success};
use sapwise::{Aabb, AlgorithmId, BroadPhase, Error, Pairs};
use sapwise_cli::UserAlgorithm;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs};

/// The variable that makes this program the example. Its child processes inherit it.
const AS_COMMAND: &str = "SAPWISE_TEST_AS_COMMAND";

/// Every test by its name.
const TESTS: [(&str, fn()); 5] = [
    ("from_the_probe_to_the_run_as_one_of_ours", from_the_probe_to_the_run_as_one_of_ours),
    ("the_pairs_are_those_of_ours", the_pairs_are_those_of_ours),
    ("boxes_that_ours_refuse_are_refused", boxes_that_ours_refuse_are_refused),
    ("one_on_several_threads_gets_their_number", one_on_several_threads_gets_their_number),
    ("names_that_clash_are_refused_before_anything_is_done", names_that_clash_are_refused_before_anything_is_done),
];

fn main() -> ExitCode {
    match env::var(AS_COMMAND).as_deref() {
        Ok("sweep") => return own_algorithm::main(),
        Ok("clash") => return clash(),
        Ok("threads") => return on_threads(),
        _ => {}
    }
    // The first argument is the filter of `cargo test`. Those after it are for the usual harness.
    let wanted = env::args().nth(1).filter(|word| !word.starts_with('-')).unwrap_or_default();
    for (name, test) in TESTS {
        if name.contains(&wanted) {
            test();
            println!("test {name} ... ok");
        }
    }
    ExitCode::SUCCESS
}

/// A program whose algorithm has a name of the library's.
fn clash() -> ExitCode {
    sapwise_cli::Command::new()
        .with(UserAlgorithm::on_one_thread("grid-sap", 1, || unreachable!("it was refused")))
        .run()
}

/// A program whose algorithm finds one pair for each of its threads, whatever the boxes are.
fn on_threads() -> ExitCode {
    struct Threads(u32);
    impl BroadPhase for Threads {
        fn find_pairs(&mut self, _: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
            pairs.clear();
            (1..=self.0).for_each(|k| pairs.push(0, k));
            pairs.finish()
        }
    }
    sapwise_cli::Command::new()
        .with(UserAlgorithm::on_threads("threads", 1, |threads| Ok(Box::new(Threads(threads)))))
        .run()
}

fn program(name: &str) -> Command {
    let mut command = Command::new(env::current_exe().unwrap());
    command.env(AS_COMMAND, name).env_remove("SAPWISE_SIMD");
    command
}

fn user() -> Command {
    program("sweep")
}

fn read(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// The report of a small probe, changed to that of an optimised build on an undisturbed machine.
fn probed(folder: &Path) -> PathBuf {
    let path = folder.join("report.json");
    let words = ["probe", "--no-gpus", "--quick", "--scenario", "uniform", "--max-objects", "1000", "--out"];
    success(user().args(words).arg(&path));
    let mut report = read(&path);
    report["provenance"]["optimised"] = true.into();
    report["label"] = "real_full".into();
    fs::write(&path, report.to_string()).unwrap();
    path
}

fn from_the_probe_to_the_run_as_one_of_ours() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);

    let report = probed(folder.path());
    let told = read(&report);
    let swept = list(&told["algorithms"]);
    assert!(swept.iter().any(|t| t["id"] == "brute@cpu1"), "{swept:?}");
    let timed = swept.iter().find(|t| t["id"] == "sweep@cpu1").unwrap();
    assert_eq!((&timed["revision"], list(&timed["terms"]).len()), (&1.into(), 4), "{timed}");
    assert!(swept.iter().all(|t| t["id"] == "sweep@cpu1" || t.get("terms").is_none()), "{swept:?}");
    let timings = list(&told["points"]).iter().flat_map(|p| list(&p["timings"]));
    let own: Vec<&Value> = timings.filter(|t| t["algorithm"] == "sweep@cpu1").collect();
    assert!(own.len() >= 6 && own.iter().all(|t| t["error"].is_null()), "{own:?}");

    let model = file("model.json");
    success(user().arg("train").arg(&report).arg("--out").arg(&model));
    let fitted = read(&model);
    let of_user = list(&fitted["methods"]).iter().find(|m| m["method"] == "sweep").expect("a cost of sweep");
    assert_eq!((&of_user["revision"], &of_user["backend"]), (&1.into(), &"cpu".into()));
    // A sweep as short as this may not show every term of the user; no other term is ever fitted.
    let named = |fitted: &Value| list(&timed["terms"]).iter().any(|t| t["term"] == fitted["term"]);
    let terms = list(&of_user["terms"]);
    assert!(!terms.is_empty() && terms.iter().all(named), "{terms:?}");

    let tuning = file("tuning.json");
    let predict = |mut command: Command| {
        let words = ["predict", "--json", "--report"];
        answer(command.args(words).arg(&report).arg("--model").arg(&model).arg("--out").arg(&tuning))
    };
    // The plain command predicts the library's algorithms, and warns about the one that it lacks.
    let plain = predict(sapwise());
    assert!(!plain["costs"].to_string().contains("sweep"), "{plain}");
    let warned = plain["warnings"].to_string().contains("knows sweep, which is not in this build");
    assert!(warned, "{}", plain["warnings"]);
    let own = predict(user());
    assert!(list(&own["costs"]).iter().any(|c| c["algorithm"] == "sweep@cpu1"), "{own}");
    assert!(!own["warnings"].to_string().contains("sweep"), "{}", own["warnings"]);
    // The built-in model does not know it.
    let built_in = success(user().args(["predict", "--json", "--report"]).arg(&report));
    assert!(built_in.contains("sweep is not predicted") && built_in.contains("own-model.json"), "{built_in}");

    let run = ["run", "uniform", "--json", "--objects", "200", "--frames", "20", "--repeats", "1", "--tuning"];
    let told = answer(user().args(run).arg(&tuning));
    assert!(told["fixed"]["sweep@cpu1"]["total_ms"].as_f64().unwrap() > 0.0, "{told}");
    failure(sapwise().args(run).arg(&tuning), 1, &["is stale: sweep is not in this build"]);

    check_names_a_number_of_threads_that_it_can_not_be_made_on(&tuning);
    for path in [&report, &model, &tuning] {
        success(user().arg("check").arg(path));
        let text = output(sapwise().arg("check").arg(path), 1);
        assert!(text.contains("stale: sweep is not in this build"), "{text}");
    }
}

fn check_names_a_number_of_threads_that_it_can_not_be_made_on(tuning: &Path) {
    let other = tuning.with_file_name("two-threads.json");
    fs::write(&other, fs::read_to_string(tuning).unwrap().replace("sweep@cpu1", "sweep@cpu2")).unwrap();
    let text = output(user().arg("check").arg(&other), 1);
    assert!(text.contains("sweep@cpu2") && !text.contains("stale"), "{text}");
}

fn the_pairs_are_those_of_ours() {
    let folder = tempfile::tempdir().unwrap();
    let inf = f32::INFINITY;
    // Touching boxes in a row, a point, an infinite one, two far out that lie apart, two that meet there.
    let mut boxes: Vec<[f32; 6]> = (0..9).map(|k| k as f32).map(|x| [x, 0.0, 0.0, x + 1.0, 1.0, 1.0]).collect();
    boxes.extend([[3.0; 6], [-inf, -inf, -inf, inf, inf, inf], [-inf, 0.0, 0.0, 4.5, inf, inf]]);
    boxes.extend([[1e30, 0.0, 0.0, 2e30, 1.0, 1.0], [3e30, 0.0, 0.0, 4e30, 1.0, 1.0], [4e30, 1.0, 0.0, inf, 1.0, 1.0]]);
    // The same boxes elsewhere in another order, and then in their first places.
    let away: Vec<[f32; 6]> = boxes.iter().rev().map(|b| b.map(|x| x + 50.0)).collect();
    let near: Vec<[f32; 6]> = boxes.iter().map(|b| b.map(|x| x + 0.25)).collect();
    let frames = [boxes.concat(), near.concat(), away.concat(), boxes.concat()];
    let shape = format!("4, {}, 6", boxes.len());
    let many = npy(folder.path(), "many.npy", "<f4", &shape, &frames.concat());
    let few: Vec<(PathBuf, usize)> = (0..3_usize)
        .map(|n| (npy(folder.path(), &format!("{n}.npy"), "<f4", &format!("{n}, 6"), &boxes[..n].concat()), 1))
        .collect();
    for (path, frames) in few.into_iter().chain([(many, 4)]) {
        let pairs = |id: &str| -> Value {
            let words = ["--json", "--repeat", "3", "--algorithm", id];
            answer(user().arg("pairs").arg(&path).args(words))
        };
        let (ours, own) = (pairs("brute@cpu1"), pairs("sweep@cpu1"));
        assert_eq!(list(&ours["pairs"]).len(), frames);
        assert_eq!((&own["pairs"], &own["fingerprint"]), (&ours["pairs"], &ours["fingerprint"]), "{}", path.display());
    }
}

fn boxes_that_ours_refuse_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let boxes = [[0.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0], [0.0, f32::NAN, 0.0, 1.0, 1.0, 1.0]];
    let path = npy(folder.path(), "nan.npy", "<f4", "2, 6", &boxes.concat());
    let complaints = ["brute@cpu1", "sweep@cpu1"]
        .map(|id| failure(user().arg("pairs").arg(&path).args(["--algorithm", id]), 1, &[]));
    assert!(complaints[0].contains("box 1") && complaints[0] == complaints[1], "{complaints:?}");
    let unknown = ["no algorithm is called \"sweep@cpu1\""];
    failure(sapwise().arg("pairs").arg(&path).args(["--algorithm", "sweep@cpu1"]), 2, &unknown);
}

fn one_on_several_threads_gets_their_number() {
    let folder = tempfile::tempdir().unwrap();
    let boxes = npy(folder.path(), "one.npy", "<f4", "1, 6", &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    let told = answer(program("threads").args(["devices", "--no-gpus", "--json"]));
    let ids = list(&told["algorithms"]).iter().map(|a| a["id"].as_str().unwrap());
    let on = |method: &str| -> Vec<u32> {
        let id = |text: &str| text.parse::<AlgorithmId>().unwrap();
        ids.clone().map(id).filter(|id| id.method() == method).map(|id| id.threads()).collect()
    };
    assert!(!on("threads").is_empty() && on("threads") == on("brute"), "{told}");
    for threads in on("threads") {
        let words = ["--json", "--algorithm", &format!("threads@cpu{threads}")];
        let told = answer(program("threads").arg("pairs").arg(&boxes).args(words));
        assert_eq!(told["pairs"][0], threads);
    }
}

fn names_that_clash_are_refused_before_anything_is_done() {
    for words in [&["devices"][..], &["--help"], &["part", "gpus"]] {
        failure(program("clash").args(words), 1, &["\"grid-sap\" is the name of a method of Sapwise"]);
    }
}
