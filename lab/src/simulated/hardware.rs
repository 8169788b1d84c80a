//! What a probe would have found on a simulated machine: its true figures with the noise of a measurement.

use super::machine::{TrueGpu, TrueMachine};
use super::pairing::Build;
use sapwise_scenes::Random;
use sapwise::hardware::{GpuGroup, GpuHardware, GpuIdentity, GpuKind, How, Statistic, GpuParameterId, ParameterId};
use sapwise::{Hardware, Machine, Parameter};

/// Why a parameter that probes measure is not simulated.
const NOT_SIMULATED: &str = "not simulated: no cost depends on it";
/// Bytes in the transfers of the paper.
const TRANSFER_BYTES: f64 = 33_554_432.0;

/// How a figure would have been found.
enum Figure {
    /// Told by the system, without error.
    Reported(f64),
    /// Measured; the deviation of the logarithm of a sample.
    Measured(f64, f64),
}
use Figure::{Measured, Reported};

/// The hardware as a report holds it.
pub(super) fn hardware(build: &Build<'_>, machine: &TrueMachine) -> Hardware {
    let seed = machine.seed;
    let cpu = &machine.cpu;
    let spec = build.cpu;
    let mut figures = vec![
        (ParameterId::UsableCores.to_owned(), Reported(cpu.threads)),
        (ParameterId::PhysicalCores.to_owned(), Reported(cpu.cores)),
        (ParameterId::ClockReportedGhz.to_owned(), Reported(spec.base_ghz)),
        (ParameterId::ClockMeasuredGhz.to_owned(), Measured(cpu.ghz, 0.005)),
        (ParameterId::SimdLanes.to_owned(), Reported(cpu.lanes)),
        (ParameterId::CacheL1dBytes.to_owned(), Reported(cpu.cache_bytes[0])),
        (ParameterId::CacheL2Bytes.to_owned(), Reported(cpu.cache_bytes[1])),
        (ParameterId::CacheLlcBytes.to_owned(), Reported(cpu.cache_bytes[2])),
        (ParameterId::MemoryBytes.to_owned(), Reported(machine.memory_bytes())),
        (ParameterId::BandwidthOneThreadGbPerS.to_owned(), Measured(cpu.one_thread_gb_per_s, 0.05)),
        (ParameterId::BandwidthAllThreadsGbPerS.to_owned(), Measured(cpu.all_threads_gb_per_s, 0.08)),
    ];
    figures.extend(
        parameter::LATENCY_WORKING_SETS_KIB
            .map(|kib| (parameter::latency_name(kib), Measured(cpu.latency_of(f64::from(kib) * 1024.0), 0.04))),
    );
    if cpu.threads > 1.0 {
        figures.extend([
            (ParameterId::ForkJoinWarmNs.to_owned(), Measured(cpu.fork_join_warm_ns, 0.4)),
            (ParameterId::ForkJoinColdNs.to_owned(), Measured(cpu.fork_join_cold_ns, 0.4)),
            (ParameterId::ScalingTwoThreadsRatio.to_owned(), Measured(cpu.speed_up(2.0, cpu.second_thread), 0.01)),
            (ParameterId::ScalingAllThreadsRatio.to_owned(), Measured(cpu.speed_up(cpu.threads, cpu.second_thread), 0.02)),
        ]);
    }
    let gpus: Vec<GpuHardware> = identities(machine)
        .into_iter()
        .zip(&machine.gpus)
        .zip(&build.gpus)
        .map(|((gpu, figures), spec)| GpuHardware {
            gpu: GpuIdentity {
                device: format!("{}:0000", spec.vendor),
                kind: if spec.inside.is_some() { GpuKind::Integrated } else { GpuKind::Discrete },
                ..gpu
            },
            parameters: parameters(
                &GpuParameterId::OF_ONE,
                of_gpu(figures, spec.inside.is_some(), spec),
                seed,
                &spec.name,
            ),
        })
        .collect();
    let group = machine.group.map(|group| {
        let figures = vec![
            (GpuParameterId::GroupUploadRatio.to_owned(), Measured(group.upload, 0.03)),
            (GpuParameterId::GroupRoundTripRatio.to_owned(), Measured(group.round_trip, 0.03)),
            (GpuParameterId::GroupArithmeticRatio.to_owned(), Measured(group.arithmetic, 0.01)),
        ];
        let names = GpuParameterId::GROUP.map(str::to_owned);
        GpuGroup { gpus: (0..gpus.len() as u32).collect(), parameters: parameters(&names, figures, seed, &cpu.name) }
    });
    Hardware {
        machine: Machine {
            physical_id: build.physical_id(),
            cpu: format!("{} (simulated)", spec.name),
            vendor: spec.vendor.clone(),
            arch: spec.arch.clone(),
            os: "linux".to_owned(),
            simd: spec.simd.level().0.to_string(),
            hypervisor: "none".to_owned(),
        },
        parameters: parameters(&ParameterId::ALL, figures, seed, &cpu.name),
        gpus,
        gpu_groups: group.into_iter().collect(),
    }
}

