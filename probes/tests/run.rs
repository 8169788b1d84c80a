//! `sapwise run` from the outside: streams, tuning of other machines, traces, pictures, wrong usage.

mod common;

#[cfg(unix)]
use common::{TERMINATED, interrupt_when, program, send};
use common::{answer, failure, list, npy, sapwise, success, tuning, write};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// Makes a folder with a tuning that runs `brute` below a number of objects and `grid-sap` from there on.
fn steps(crossover: u32) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let steps = tuning(&[(0, "brute@cpu1"), (crossover, "grid-sap@cpu1")]);
    let path = write(folder.path(), "steps.json", steps.to_string());
    (folder, path)
}

/// Writes a tuning with the costs of `grid-sap` on one thread and on `threads`.
fn costs(folder: &Path, threads: u32) -> PathBuf {
    let (one, many) = ("grid-sap@cpu1".to_owned(), format!("grid-sap@cpu{threads}"));
    let devices: Value = answer(sapwise().args(["devices", "--no-gpus", "--json"]));
    let own = list(&devices["algorithms"]).iter().find(|a| a["id"] == "grid-sap@cpu1").unwrap();
    let mut fixture: Value =
        serde_json::from_str(include_str!("../../crates/tune/tests/fixtures/tuning-3.json")).unwrap();
    let cost = |id: &str| {
        json!({
            "algorithm": id, "revision": own["revision"], "work": 0, "helpers": null, "residual": null, "spread_ln": 0.1
        })
    };
    fixture["costs"] = json!([cost(&one), cost(&many)]);
    fixture["crossovers"] = json!([]);
    fixture["steps"] = json!([{"from_objects": 0, "algorithm": one}]);
    write(folder, "costs.json", fixture.to_string())
}

fn run(scene: impl AsRef<std::ffi::OsStr>, tuning: &Path, words: &[&str]) -> assert_cmd::Command {
    let mut command = sapwise();
    command.arg("run").arg(scene).arg("--tuning").arg(tuning).args(words);
    command
}

#[test]
fn a_recorded_scene_is_run_and_searched_like_the_scene() {
    let (folder, tuning) = steps(20);
    let stream = folder.path().join("stream.npy");
    let scene = ["--objects", "300", "--frames", "90", "--repeats", "1", "--json", "--record"];
    let recorded = answer(run("fragmentation", &tuning, &scene).arg(&stream));
    let again = answer(&mut run(&stream, &tuning, &["--repeats", "1", "--json"]));
    assert_eq!((&again["scenario"], &again["frames"]), (&"stream.npy".into(), &90.into()));
    assert_eq!((&again["objects"], &again["frames_run"]), (&recorded["objects"], &recorded["frames_run"]));
    assert!(again["switches"].as_u64().unwrap() > 0, "{again}");
    let few = answer(&mut run(&stream, &tuning, &["--repeats", "1", "--frames", "7", "--json"]));
    assert_eq!((&few["frames"], &few["parts"]), (&7.into(), &json!([])));
    // `pairs` takes the same stream: absent boxes have no pairs and are not refused.
    let pairs = answer(sapwise().arg("pairs").arg(&stream).arg("--json"));
    assert_eq!((&pairs["frames"], &pairs["objects"]), (&90.into(), &recorded["objects"]["max"]));
}

