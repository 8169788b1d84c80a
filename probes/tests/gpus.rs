//! The command with GPUs, without any, and with a driver that crashes.

mod common;

#[cfg(feature = "long-tests")]
use common::failure;
use common::{answer, devices_with_a_gpu, list, npy, output, renew, sapwise, success, tuning, without_adapters, write};
#[cfg(feature = "long-tests")]
use sapwise_lab::Report;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// A sweep of one scenario with two sizes.
#[cfg(feature = "long-tests")]
const TINY: [&str; 6] = ["probe", "--scenario", "uniform", "--max-objects", "20", "--json"];

#[cfg(feature = "long-tests")]
fn report(command: &mut assert_cmd::Command) -> Report {
    sapwise_lab::report::read(&success(command)).unwrap().value
}

/// Writes a made-up report of a machine with two GPUs, changed by `change`. It has enough points for a model.
fn made_up(folder: &Path, name: &str, change: impl Fn(&mut Value)) -> PathBuf {
    let mut report: Value =
        serde_json::from_str(include_str!("../../crates/lab/tests/fixtures/report-3-gpu.json")).unwrap();
    renew(&mut report);
    let points = list(&report["points"]).to_vec();
    let again = points.iter().cycle().take(12).enumerate().map(|(k, point)| {
        let mut point = point.clone();
        point["scenario"] = format!("scenario {}", k / points.len()).into();
        point
    });
    report["points"] = again.collect();
    change(&mut report);
    write(folder, name, report.to_string())
}

fn ids(tuning: &Value) -> Vec<&str> {
    list(&tuning["costs"]).iter().map(|c| c["algorithm"].as_str().unwrap()).collect()
}

#[test]
fn adapters_are_listed_with_every_algorithm_on_them() {
    let Some(answer) = devices_with_a_gpu("adapters_are_listed") else { return };
    let text = success(sapwise().arg("devices"));
    for adapter in list(&answer["adapters"]) {
        for key in ["index", "name", "device", "driver", "api", "kind"] {
            assert!(!adapter[key].is_null(), "{key}: {adapter}");
        }
        assert!(text.contains(adapter["name"].as_str().unwrap()), "{text}");
        let id = format!("grid-sap@gpu{}", adapter["index"]);
        let algorithm = list(&answer["algorithms"]).iter().find(|a| a["id"] == id.as_str()).unwrap();
        assert_eq!(algorithm["available"], algorithm["reason"].is_null());
    }
}

#[cfg(feature = "long-tests")]
#[test]
fn software_adapters_are_measured_only_when_asked_for() {
    let Some(devices) = devices_with_a_gpu("software_adapters") else { return };
    let adapters = devices["adapters"].as_array().unwrap();
    let real = adapters.iter().filter(|a| a["kind"] != "software").count();
    if real == adapters.len() {
        eprintln!("software_adapters is skipped: all adapters are real");
        return;
    }
    let usual = report(sapwise().args(TINY));
    assert_eq!(usual.hardware.gpus.len(), real);
    let asked = report(sapwise().args(TINY).arg("--software-gpus"));
    assert_eq!(asked.hardware.gpus.len(), adapters.len(), "{:?}", asked.remarks);
    assert!(asked.provenance.command.contains("--software-gpus"));
    for gpu in &asked.hardware.gpus {
        let names: Vec<&str> = gpu.parameters.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, sapwise_tune::hardware::GpuParameterId::OF_ONE);
    }
    for group in &asked.hardware.gpu_groups {
        let names: Vec<&str> = group.parameters.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, sapwise_tune::hardware::GpuParameterId::GROUP);
    }
    for algorithm in devices["algorithms"].as_array().unwrap().iter().filter(|a| a["available"] == true) {
        let timed = asked.algorithms.iter().any(|t| t.id.to_string() == algorithm["id"].as_str().unwrap());
        assert!(timed, "{} was not swept: {:?}", algorithm["id"], asked.remarks);
    }
    let none = report(sapwise().args(TINY).arg("--no-gpus"));
    assert!(none.hardware.gpus.is_empty() && none.algorithms.iter().all(|t| t.id.to_string().contains("@cpu")));
}

