//! The command line: usage, exit statuses, colours, and the verbs `devices`, `pairs` and `schema`.

mod common;

use common::{answer, failure, list, npy, sapwise, small_report, success, without_adapters, write};
#[cfg(unix)]
use common::{program, send};
use std::fs;
use std::path::Path;

#[test]
fn wrong_usage_is_exit_status_two() {
    let cases: [&[&str]; 14] = [
        &[],
        &["fly"],
        &["devices", "--fast"],
        &["pairs"],
        &["pairs", "x.npy", "--repeat", "0"],
        &["pairs", "x.npy", "--algorithm", "grid-sap"],
        &["probe", "--scenario", "nowhere"],
        &["probe", "--threads", "4096"],
        &["predict", "--threads", "4096"],
        &["predict", "--measured"],
        &["predict", "--no-gpus", "--software-gpus"],
        &["pairs", "x.npy", "--no-gpus"],
        &["probe", "--hardware-only", "--quick"],
        &["study", "report.json"],
    ];
    for words in cases {
        failure(sapwise().args(words), 2, &[]);
    }
    failure(sapwise().args(["probe", "--scenario", "nowhere"]), 2, &["uniform"]);
}

#[test]
fn a_wrong_simd_level_is_refused_by_every_verb() {
    for words in [&["devices"][..], &["check", "x.json"], &["probe"], &["pairs", "x.npy"], &["schema", "--out", "x"]] {
        failure(sapwise().env("SAPWISE_SIMD", "sse9").args(words), 2, &["SAPWISE_SIMD=sse9"]);
    }
    success(sapwise().env("SAPWISE_SIMD", "portable").arg("devices"));
}

#[test]
fn devices_lists_algorithms_and_says_when_there_is_no_adapter() {
    let answer = answer(without_adapters(&mut sapwise()).args(["devices", "--json"]));
    assert!(list(&answer["adapters"]).is_empty());
    let brute = list(&answer["algorithms"]).iter().find(|a| a["id"] == "brute@cpu1").unwrap();
    assert_eq!((&brute["available"], &brute["reason"]), (&true.into(), &serde_json::Value::Null));
    assert!(brute["revision"].as_u64().unwrap() >= 1);
    let text = success(without_adapters(&mut sapwise()).arg("devices"));
    let no_gpu = "No GPU was found; the algorithms on the CPU are not affected.";
    assert!(text.contains("brute@cpu1") && text.contains(no_gpu), "{text}");
    let text = success(sapwise().args(["devices", "--no-gpus"]));
    assert!(text.contains("brute@cpu1") && !text.contains("GPU") && !text.contains("@gpu"), "{text}");
}

#[test]
fn pairs_keeps_its_contract() {
    let folder = tempfile::tempdir().unwrap();
    // Two frames of four boxes: in the first, 0 touches 1 and 1 overlaps 3; in the second, all overlap.
    let first = [0.0_f32, 1.0, 9.0, 1.5].map(|x| [x, 0.0, 0.0, x + 1.0, 1.0, 1.0]);
    let second = [[0.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0]; 4];
    let boxes = npy(folder.path(), "boxes.npy", "<f4", "2, 4, 6", &[first, second].concat().concat());
    let out = folder.path().join("pairs.npy");
    for algorithm in ["brute@cpu1", "grid-sap@cpu1"] {
        let words = ["--algorithm", algorithm, "--repeat", "3", "--json", "--out"];
        let answer = answer(sapwise().arg("pairs").arg(&boxes).args(words).arg(&out));
        assert_eq!(answer["algorithm"], algorithm);
        assert_eq!((&answer["objects"], &answer["frames"]), (&4.into(), &2.into()));
        assert_eq!(answer["pairs"], serde_json::json!([2, 6]));
        assert_eq!(list(&answer["samples_ms"]).len(), 6);
        assert!(answer["median_ms"].as_f64().unwrap() > 0.0);
        let fingerprint = answer["fingerprint"].as_str().unwrap();
        assert!(fingerprint.len() == 16 && u64::from_str_radix(fingerprint, 16).is_ok(), "{fingerprint}");
        let bytes = fs::read(&out).unwrap();
        let header = String::from_utf8_lossy(&bytes[..128]).into_owned();
        assert!(header.contains("<u4") && header.contains("(6, 2)"), "{header}");
        let members: Vec<u32> =
            bytes[bytes.len() - 48..].chunks(4).map(|c| u32::from_le_bytes(c.try_into().unwrap())).collect();
        assert_eq!(members, [0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 2, 3]);
    }
    assert!(success(sapwise().arg("pairs").arg(&boxes)).contains("pairs in the last frame: 6"));
}

