//! Helpers of the tests of the command.

#![allow(dead_code, reason = "each test program uses a part of this")]

use assert_cmd::Command;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Returns the command, with no SIMD level from the environment of the tests.
pub(crate) fn sapwise() -> Command {
    Command::from_std(program())
}

/// Returns the same command, to be spawned.
pub(crate) fn program() -> std::process::Command {
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("sapwise"));
    command.env_remove("SAPWISE_SIMD").env_remove("CARGO");
    command
}

/// Makes a sound and current report of this build, with twelve points. `machine` is a hex digit that identifies the
/// machine.
pub(crate) fn small_report(machine: &str) -> Value {
    let text = include_str!("../../../crates/lab/tests/fixtures/report-3.json");
    let mut report: Value = serde_json::from_str(text).unwrap();
    renew(&mut report);
    report["hardware"]["machine"]["physical_id"] = machine.repeat(16).into();
    let points = list(&report["points"]).to_vec();
    let scenarios = ["uniform", "slab", "mixed", "fast"].into_iter().flat_map(|scenario| {
        points.iter().cloned().map(move |mut point| {
            point["scenario"] = scenario.into();
            point["foreign_load"] = 0.0.into();
            point
        })
    });
    report["points"] = scenarios.collect();
    report
}

/// Makes an old report one of this build on an undisturbed machine: its label and the revisions of its algorithms.
pub(crate) fn renew(report: &mut Value) {
    report["label"] = "real_full".into();
    let registry = sapwise::Registry::with_cores(1);
    let any = sapwise_tune::GpuIdentity::new(0, "any", sapwise_tune::GpuKind::Discrete);
    let of_this_build = [registry.entries(), &sapwise_gpu::algorithms([&any])].concat();
    for algorithm in report["algorithms"].as_array_mut().unwrap() {
        let id: sapwise::AlgorithmId = algorithm["id"].as_str().unwrap().parse().unwrap();
        let kind = |id: &sapwise::AlgorithmId| (id.method().to_owned(), id.backend().class());
        let own = of_this_build.iter().find(|e| kind(&e.id) == kind(&id)).unwrap();
        algorithm["revision"] = own.revision.into();
    }
}

/// The command on a machine without GPUs: it asks Vulkan only, not Metal or Direct3D, and Vulkan finds no driver.
pub(crate) fn without_adapters(command: &mut Command) -> &mut Command {
    let nowhere = "/nonexistent";
    command.env("WGPU_BACKEND", "vulkan").env("VK_ICD_FILENAMES", nowhere).env("VK_DRIVER_FILES", nowhere)
}

/// The answer of `sapwise devices --json` on a machine with an adapter. Without any: `None`, with a line that says
/// so, or a failure with `SAPWISE_REQUIRE_GPU=1`.
pub(crate) fn devices_with_a_gpu(test: &str) -> Option<Value> {
    let answer: Value = answer(sapwise().args(["devices", "--json"]));
    if list(&answer["adapters"]).is_empty() {
        let required = std::env::var("SAPWISE_REQUIRE_GPU").is_ok_and(|v| v == "1");
        assert!(!required, "SAPWISE_REQUIRE_GPU=1, and no adapter was found: {}", answer["remark"]);
        eprintln!("{test} is skipped: no adapter was found");
        return None;
    }
    Some(answer)
}

/// Sends a signal to a running command. Not SIGINT: a command that a shell starts in the background ignores it.
#[cfg(unix)]
pub(crate) fn send(signal: &str, to: &std::process::Child) {
    let sent = std::process::Command::new("kill").args([signal, &to.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

/// Exit status of a command that SIGTERM stopped.
pub(crate) const TERMINATED: i32 = 128 + 15;

/// Starts a command, sends it SIGTERM when something is `ready`, and sees it end by that with this complaint.
#[cfg(unix)]
pub(crate) fn interrupt_when(command: &mut std::process::Command, ready: impl Fn() -> bool, complaint: &str) {
    use std::process::Stdio;
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    while !ready() {
        assert_eq!(child.try_wait().unwrap(), None, "it ended before it was to be interrupted");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    send("-TERM", &child);
    let ended = child.wait_with_output().unwrap();
    let told = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(TERMINATED), "{told}");
    assert!(told.contains(complaint), "{told}");
}

/// Runs to exit status 0 and returns standard output.
pub(crate) fn success(command: &mut Command) -> String {
    output(command, 0)
}

/// Runs to this exit status and returns standard output.
pub(crate) fn output(command: &mut Command, status: i32) -> String {
    let ended = command.output().unwrap();
    let complaint = String::from_utf8_lossy(&ended.stderr).into_owned();
    let told = String::from_utf8(ended.stdout).unwrap();
    assert_eq!(ended.status.code(), Some(status), "{command:?}: {complaint}{told}");
    assert!(!complaint.contains("panicked"), "{complaint}");
    told
}

/// Writes a file below a folder and returns its path.
pub(crate) fn write(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, content).unwrap();
    path
}

/// Returns the elements of a list.
pub(crate) fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

/// Runs to exit status 0 and returns the JSON on standard output.
pub(crate) fn answer(command: &mut Command) -> Value {
    serde_json::from_str(&success(command)).unwrap()
}

/// The file of a tuning that runs each algorithm from a number of objects on.
pub(crate) fn tuning(steps: &[(u32, &str)]) -> Value {
    let step = |(from, id): &(u32, &str)| json!({"from_objects": from, "algorithm": id});
    json!({
        "schema": "tuning/3", "source": "default", "model": null, "extrapolated": false, "warnings": [],
        "scenario": "uniform", "steps": steps.iter().map(step).collect::<Value>(), "crossovers": [],
        "interval_basis": "", "costs": []
    })
}

/// Runs to this exit status and returns standard error, which must hold these texts and no panic.
pub(crate) fn failure(command: &mut Command, status: i32, texts: &[&str]) -> String {
    let ended = command.output().unwrap();
    let complaint = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(status), "{command:?}: {complaint}");
    assert!(!complaint.contains("panicked"), "{complaint}");
    texts.iter().for_each(|text| assert!(complaint.contains(text), "{command:?}: {text} is missing: {complaint}"));
    complaint
}

/// Writes a file in NumPy's format 1.0, with `dtype` and `shape` as given and little-endian data.
pub(crate) fn npy(folder: &Path, name: &str, dtype: &str, shape: &str, data: &[f32]) -> PathBuf {
    let mut header = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data.iter().flat_map(|x| x.to_le_bytes()));
    write(folder, name, bytes)
}