#[cfg(feature = "long-tests")]
#[test]
fn a_gpu_is_taken_by_its_number_and_one_that_is_not_there_is_wrong_usage() {
    failure(
        without_adapters(&mut sapwise()).args(TINY).args(["--gpu", "99"]),
        2,
        &["--gpu: this machine has no gpu99"],
    );
    let Some(devices) = devices_with_a_gpu("a_gpu_is_taken_by_its_number") else { return };
    // The last one: a program, or a GPU that is not the first.
    let last = devices["adapters"].as_array().unwrap().last().unwrap()["index"].as_u64().unwrap() as u32;
    let one = report(sapwise().args(TINY).args(["--gpu", &last.to_string()]));
    assert_eq!(one.hardware.gpus.iter().map(|g| g.gpu.index).collect::<Vec<_>>(), [last], "{:?}", one.remarks);
    use sapwise::algorithm::Backend;
    let others = |id: &sapwise::AlgorithmId| matches!(id.backend(), Backend::Gpu(list) if list[..] != [last]);
    assert!(!one.algorithms.iter().any(|t| others(&t.id)), "{:?}", one.algorithms);
}

#[test]
fn without_an_adapter_one_sentence_says_so_and_everything_else_works() {
    let text = success(without_adapters(&mut sapwise()).arg("predict"));
    assert_eq!(text.matches("GPU").count(), 1, "{text}");
    assert!(text.contains("No GPU was found; the algorithms on the CPU are not affected."), "{text}");
}

#[test]
fn a_model_of_gpus_predicts_the_gpus_of_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let own = made_up(folder.path(), "own.json", |_| {});
    let model = folder.path().join("model.json");
    let card = folder.path().join("card.md");
    success(sapwise().arg("train").arg(&own).arg("--out").arg(&model).arg("--card").arg(&card));
    let page = fs::read_to_string(&card).unwrap();
    assert!(page.contains("Kinds of GPU in the training: discrete; at most 2 together."), "{page}");
    let trained: Value = serde_json::from_str(&fs::read_to_string(&model).unwrap()).unwrap();
    let ranges = list(&trained["ranges"]);
    assert!(ranges.iter().any(|r| r["parameter"] == "gpu/round_trip_ns"), "{ranges:?}");
    let predict = |report: &Path, words: &[&str]| {
        let mut command = sapwise();
        answer(command.args(["predict", "--json", "--model"]).arg(&model).arg("--report").arg(report).args(words))
    };
    let tuning = predict(&own, &[]);
    assert!(ids(&tuning).contains(&"brute@gpu0") && ids(&tuning).contains(&"brute@gpu1"), "{tuning}");
    assert!(ids(&predict(&own, &["--no-gpus"])).iter().all(|id| id.contains("@cpu")));
    // The same machine with a program in place of its GPUs.
    let programs = made_up(folder.path(), "programs.json", |report| {
        for gpu in report["hardware"]["gpus"].as_array_mut().unwrap() {
            gpu["gpu"]["kind"] = "software".into();
        }
    });
    assert!(ids(&predict(&programs, &[])).iter().all(|id| id.contains("@cpu")));
    let tuning = predict(&programs, &["--software-gpus"]);
    assert!(ids(&tuning).contains(&"brute@gpu0"), "{tuning}");
    assert_eq!(tuning["extrapolated"], true);
    assert!(tuning["warnings"].to_string().contains("trained on discrete GPUs only"), "{tuning}");
}

#[test]
fn measured_tuning_leaves_out_software_adapters() {
    let folder = tempfile::tempdir().unwrap();
    let programs = made_up(folder.path(), "programs.json", |report| {
        report["hardware"]["gpus"][0]["gpu"]["kind"] = "software".into();
    });
    let measured = |words: &[&str]| {
        answer(sapwise().args(["predict", "--measured", "--json", "--report"]).arg(&programs).args(words))
    };
    assert!(ids(&measured(&[])).iter().all(|id| !id.contains("gpu0")));
    assert!(ids(&measured(&["--software-gpus"])).contains(&"brute@gpu0"));
}