#[test]
fn pairs_takes_no_and_one_box() {
    let folder = tempfile::tempdir().unwrap();
    for (shape, floats) in [("0, 6", 0), ("1, 6", 6), ("3, 0, 6", 0)] {
        let boxes = npy(folder.path(), "few.npy", "<f4", shape, &vec![0.0; floats]);
        let answer = answer(sapwise().arg("pairs").arg(&boxes).arg("--json"));
        assert!(list(&answer["pairs"]).iter().all(|p| p == 0), "{shape}: {answer}");
    }
    let one = npy(folder.path(), "one.npy", "<f4", "1, 6", &[0.0; 6]);
    assert!(success(sapwise().arg("pairs").arg(&one)).contains(": 1 box, 1 frame\n"));
}

#[test]
fn bad_boxes_are_told_with_file_frame_and_position() {
    let folder = tempfile::tempdir().unwrap();
    let good = [0.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0];
    let mut nan = [good, good, good, good].concat();
    nan[20] = f32::NAN;
    let inverted = [[5.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0], good].concat();
    let crowd = good.repeat(50);
    let path = |name, shape, data: &[f32]| npy(folder.path(), name, "<f4", shape, data);
    let cases: [(_, &[&str], &[&str]); 4] = [
        (path("nan.npy", "2, 2, 6", &nan), &[], &["nan.npy", "frame 1", "box 1", "NaN"]),
        (path("inverted.npy", "2, 6", &inverted), &[], &["inverted.npy", "frame 0", "box 0", "inverted"]),
        (path("crowd.npy", "50, 6", &crowd), &["--limit", "100"], &["crowd.npy", "frame 0", "limit of 100"]),
        (folder.path().join("absent.npy"), &[], &["absent.npy"]),
    ];
    for (file, options, expected) in cases {
        let complaint = failure(sapwise().arg("pairs").arg(&file).args(options), 1, expected);
        assert!(complaint.starts_with("error: "), "{complaint}");
    }
}

/// On systems with a limit of the address space.
#[cfg(target_os = "linux")]
#[test]
fn refused_memory_is_a_failure_of_every_method() {
    let folder = tempfile::tempdir().unwrap();
    // Their 72 million pairs take 576 MB.
    let boxes = npy(folder.path(), "crowd.npy", "<f4", "12000, 6", &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0].repeat(12_000));
    for id in sapwise::Registry::new().available().into_iter().map(|entry| entry.id).filter(|id| id.threads() <= 2) {
        let mut limited = assert_cmd::Command::new("sh");
        limited.args(["-c", "ulimit -v 400000 && exec \"$@\"", "sh"]).arg(assert_cmd::cargo::cargo_bin!("sapwise"));
        limited.arg("pairs").arg(&boxes).args(["--algorithm", &id.to_string()]);
        failure(&mut limited, 1, &["crowd.npy", "frame 0", "no memory for", "pairs; set a limit"]);
    }
}

#[test]
fn an_unknown_algorithm_is_wrong_usage_and_names_the_known() {
    let folder = tempfile::tempdir().unwrap();
    let boxes = npy(folder.path(), "boxes.npy", "<f4", "1, 6", &[0.0; 6]);
    for (id, told) in [
        ("octree@cpu1", "brute@cpu1"),
        ("brute@gpu99", "this machine has no gpu99"),
        ("brute@cpu4096", "`sapwise devices` lists what can"),
    ] {
        let complaint = failure(sapwise().arg("pairs").arg(&boxes).args(["--algorithm", id]), 2, &[told]);
        // No advice that only a program can follow.
        assert!(!complaint.contains("Registry"), "{complaint}");
    }
}