#[test]
fn a_run_compares_the_choice_over_all_frames_and_over_parts() {
    let (_folder, tuning) = steps(60);
    let words = ["--objects", "200", "--frames", "30", "--repeats", "2", "--after", "20,10,20", "--json"];
    let told = answer(&mut run("fragmentation", &tuning, &words));
    let parts = list(&told["parts"]);
    let range = |p: &Value| (p["from_frame"].as_u64().unwrap(), p["to_frame"].as_u64().unwrap());
    assert_eq!(parts.iter().map(range).collect::<Vec<_>>(), [(0, 9), (10, 19), (20, 29)]);
    for part in parts.iter().chain([&told]) {
        let number = |v: &Value| v.as_f64().unwrap_or_else(|| panic!("{part}"));
        assert!(number(&part["over_best_fixed"]) > 0.0 && number(&part["over_windows"]) > 0.0);
        let times = &part["adaptive"];
        assert!(number(&times["median_ms"]) <= number(&times["p99_ms"]) && part["explored"] == 0, "{part}");
        assert!(number(&times["p99_ms"]) <= number(&times["worst_ms"]), "{part}");
    }
    let switches = |p: &Value| p["switches"].as_u64().unwrap();
    assert_eq!(parts.iter().map(switches).sum::<u64>(), switches(&told));
    let ran = told["frames_run"].as_object().unwrap();
    assert_eq!(ran.values().map(|count| count.as_u64().unwrap()).sum::<u64>(), 30, "{told}");
    let text = success(&mut run("uniform", &tuning, &["--objects", "1", "--frames", "1", "--repeats", "1"]));
    assert!(text.starts_with("Adaptive takes "), "{text}");
    for needed in
        ["With one repeat", "Without learning.", "written by hand", "chosen in", "\nuniform, 1 frame of 1 object, "]
    {
        assert!(text.contains(needed), "{needed}: {text}");
    }
}

#[test]
fn tuning_of_another_machine_is_used_and_what_is_missing_here_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get() as u32);
    let too_many = format!("grid-sap@cpu{}", cores + 1);
    let tuning = costs(folder.path(), cores + 1);
    let small = ["--objects", "200", "--frames", "5", "--repeats", "2", "--json"];
    let told = answer(&mut run("uniform", &tuning, &small));
    assert_eq!(told["tuning"]["too_many_threads"], json!([too_many]));
    assert!(told["warnings"].to_string().contains(&too_many), "{told}");
    assert!(told["learning"] == true && told["fixed"].get(&too_many).is_none(), "{told}");
    let without = answer(run("uniform", &tuning, &small).arg("--no-learning"));
    assert_eq!(without["learning"], false);
}

/// Measures the hardware, which takes seconds.
#[cfg(feature = "long-tests")]
#[test]
fn without_tuning_it_is_predicted() {
    let words = ["run", "uniform", "--no-gpus", "--objects", "100", "--frames", "3", "--repeats", "2", "--json"];
    let told = answer(sapwise().args(words));
    assert_eq!((&told["source"], &told["tuning"]["from"]), (&"predicted".into(), &"prediction".into()));
}

#[test]
fn every_frame_is_traced_and_drawn() {
    let (folder, tuning) = steps(60);
    let file = |name: &str| folder.path().join(name);
    let words = ["--objects", "200", "--frames", "12", "--repeats", "2"];
    let both = |trace: &str, plot: &str| {
        let text = success(
            run("fragmentation", &tuning, &words).arg("--trace").arg(file(trace)).arg("--plot").arg(file(plot)),
        );
        assert!(text.contains(trace) && text.contains(plot), "{text}");
    };
    both("a.csv", "a.svg");
    both("b.csv", "a.svg");
    let csv = fs::read_to_string(file("a.csv")).unwrap();
    assert_eq!(csv.lines().count(), 13);
    assert!(csv.starts_with("frame,objects,") && csv.lines().nth(1).unwrap().contains("brute@cpu1"), "{csv}");
    let svg = fs::read_to_string(file("a.svg")).unwrap();
    for needed in ["brute@cpu1", "Made by: sapwise run fragmentation --tuning steps.json", "written by hand"] {
        assert!(svg.contains(needed), "{needed}");
    }
    // The folder is of this machine alone.
    assert!(!svg.contains(folder.path().to_str().unwrap()));
}

