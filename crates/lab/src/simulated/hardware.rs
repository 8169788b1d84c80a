//! What a probe would have found on a simulated machine: its true figures with the noise of a measurement.

use super::machine::{TrueGpu, TrueMachine};
use super::pairing::Build;
use sapwise::hardware::{GpuGroup, GpuHardware, GpuIdentity, GpuKind, GpuParameterId, ParameterId, Statistic};
use sapwise::{Hardware, Machine, Parameter};
use sapwise_scenes::Random;

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
        (ParameterId::UsableCores, Reported(cpu.threads)),
        (ParameterId::PhysicalCores, Reported(cpu.cores)),
        (ParameterId::ClockReportedGhz, Reported(spec.base_ghz)),
        (ParameterId::ClockMeasuredGhz, Measured(cpu.ghz, 0.005)),
        (ParameterId::SimdLanes, Reported(cpu.lanes)),
        (ParameterId::CacheL1dBytes, Reported(cpu.cache_bytes[0])),
        (ParameterId::CacheL2Bytes, Reported(cpu.cache_bytes[1])),
        (ParameterId::CacheLlcBytes, Reported(cpu.cache_bytes[2])),
        (ParameterId::MemoryBytes, Reported(machine.memory_bytes())),
        (ParameterId::BandwidthOneThreadGbPerS, Measured(cpu.one_thread_gb_per_s, 0.05)),
        (ParameterId::BandwidthAllThreadsGbPerS, Measured(cpu.all_threads_gb_per_s, 0.08)),
    ];
    figures
        .extend(ParameterId::LATENCIES.map(|(kib, id)| (id, Measured(cpu.latency_of(f64::from(kib) * 1024.0), 0.04))));
    if cpu.threads > 1.0 {
        figures.extend([
            (ParameterId::ForkJoinWarmNs, Measured(cpu.fork_join_warm_ns, 0.4)),
            (ParameterId::ForkJoinColdNs, Measured(cpu.fork_join_cold_ns, 0.4)),
            (ParameterId::ScalingTwoThreadsRatio, Measured(cpu.speed_up(2.0, cpu.second_thread), 0.01)),
            (ParameterId::ScalingAllThreadsRatio, Measured(cpu.speed_up(cpu.threads, cpu.second_thread), 0.02)),
        ]);
    }
    let gpus: Vec<GpuHardware> = identities(machine)
        .into_iter()
        .zip(&machine.gpus)
        .zip(&build.gpus)
        .map(|((gpu, figures), spec)| {
            let kind = if spec.inside.is_some() { GpuKind::Integrated } else { GpuKind::Discrete };
            let identity = GpuIdentity::new(gpu.index, gpu.name, kind);
            let identity = identity.with_driver(format!("{}:0000", spec.vendor), gpu.driver, gpu.api);
            let figures = of_gpu(figures, spec.inside.is_some(), spec);
            GpuHardware::new(identity, parameters(&GpuParameterId::OF_ONE, &figures, seed, &spec.name))
        })
        .collect();
    let group = machine.group.map(|group| {
        let figures = [
            (GpuParameterId::GroupUploadRatio, Measured(group.upload, 0.03)),
            (GpuParameterId::GroupRoundTripRatio, Measured(group.round_trip, 0.03)),
            (GpuParameterId::GroupArithmeticRatio, Measured(group.arithmetic, 0.01)),
        ];
        let parameters = parameters(&GpuParameterId::GROUP, &figures, seed, &cpu.name);
        GpuGroup::new((0..gpus.len() as u32).collect(), parameters)
    });
    let mut machine = Machine::of(build.physical_id());
    machine.cpu = format!("{} (simulated)", spec.name);
    machine.vendor.clone_from(&spec.vendor);
    machine.arch.clone_from(&spec.arch);
    machine.os = "linux".to_owned();
    machine.simd = spec.simd.level().0.to_string();
    machine.hypervisor = "none".to_owned();
    Hardware::new(machine, parameters(&ParameterId::ALL, &figures, seed, &cpu.name))
        .with_gpus(gpus)
        .with_gpu_groups(group.into_iter().collect())
}

/// The GPUs by their numbers, in the order of the machine. Their kinds stand in [`hardware`] only; here all are cards.
pub(super) fn identities(machine: &TrueMachine) -> Vec<GpuIdentity> {
    let identity = |(k, gpu): (usize, &TrueGpu)| {
        let identity = GpuIdentity::new(k as u32, format!("{} (simulated)", gpu.name), GpuKind::Discrete);
        identity.with_driver("", "simulated", "vulkan")
    };
    machine.gpus.iter().enumerate().map(identity).collect()
}

fn of_gpu(gpu: &TrueGpu, unified: bool, spec: &super::specification::Gpu) -> Vec<(GpuParameterId, Figure)> {
    let whole = |gb_per_s: f64| TRANSFER_BYTES / (TRANSFER_BYTES / gb_per_s + gpu.transfer_latency_ns);
    vec![
        (GpuParameterId::UploadGbPerS, Measured(whole(gpu.upload_gb_per_s), 0.03)),
        (GpuParameterId::UploadRateGbPerS, Measured(gpu.upload_gb_per_s, 0.04)),
        (GpuParameterId::DownloadGbPerS, Measured(whole(gpu.download_gb_per_s), 0.03)),
        (GpuParameterId::DownloadRateGbPerS, Measured(gpu.download_gb_per_s, 0.04)),
        (GpuParameterId::ReadGbPerS, Measured(gpu.read_gb_per_s, 0.02)),
        (GpuParameterId::CopyGbPerS, Measured(gpu.copy_gb_per_s, 0.02)),
        (GpuParameterId::MemoryBytes, Reported(gpu.memory_bytes)),
        (GpuParameterId::ClockGhz, Reported(spec.clock_ghz)),
        (GpuParameterId::Processors, Reported(f64::from(spec.processors))),
        (GpuParameterId::Lanes, Reported(f64::from(spec.lanes))),
        (GpuParameterId::RoundTripNs, Measured(gpu.round_trip_ns, 0.06)),
        (GpuParameterId::DispatchNs, Measured(gpu.dispatch_ns, 0.03)),
        (GpuParameterId::ReadBackNs, Measured(gpu.read_back_ns, 0.05)),
        (GpuParameterId::ArithmeticGflopPerS, Measured(gpu.gflop_per_s, 0.01)),
    ]
}

/// These parameters in their order; those without a figure are missing.
fn parameters<Id: Copy + PartialEq + AsRef<str>>(
    ids: &[Id],
    figures: &[(Id, Figure)],
    seed: u64,
    component: &str,
) -> Vec<Parameter> {
    let one = |id: &Id| match figures.iter().find(|f| f.0 == *id) {
        Some((_, figure)) => found(id.as_ref(), figure, seed, component),
        None => Parameter::missing(id, NOT_SIMULATED),
    };
    ids.iter().map(one).collect()
}

/// Samples behind a measured figure.
const SAMPLES: u32 = 16;

fn found(name: &str, figure: &Figure, seed: u64, component: &str) -> Parameter {
    match *figure {
        Reported(value) => Parameter::reported(name, value, "simulated: from the specification"),
        Measured(value, sigma) => {
            let mut random = Random::named(seed, &[component, "measured", name]);
            let samples: Vec<f64> = (0..SAMPLES).map(|_| value * random.log_normal(sigma)).collect();
            let source = "simulated: from the specification, with the noise of a measurement";
            let mut parameter = Parameter::from_samples(name, Statistic::Median, samples, source);
            // A simulated report shows what a measurement would find; nobody has to check how it came about.
            parameter.raw.clear();
            parameter
        }
    }
}
