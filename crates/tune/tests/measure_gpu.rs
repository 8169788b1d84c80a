//! The contract of every measurement of any GPU. No value is compared with a time: GPUs differ.
//!
//! Without a GPU these tests report that and pass; with `SAPWISE_REQUIRE_GPU=1` they fail.

#[path = "../../gpu/tests/common/mod.rs"]
mod common;
mod rules;

use common::{gpus, programs_own};
use sapwise_gpu::{Gpus, wgpu30 as wgpu};
use sapwise_tune::hardware::GpuParameterId;
use sapwise_tune::measure::{self, Options};
use sapwise_tune::{GpuKind, Parameter};

fn options() -> Options {
    Options::default().brief(true)
}

fn check(p: &Parameter) {
    rules::check(p, 1000);
    assert!(p.source != "not measured", "{p:?}");
}

#[test]
fn every_parameter_once_and_in_order() {
    let Some(gpus) = gpus() else { return };
    for index in 0..gpus.len() as u32 {
        let hardware = measure::gpu(&gpus, index, &options()).unwrap();
        assert_eq!(Some(&hardware.gpu), gpus.identities().nth(index as usize));
        let names: Vec<String> = hardware.parameters.iter().map(|p| p.name.clone()).collect();
        assert_eq!(names, GpuParameterId::OF_ONE);
        hardware.parameters.iter().for_each(check);
        // Every driver allows these.
        for name in [GpuParameterId::UploadGbPerS, GpuParameterId::RoundTripNs, GpuParameterId::ArithmeticGflopPerS] {
            assert!(hardware.value(name).is_some_and(|value| value > 0.0), "{name}");
        }
        assert!(hardware.value(GpuParameterId::MemoryBytes).is_some_and(|bytes| bytes > 1e8));
        if hardware.gpu.kind == GpuKind::Software {
            for name in [GpuParameterId::ClockGhz, GpuParameterId::Processors, GpuParameterId::Lanes] {
                let p = hardware.parameters.iter().find(|p| p.name == name).unwrap();
                assert!(p.value.is_none() && p.source.contains("program on the CPU"), "{p:?}");
            }
        }
    }
}

#[test]
fn groups_of_gpus() {
    let Some(gpus) = gpus() else { return };
    assert!(measure::gpu_group(&gpus, &[0], &options()).is_err());
    assert!(measure::gpu_group(&gpus, &[0, 0], &options()).is_err());
    if gpus.len() < 2 {
        println!("skipped: there is one GPU");
        return;
    }
    let group = measure::gpu_group(&gpus, &[1, 0, 1], &options()).unwrap();
    assert_eq!(group.gpus, [0, 1]);
    assert_eq!(group.parameters.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), GpuParameterId::GROUP);
    group.parameters.iter().for_each(check);
    assert!(group.parameters.iter().all(|p| p.value.is_some_and(|value| value > 0.0)), "{group:?}");
}

#[test]
fn a_gpu_that_is_not_there() {
    assert!(measure::gpu(&Gpus::none(), 0, &options()).is_err());
    assert!(measure::gpu_group(&Gpus::none(), &[0, 1], &options()).is_err());
}

/// Measuring the program's own device, within a limit, gets all that predictions read.
#[test]
fn a_given_gpu_is_measured_on_its_own_device() {
    let Some(gpus) = gpus() else { return };
    let given = Gpus::of([programs_own(&gpus, 0, &wgpu::DeviceDescriptor::default())]);
    let options = Options::default().with_limit(std::time::Duration::ZERO);
    let measured = measure::gpu(&given, 0, &options).unwrap();
    assert_eq!(measured.parameters.iter().map(|p| p.name.clone()).collect::<Vec<_>>(), GpuParameterId::OF_ONE);
    for name in [
        GpuParameterId::RoundTripNs,
        GpuParameterId::ReadBackNs,
        GpuParameterId::DispatchNs,
        GpuParameterId::UploadGbPerS,
        GpuParameterId::DownloadGbPerS,
        GpuParameterId::ReadGbPerS,
        GpuParameterId::CopyGbPerS,
        GpuParameterId::ArithmeticGflopPerS,
    ] {
        // Its value may be 0: there is one sample, beside other tests.
        assert!(measured.value(name).is_some(), "{name}: {:?}", measured.parameters);
    }
    let clock = measured.parameters.iter().find(|p| p.name == GpuParameterId::ClockGhz).unwrap();
    assert!(clock.source.contains("time limit"));
}