#[test]
fn what_can_not_be_run_is_refused_with_what_to_do() {
    let (folder, tuning) = steps(60);
    let good = [0.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0];
    let nan = [f32::NAN; 6];
    let file = |name: &str, shape: &str, rows: &[[f32; 6]]| npy(folder.path(), name, "<f4", shape, rows.as_flattened());
    let mut broken = good;
    broken[4] = f32::NAN;
    let scene = file("good.npy", "2, 1, 6", &[good, good]);
    let cases: [(PathBuf, &[&str], i32, &[&str]); 13] = [
        (
            file("gap.npy", "1, 3, 6", &[good, nan, good]),
            &[],
            1,
            &["gap.npy", "frame 0: row 1", "at the end of a frame"],
        ),
        (file("broken.npy", "2, 1, 6", &[good, broken]), &[], 1, &["broken.npy", "frame 1", "box 0", "NaN"]),
        (file("none.npy", "0, 5, 6", &[]), &[], 1, &["none.npy has no frames", "--record"]),
        (folder.path().join("absent.npy"), &[], 1, &["absent.npy"]),
        // An existing file is a stream, whatever its name is.
        ("Cargo.toml".into(), &[], 1, &["Cargo.toml"]),
        ("unifrom".into(), &[], 2, &["no scenario", "uniform", "name a file of boxes"]),
        (scene.clone(), &["--frames", "3"], 2, &["--frames 3", "2 frames"]),
        ("uniform".into(), &["--objects", "-5"], 2, &["--objects", "a whole number from 1 to 10000000"]),
        ("uniform".into(), &["--objects", "500.5"], 2, &["--objects", "a whole number from 1 to 10000000"]),
        (scene.clone(), &["--objects", "3"], 2, &["--objects", "stream"]),
        ("uniform".into(), &["--frames", "5", "--after", "5"], 2, &["--after 5", "1 to 4"]),
        ("uniform".into(), &["--frames", "5", "--after", "0"], 2, &["--after 0", "1 to 4"]),
        ("uniform".into(), &["--plot", "a.pdf"], 2, &["a.pdf", ".svg"]),
    ];
    for (scene, words, status, needed) in cases {
        failure(&mut run(&scene, &tuning, words), status, needed);
    }
    let nowhere = folder.path().join("steps.json").join("a.svg");
    failure(run("uniform", &tuning, &[]).arg("--plot").arg(&nowhere), 1, &["a.svg", "can't be made"]);
    failure(&mut run("uniform", &tuning, &["--trace", "a.txt"]), 2, &[]);
    failure(run(&scene, &tuning, &[]).arg("--trace").arg(folder.path().join("steps.json")), 2, &["steps.json"]);
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_the_repeats_that_are_complete() {
    use std::io::Read;
    let (folder, tuning) = steps(60);
    let trace = folder.path().join("trace.csv");
    // More repeats than it lives for; the first is over in a hundredth of a second.
    let words = ["--objects", "30", "--frames", "40", "--repeats", "1000", "--seed", "3", "--json"];
    let mut command = program();
    command.args(["run", "uniform", "--tuning"]).arg(&tuning).args(words).arg("--trace").arg(&trace);
    let mut child = command.stdout(std::process::Stdio::piped()).spawn().unwrap();
    // A child that has no handler yet ends at once, without an answer: then it is tried again, later.
    let mut wait = std::time::Duration::from_millis(200);
    loop {
        std::thread::sleep(wait);
        assert!(child.try_wait().unwrap().is_none(), "a thousand repeats were over before it could be interrupted");
        send("-TERM", &child);
        let mut text = String::new();
        child.stdout.take().unwrap().read_to_string(&mut text).unwrap();
        let status = child.wait().unwrap();
        if !text.is_empty() {
            let told: Value = serde_json::from_str(&text).unwrap();
            assert_eq!((status.code(), &told["interrupted"]), (Some(TERMINATED), &true.into()));
            let repeats = told["repeats"].as_u64().unwrap();
            assert!((1..1000).contains(&repeats), "{told}");
            assert_eq!(fs::read_to_string(&trace).unwrap().lines().count(), 41);
            return;
        }
        assert!(wait.as_secs() < 60, "interrupted before the first repeat, however late");
        wait *= 2;
        child = command.spawn().unwrap();
    }
}

#[cfg(unix)]
#[test]
fn a_recording_that_was_made_before_the_interrupt_is_told() {
    let (folder, tuning) = steps(60);
    let recording = folder.path().join("r.npy");
    // The first repeat takes longer than it lives for.
    let words = ["--objects", "8000", "--frames", "300"];
    let mut command = program();
    command.args(["run", "uniform", "--tuning"]).arg(&tuning).args(words).arg("--record").arg(&recording);
    let complaint = "r.npy holds the whole recording: interrupted";
    interrupt_when(&mut command, || recording.exists(), complaint);
}