#[test]
fn tuning_for_a_missing_gpu_is_run_on_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let steps = tuning(&[(0, "brute@cpu1"), (100, "grid-sap@gpu99")]);
    let path = write(folder.path(), "tuning.json", steps.to_string());
    let complaint = output(sapwise().arg("check").arg(&path), 1);
    assert!(complaint.contains("grid-sap@gpu99 can't run here: this machine has no gpu99"), "{complaint}");
    let run = ["run", "uniform", "--objects", "200", "--frames", "3", "--repeats", "1", "--json", "--tuning"];
    let told = answer(sapwise().args(run).arg(&path));
    assert!(told["warnings"].to_string().contains("this machine has no gpu99"), "{told}");
    assert_eq!(told["frames_run"], json!({"brute@cpu1": 3}));
}

#[test]
fn pairs_on_a_gpu_are_those_of_the_cpu() {
    let Some(devices) = devices_with_a_gpu("pairs_on_a_gpu") else { return };
    let folder = tempfile::tempdir().unwrap();
    let row: Vec<f32> = (0..500).flat_map(|k| [k as f32, 0.0, 0.0, k as f32 + 1.5, 1.0, 1.0]).collect();
    let boxes = npy(folder.path(), "boxes.npy", "<f4", "500, 6", &row);
    let on = |id: &str| answer(sapwise().arg("pairs").arg(&boxes).args(["--json", "--algorithm", id]));
    let right = on("brute@cpu1");
    let on_gpus = list(&devices["algorithms"]).iter().filter(|a| a["id"].as_str().unwrap().contains("@gpu"));
    for algorithm in on_gpus.filter(|a| a["available"] == true) {
        let told = on(algorithm["id"].as_str().unwrap());
        assert_eq!((&told["pairs"], &told["fingerprint"]), (&right["pairs"], &right["fingerprint"]), "{told}");
    }
}

/// A Vulkan driver that ends the process that loads it.
#[cfg(all(target_os = "linux", feature = "long-tests"))]
fn crashing_driver(folder: &Path) -> Option<PathBuf> {
    let source = folder.join("crash.rs");
    let code = "#[used]\n#[unsafe(link_section = \".init_array\")]\n\
                static CRASH: extern \"C\" fn() = { extern \"C\" fn crash() { std::process::abort() } crash };\n";
    fs::write(&source, code).unwrap();
    let library = folder.join("libcrash.so");
    let mut rustc = std::process::Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned()));
    let built = rustc.args(["--edition", "2024", "--crate-type", "cdylib", "-o"]).arg(&library).arg(&source).output();
    if !built.is_ok_and(|b| b.status.success()) {
        eprintln!("skipped: no driver that crashes can be built here");
        return None;
    }
    let icd = folder.join("crash.json");
    let text = json!({"file_format_version": "1.0.0", "ICD": {"library_path": library, "api_version": "1.1.0"}});
    fs::write(&icd, text.to_string()).unwrap();
    Some(icd)
}

#[cfg(all(target_os = "linux", feature = "long-tests"))]
#[test]
fn a_driver_that_crashes_costs_the_gpus_and_a_remark() {
    let folder = tempfile::tempdir().unwrap();
    let Some(icd) = crashing_driver(folder.path()) else { return };
    let with_it = || {
        let mut command = sapwise();
        command.env("VK_ICD_FILENAMES", &icd).env("VK_DRIVER_FILES", &icd);
        command
    };
    let devices = answer(with_it().args(["devices", "--json"]));
    if devices["remark"].is_null() {
        eprintln!("skipped: no Vulkan loader loads the driver that crashes");
        return;
    }
    assert!(devices["remark"].as_str().unwrap().contains("ended by signal 6"), "{devices}");
    let Report { remarks, points, .. } = report(with_it().args(TINY));
    assert!(remarks.iter().any(|r| r.contains("ended by signal 6")) && points.len() >= 2, "{remarks:?}");
    let predicted = answer(with_it().args(["predict", "--json"]));
    assert!(predicted["warnings"].to_string().contains("ended by signal 6"), "{predicted}");
    // No driver is loaded, so nothing crashes and nothing is said.
    let without = report(with_it().args(TINY).arg("--no-gpus"));
    assert!(!without.remarks.iter().any(|r| r.contains("signal") || r.contains("GPU")), "{:?}", without.remarks);
    let boxes = npy(folder.path(), "boxes.npy", "<f4", "1, 6", &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    failure(with_it().arg("pairs").arg(&boxes).args(["--algorithm", "grid-sap@gpu0"]), 2, &["ended by signal 6"]);
}