#[test]
fn an_output_that_can_not_be_written_is_a_failure_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let boxes = npy(folder.path(), "boxes.npy", "<f4", "1, 6", &[0.0; 6]);
    // Not even a superuser can create a folder below a file.
    let out = boxes.join("pairs.npy");
    failure(sapwise().arg("pairs").arg(&boxes).arg("--out").arg(&out), 1, &["pairs.npy"]);
    failure(sapwise().args(["schema", "--out"]).arg(&out), 1, &["pairs.npy"]);
    failure(sapwise().args(["schema", "--out"]).arg(&boxes), 1, &["boxes.npy is a file; name a folder"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure_and_a_closed_pipe_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let boxes = npy(folder.path(), "boxes.npy", "<f4", "1, 6", &[0.0; 6]);
    failure(sapwise().arg("pairs").arg(&boxes).args(["--out", "/dev/full"]), 1, &["/dev/full"]);
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let ended = program().arg("devices").stdout(full).output().unwrap();
    assert_eq!(ended.status.code(), Some(1));
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let ended = program().arg("devices").stdout(writer).output().unwrap();
    assert_eq!((ended.status.code(), ended.stderr.len()), (Some(0), 0));
}

#[test]
fn schema_writes_the_committed_files() {
    let folder = tempfile::tempdir().unwrap();
    let told = answer(sapwise().args(["schema", "--json", "--out"]).arg(folder.path().join("new")));
    let files: Vec<&Path> = list(&told["files"]).iter().map(|file| Path::new(file.as_str().unwrap())).collect();
    let names: Vec<_> = files.iter().map(|file| file.file_name().unwrap()).collect();
    assert_eq!(names, ["tuning-3.schema.json", "model-5.schema.json", "report-3.schema.json"]);
    for (file, name) in files.into_iter().zip(names) {
        let committed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../schemas").join(name);
        let same = fs::read_to_string(file).unwrap() == fs::read_to_string(committed).unwrap();
        assert!(same, "{name:?} is stale: run `cargo run -- schema --out schemas`");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn help_that_nobody_gets_is_a_failure() {
    for words in [&["--help"][..], &["probe", "--help"], &["--version"]] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let mut command = program();
        let ended = command.args(words).stdout(full).output().unwrap();
        let complaint = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(1), "{words:?}: {complaint}");
        assert!(complaint.contains("standard output can't be written"), "{complaint}");
        assert!(success(sapwise().args(words)).contains("sapwise"));
    }
}

/// Before minutes of work, not after them.
#[test]
fn a_file_that_cannot_be_written_is_told_first() {
    let folder = tempfile::tempdir().unwrap();
    let report = write(folder.path(), "report.json", small_report("a").to_string());
    let below_a_file = report.join("out.json");
    let report = report.to_str().unwrap();
    let commands: [&[&str]; 3] =
        [&["train", report, "--out"], &["predict", "--report", report, "--out"], &["run", "uniform", "--record"]];
    for words in commands {
        failure(sapwise().args(words).arg(&below_a_file), 1, &["out.json", "can't be made"]);
        failure(sapwise().args(words).arg(folder.path()), 1, &["is a folder"]);
    }
}

#[test]
fn a_missing_folder_of_an_output_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let report = write(folder.path(), "report.json", small_report("a").to_string());
    let out = folder.path().join("a/b/tuning.json");
    success(sapwise().args(["predict", "--report"]).arg(&report).arg("--out").arg(&out));
    assert!(out.is_file());
}

#[cfg(unix)]
#[test]
fn a_second_signal_ends_it_as_if_it_were_not_caught() {
    use std::io::{BufRead, BufReader};
    use std::os::unix::process::ExitStatusExt;
    let folder = tempfile::tempdir().unwrap();
    // A frame of these boxes takes seconds, and no verb looks for a signal within a frame.
    let apart: Vec<f32> =
        (0..300_000).flat_map(|k| [k as f32 * 2.0, 0.0, 0.0, k as f32 * 2.0 + 1.0, 1.0, 1.0]).collect();
    let boxes = npy(folder.path(), "apart.npy", "<f4", "300000, 6", &apart);
    let mut wait = std::time::Duration::from_millis(300);
    loop {
        let mut command = program();
        let command = command.arg("pairs").arg(&boxes).args(["--algorithm", "brute@cpu1"]);
        let mut pairs = command.stderr(std::process::Stdio::piped()).spawn().unwrap();
        std::thread::sleep(wait);
        send("-TERM", &pairs);
        let mut told = String::new();
        BufReader::new(pairs.stderr.take().unwrap()).read_line(&mut told).unwrap();
        if told.starts_with("interrupted: about to stop") {
            // Not SIGHUP or SIGINT: under `nohup` and in the background of a shell they are ignored, by the command
            // too.
            send("-TERM", &pairs);
            assert_eq!(pairs.wait().unwrap().signal(), Some(15));
            return;
        }
        // It ended at once, since it did not listen yet: try again with a longer wait.
        pairs.wait().unwrap();
        assert!(wait.as_secs() < 60, "it never listens: {told}");
        wait *= 2;
    }
}

/// Returns the prediction for a report as a terminal of a width shows it. `None`, with a line on standard error,
/// without the program `script`, which makes a terminal.
#[cfg(target_os = "linux")]
fn on_a_terminal(columns: u32, variables: &[(&str, &str)]) -> Option<String> {
    let quoted = |text: &str| format!("'{text}'");
    let program = quoted(&assert_cmd::cargo::cargo_bin!("sapwise").display().to_string());
    let folder = tempfile::tempdir().unwrap();
    let report = write(folder.path(), "report.json", small_report("a").to_string());
    let report = quoted(&report.display().to_string());
    let mut command = std::process::Command::new("script");
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
    let report = write(folder.path(), "report.json", small_report("a").to_string());
    let text = success(command.args(["predict", "--no-gpus", "--report"]).arg(report));
    assert!(!text.contains('\u{1b}'), "{text}");
    assert!(text.contains("\nNext: "), "{text}");
}