/// The GPUs by their numbers, in the order of the machine. Their kinds stand in [`hardware`] only; here all are cards.
pub(super) fn identities(machine: &TrueMachine) -> Vec<GpuIdentity> {
    let identity = |(k, gpu): (usize, &TrueGpu)| GpuIdentity {
        index: k as u32,
        name: format!("{} (simulated)", gpu.name),
        device: String::new(),
        driver: "simulated".to_owned(),
        api: "vulkan".to_owned(),
        kind: GpuKind::Discrete,
    };
    machine.gpus.iter().enumerate().map(identity).collect()
}

fn of_gpu(gpu: &TrueGpu, unified: bool, spec: &super::specification::Gpu) -> Vec<(String, Figure)> {
    let whole = |gb_per_s: f64| TRANSFER_BYTES / (TRANSFER_BYTES / gb_per_s + gpu.transfer_latency_ns);
    let figures = [
        (GpuParameterId::UploadGbPerS, Measured(whole(gpu.upload_gb_per_s), 0.03)),
        (GpuParameterId::UploadLatencyNs, Measured(gpu.transfer_latency_ns, 0.05)),
        (GpuParameterId::UploadRateGbPerS, Measured(gpu.upload_gb_per_s, 0.04)),
        (GpuParameterId::DownloadGbPerS, Measured(whole(gpu.download_gb_per_s), 0.03)),
        (GpuParameterId::DownloadLatencyNs, Measured(gpu.transfer_latency_ns, 0.05)),
        (GpuParameterId::DownloadRateGbPerS, Measured(gpu.download_gb_per_s, 0.04)),
        (GpuParameterId::ReadGbPerS, Measured(gpu.read_gb_per_s, 0.02)),
        (GpuParameterId::CopyGbPerS, Measured(gpu.copy_gb_per_s, 0.02)),
        (GpuParameterId::MemoryBytes, Reported(gpu.memory_bytes)),
        (GpuParameterId::ClockGhz, Reported(spec.clock_ghz)),
        (GpuParameterId::Processors, Reported(f64::from(spec.processors))),
        (GpuParameterId::Lanes, Reported(f64::from(spec.lanes))),
        (GpuParameterId::SubmitNs, Measured(gpu.submit_ns, 0.05)),
        (GpuParameterId::RoundTripNs, Measured(gpu.round_trip_ns, 0.06)),
        (GpuParameterId::DispatchNs, Measured(gpu.dispatch_ns, 0.03)),
        (GpuParameterId::ReadBackNs, Measured(gpu.read_back_ns, 0.05)),
        (GpuParameterId::ArithmeticGflopPerS, Measured(gpu.gflop_per_s, 0.01)),
        (GpuParameterId::UnifiedMemory, Reported(if unified { 1.0 } else { 0.0 })),
    ];
    figures.into_iter().map(|(name, figure)| (name.to_owned(), figure)).collect()
}

/// The parameters of these names, in their order; those without a figure are missing.
fn parameters(names: &[String], figures: Vec<(String, Figure)>, seed: u64, part: &str) -> Vec<Parameter> {
    let one = |name: &String| match figures.iter().find(|f| f.0 == *name) {
        Some((_, figure)) => found(name, figure, seed, part),
        None => Parameter::missing(name, NOT_SIMULATED),
    };
    names.iter().map(one).collect()
}

/// Samples behind a measured figure.
const SAMPLES: u32 = 16;

fn found(name: &str, figure: &Figure, seed: u64, part: &str) -> Parameter {
    match *figure {
        Reported(value) => Parameter::reported(name, value, "simulated: from the specification"),
        Measured(value, sigma) => {
            let mut random = Random::named(seed, &[part, "measured", name]);
            let samples: Vec<f64> = (0..SAMPLES).map(|_| value * random.log_normal(sigma)).collect();
            Parameter {
                name: name.to_owned(),
                value: sapwise::stats::median(&samples),
                dispersion: sapwise::stats::relative_iqr(&samples),
                samples: SAMPLES,
                spoiled: 0,
                foreign_load: None,
                how: How::Measured,
                source: "simulated: from the specification, with the noise of a measurement".to_owned(),
                statistic: Statistic::Median,
                // A simulated report shows what a measurement would give; nobody has to check how it came about.
                raw: Vec::new(),
            }
        }
    }
}
