//! The contract of every measurement of any GPU. No value is compared with a time: GPUs differ.
//!
//! Without a GPU these tests report that and pass; with `SAPWISE_REQUIRE_GPU=1` they fail.

#[path = "../../gpu/tests/common/mod.rs"]
mod common;
mod rules;

use common::gpus;
use sapwise_gpu::{Gpu, Gpus, wgpu30 as wgpu};
use sapwise_tune::hardware::GpuParameterId;
use sapwise_tune::measure::{self, Options};
use sapwise_tune::{GpuKind, Parameter};

fn options(brief: bool) -> Options {
    Options::default().brief(brief)
}

fn check(p: &Parameter) {
    rules::check(p, 1000);
    assert!(p.source != "not measured", "{p:?}");
}

fn show(parameters: &[Parameter]) {
    for p in parameters {
        let (value, spread) = (p.value.unwrap_or(f64::NAN), p.dispersion.unwrap_or(f64::NAN));
        let (name, foreign) = (&p.name, p.foreign_load.unwrap_or(0.0));
        println!(
            "{name:32} {value:>16.3}  ±{spread:.3}  n={:<4} foreign {foreign:.2}  {:?}: {}",
            p.samples, p.how, p.source
        );
    }
}

#[test]
fn every_parameter_once_and_in_order() {
    let Some(gpus) = gpus() else { return };
    for index in 0..gpus.len() as u32 {
        let hardware = measure::gpu(&gpus, index, &options(true)).unwrap();
        assert_eq!(Some(&hardware.gpu), gpus.identities().nth(index as usize));
        let names: Vec<String> = hardware.parameters.iter().map(|p| p.name.clone()).collect();
        assert_eq!(names, GpuParameterId::OF_ONE);
        hardware.parameters.iter().for_each(check);
        show(&hardware.parameters);
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
    assert!(measure::gpu_group(&gpus, &[0], &options(true)).is_err());
    assert!(measure::gpu_group(&gpus, &[0, 0], &options(true)).is_err());
    if gpus.len() < 2 {
        println!("skipped: there is one GPU");
        return;
    }
    let group = measure::gpu_group(&gpus, &[1, 0, 1], &options(true)).unwrap();
    assert_eq!(group.gpus, [0, 1]);
    assert_eq!(group.parameters.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), GpuParameterId::GROUP);
    group.parameters.iter().for_each(check);
    assert!(group.parameters.iter().all(|p| p.value.is_some_and(|value| value > 0.0)), "{group:?}");
}

#[test]
fn a_gpu_that_is_not_there() {
    assert!(measure::gpu(&Gpus::none(), 0, &options(true)).is_err());
    assert!(measure::gpu_group(&Gpus::none(), &[0, 1], &options(true)).is_err());
}

/// Prints the values of this machine:
/// `cargo test -p sapwise-tune --features gpu --test measure_gpu -- --ignored --nocapture`.
#[test]
#[ignore = "takes seconds for each GPU"]
fn the_whole_measurement() {
    let Some(gpus) = gpus() else { return };
    for index in 0..gpus.len() as u32 {
        let start = std::time::Instant::now();
        let hardware = measure::gpu(&gpus, index, &options(false)).unwrap();
        println!("\n{:?}, {:.2} s", hardware.gpu, start.elapsed().as_secs_f64());
        show(&hardware.parameters);
        hardware.parameters.iter().for_each(check);
    }
    if gpus.len() > 1 {
        let all: Vec<u32> = (0..gpus.len() as u32).collect();
        let start = std::time::Instant::now();
        let group = measure::gpu_group(&gpus, &all, &options(false)).unwrap();
        println!("\n{all:?}, {:.2} s", start.elapsed().as_secs_f64());
        show(&group.parameters);
    }
}

/// Measuring the program's own device, within a limit, gets all that predictions read.
#[test]
fn a_given_gpu_is_measured_on_its_own_device() {
    let Some(gpus) = gpus() else { return };
    let opened = gpus.adapter(0).unwrap().request_device(&wgpu::DeviceDescriptor::default());
    let (device, queue) = pollster::block_on(opened).unwrap();
    let identity = sapwise_gpu::identity(0, &device.adapter_info());
    let given = Gpus::of([Gpu::from_parts(device, queue, identity)]);
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
