//! Cards that are not there: what their driver reports is read and held against their specification, and nothing of them is timed.
//!
//! `eval "$(tools/fake-gpus.sh)"` before. Without its variables the tests say so and pass, unless `SAPWISE_REQUIRE_FAKE_GPU=1`: then they fail.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))]

mod common;

use common::{npy, sapwise, success};
use sapwise::GpuParameterId as Id;
use sapwise::How;
use serde_json::Value;

/// The chip, the name of the card that it poses as, and its memory in GiB.
const CARDS: [(&str, &str, f64); 4] = [
    ("polaris10", "POLARIS10", 8.0),
    ("vega10", "VEGA10", 8.0),
    ("navi21", "NAVI21", 16.0),
    ("navi31", "NAVI31", 24.0),
];

/// The command on a machine with this card and no other GPU; `None`, said aloud, without the shim.
fn with(card: &str) -> Option<assert_cmd::Command> {
    let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty());
    let (Some(shim), Some(icd)) = (variable("SAPWISE_FAKE_GPU_SHIM"), variable("SAPWISE_FAKE_GPU_ICD")) else {
        let required = variable("SAPWISE_REQUIRE_FAKE_GPU").is_some_and(|v| v == "1");
        assert!(!required, "SAPWISE_REQUIRE_FAKE_GPU=1, and tools/fake-gpus.sh has set no variables");
        eprintln!("skipped: tools/fake-gpus.sh has set no variables");
        return None;
    };
    let mut command = sapwise();
    command
        .env("AMDGPU_GPU_ID", card)
        .env("LD_PRELOAD", shim)
        .env("VK_DRIVER_FILES", &icd)
        .env("VK_ICD_FILENAMES", &icd);
    Some(command)
}

#[test]
fn memory_of_four_cards_agrees_with_their_specifications_and_nothing_is_timed() {
    for (card, name, gib) in CARDS {
        let Some(mut command) = with(card) else { return };
        let report =
            sapwise_lab::report::read(&success(command.args(["probe", "--hardware-only", "--json"]))).unwrap().value;
        let [gpu] = &report.hardware.gpus[..] else { panic!("{card}: {:?}", report.remarks) };
        assert!(gpu.gpu.name.contains(name), "{card}: {:?}", gpu.gpu);
        assert_eq!(gpu.value(Id::Executes), Some(0.0), "{card}: {:?}", report.remarks);
        let bytes = gib * f64::from(1 << 30);
        let memory = gpu.value(Id::MemoryBytes).unwrap();
        assert!((memory / bytes - 1.0).abs() < 0.01, "{card}: {memory}");
        for p in &gpu.parameters {
            assert_ne!(p.how, How::Measured, "{card}: {p:?}");
        }
        let timed = gpu.parameters.iter().find(|p| p.name == Id::RoundTripNs).unwrap();
        assert!(timed.source.contains("executes nothing"), "{card}: {timed:?}");
        let told = report.remarks.iter().filter(|r| r.contains("gpu0") && r.contains("executes nothing")).count();
        assert_eq!(told, 1, "{card}: {:?}", report.remarks);
    }
}

#[test]
fn devices_tells_that_a_card_executes_nothing() {
    let Some(mut command) = with("navi21") else { return };
    let answer: Value = serde_json::from_str(&success(command.args(["devices", "--json"]))).unwrap();
    let inert = answer["inert"].as_array().unwrap();
    assert!(inert.len() == 1 && inert[0].as_str().unwrap().contains("executes nothing"), "{answer}");
    for algorithm in answer["algorithms"].as_array().unwrap() {
        let on_gpu = algorithm["id"].as_str().unwrap().contains("@gpu");
        assert_eq!(algorithm["available"], !on_gpu, "{algorithm}");
        assert!(!on_gpu || algorithm["reason"].as_str().unwrap().contains("executes nothing"), "{algorithm}");
    }
    let text = success(with("navi21").unwrap().arg("devices"));
    assert!(text.contains("gpu0 (AMD Radeon RX 6800 (RADV NAVI21)) executes nothing"), "{text}");
}

#[test]
fn no_box_is_blamed_for_a_card_that_executes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let boxes =
        npy(folder.path(), "boxes.npy", "<f4", "2, 6", &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 2.0, 2.0, 2.0]);
    for method in ["brute", "sap", "grid-sap"] {
        let Some(mut command) = with("navi31") else { return };
        let algorithm = format!("{method}@gpu0");
        let ended = command.arg("pairs").arg(&boxes).args(["--algorithm", &algorithm]).output().unwrap();
        // Not `failure`: wgpu panics where a wait is over and its work is not done. That is caught, and has been printed by then.
        let complaint = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(1), "{complaint}");
        assert!(complaint.contains("gpu0 (AMD ") && complaint.contains("executes nothing"), "{complaint}");
        assert!(!complaint.contains("box 0"), "{complaint}");
    }
}
