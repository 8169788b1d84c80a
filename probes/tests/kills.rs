//! Verbs that are killed at any moment, or run out of disk: older files stay whole, newer ones are complete, and the
//! same command works again.
//!
//! `SAPWISE_KILLS=N` kills each verb N times, and `SAPWISE_SMALL_DISK=FOLDER` fills that disk: `tools/kills.sh` does
//! both. Without a small disk the tests limit the size of files.
#![cfg(feature = "long-tests")]

mod common;

use common::{program, sapwise, small_report, success};
use sapwise_scenes::{Frames, Random};
use std::fs;
#[cfg(unix)]
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// How often each verb is killed without `SAPWISE_KILLS`.
const KILLS: u64 = 4;

/// Fails if a file of ours is half-written or incomplete.
fn check_whole(path: &Path) {
    let text = || fs::read_to_string(path).unwrap();
    let json = || drop(serde_json::from_str::<serde_json::Value>(&text()).unwrap_or_else(|e| panic!("{path:?}: {e}")));
    match path.extension().and_then(|e| e.to_str()).unwrap() {
        "unfinished" => json(),
        "json" => {
            json();
            assert!(!text().contains("\"unfinished: "), "{path:?} lost what stood there");
        }
        "html" => assert!(text().trim_end().ends_with("</html>"), "{path:?}"),
        "svg" => assert!(text().trim_end().ends_with("</svg>"), "{path:?}"),
        "csv" | "md" => assert!(text().ends_with('\n'), "{path:?}"),
        "npy" => assert_eq!(Frames::read(path).unwrap().len(), 40, "{path:?}"),
        other => panic!("what is {other}?"),
    }
}

/// Returns the files below a folder, without the temporary files of a killed program.
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

/// Checks the files after a command was ended early, for any reason.
fn look(words: &[&str], out: &Path, before: &[PathBuf]) {
    let after = files(out);
    assert!(before.iter().all(|path| after.contains(path)), "{words:?}: {before:?} became {after:?}");
    after.iter().for_each(|path| check_whole(path));
}

/// Kills a verb that writes below `out` at moments spread over the time that it takes, and lets it run out of disk.
fn kill_and_look(words: &[&str], out: &Path, seed: u64) {
    let began = Instant::now();
    success(sapwise().args(words).current_dir(out));
    let whole = began.elapsed();
    let before = files(out);
    assert!(!before.is_empty());
    end_files_early(words, out, &before);
    let kills = std::env::var("SAPWISE_KILLS").map_or(KILLS, |n| n.parse().expect("SAPWISE_KILLS is a number"));
    let mut random = Random::new(seed);
    for k in 0..kills {
        // Every other kill comes near the end, when files are written.
        let share = if k % 2 == 0 { random.uniform() } else { 0.8 + 0.25 * random.uniform() };
        let mut command = program();
        command.args(words).current_dir(out).stdout(Stdio::null()).stderr(Stdio::null());
        let mut running = command.spawn().unwrap();
        std::thread::sleep(whole.mul_f64(share));
        // It may have ended already.
        let _ = running.kill();
        running.wait().unwrap();
        look(words, out, &before);
    }
    success(sapwise().args(words).current_dir(out));
    assert_eq!(files(out), before, "{words:?} leaves something behind");
}

/// Lets no file of the command become larger than a part of its largest, and then the disk no fuller than that.
#[cfg(unix)]
fn end_files_early(words: &[&str], out: &Path, before: &[PathBuf]) {
    let largest = before.iter().map(|path| fs::metadata(path).unwrap().len()).max().unwrap() as f64;
    for share in [0.0, 0.3, 0.6] {
        let mut command = Command::new("sh");
        // The signal is ignored: otherwise it would kill, which other tests cover. The limit is in blocks of 512
        // bytes.
        command.args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\"", &((largest * share) as u64 / 512).to_string()]);
        command.arg(assert_cmd::cargo::cargo_bin!("sapwise"));
        run_out_of_room(command.args(words).current_dir(out));
        look(words, out, before);
    }
    let Some(disk) = std::env::var_os("SAPWISE_SMALL_DISK") else { return };
    let disk = tempfile::tempdir_in(disk).unwrap();
    success(sapwise().args(words).current_dir(disk.path()));
    let before = files(disk.path());
    for share in [0.0, 0.3, 0.6] {
        let filler = tempfile::NamedTempFile::new_in(disk.path().parent().unwrap()).unwrap();
        while filler.as_file().write_all_at(&[1; 4096], filler.as_file().metadata().unwrap().len()).is_ok() {}
        let full = filler.as_file().metadata().unwrap().len();
        filler.as_file().set_len(full.saturating_sub((largest * share) as u64)).unwrap();
        run_out_of_room(program().args(words).current_dir(disk.path()));
        look(words, disk.path(), &before);
    }
    success(sapwise().args(words).current_dir(disk.path()));
}

/// The command must fail, and say which file it could not write.
#[cfg(unix)]
fn run_out_of_room(command: &mut Command) {
    let ended = command.env_remove("SAPWISE_SIMD").stdout(Stdio::null()).output().unwrap();
    let complaint = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(1), "{command:?}: {complaint}");
    assert!(complaint.contains("can't write"), "{command:?}: {complaint}");
}

#[cfg(not(unix))]
fn end_files_early(_: &[&str], _: &Path, _: &[PathBuf]) {}

/// Makes a folder with two reports, and one in it for the output of the command.
fn folders() -> (tempfile::TempDir, PathBuf, [String; 2]) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let reports = ["a", "b"].map(|name| {
        let path = folder.path().join(name).with_extension("json");
        fs::write(&path, small_report(name).to_string()).unwrap();
        path.display().to_string()
    });
    (folder, out, reports)
}

#[test]
fn a_study_that_is_killed_leaves_the_old_one() {
    let (_folder, out, [a, b]) = folders();
    kill_and_look(&["study", &a, &b, "--out", "study"], &out, 1);
}

#[test]
fn a_prediction_that_is_killed_leaves_the_old_tuning() {
    let (_folder, out, [report, _]) = folders();
    kill_and_look(&["predict", "--no-gpus", "--report", &report, "--measured", "--out", "tuning.json"], &out, 2);
}

#[test]
fn a_run_that_is_killed_leaves_its_old_files() {
    let (_folder, out, [report, _]) = folders();
    let words = "run uniform --objects 300 --frames 40 --repeats 2 --no-gpus --record r.npy --trace t.csv --plot \
        p.svg --tuning";
    let words: Vec<&str> = words.split(' ').chain([report.as_str()]).collect();
    kill_and_look(&words, &out, 3);
}

#[test]
fn a_training_that_is_killed_leaves_the_old_model() {
    let (_folder, out, [a, b]) = folders();
    kill_and_look(&["train", &a, &b, "--out", "model.json", "--card", "card.md"], &out, 4);
}

#[test]
fn a_probe_that_is_killed_leaves_the_old_report() {
    let (_folder, out, _) = folders();
    let words = "probe --no-gpus --quick --scenario uniform --scenario slab --max-objects 10 --out report.json";
    kill_and_look(&words.split(' ').collect::<Vec<_>>(), &out, 5);
}
