//! What a probe would have found on a simulated machine: its true figures with the noise of a measurement.

use super::machine::{TrueGpu, TrueMachine};
use super::pairing::Build;
use sapwise_scenes::Random;
use sapwise::hardware::{GpuGroup, GpuHardware, GpuIdentity, GpuKind, How, Statistic, gpu, parameter};
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
        (parameter::USABLE_CORES.to_owned(), Reported(cpu.threads)),
        (parameter::PHYSICAL_CORES.to_owned(), Reported(cpu.cores)),
        (parameter::CLOCK_REPORTED_GHZ.to_owned(), Reported(spec.base_ghz)),
        (parameter::CLOCK_MEASURED_GHZ.to_owned(), Measured(cpu.ghz, 0.005)),
        (parameter::SIMD_LANES.to_owned(), Reported(cpu.lanes)),
        (parameter::CACHE_L1D_BYTES.to_owned(), Reported(cpu.cache_bytes[0])),
        (parameter::CACHE_L2_BYTES.to_owned(), Reported(cpu.cache_bytes[1])),
        (parameter::CACHE_LLC_BYTES.to_owned(), Reported(cpu.cache_bytes[2])),
        (parameter::MEMORY_BYTES.to_owned(), Reported(machine.memory_bytes())),
        (parameter::BANDWIDTH_ONE_THREAD_GB_PER_S.to_owned(), Measured(cpu.one_thread_gb_per_s, 0.05)),
        (parameter::BANDWIDTH_ALL_THREADS_GB_PER_S.to_owned(), Measured(cpu.all_threads_gb_per_s, 0.08)),
    ];
    figures.extend(
        parameter::LATENCY_WORKING_SETS_KIB
            .map(|kib| (parameter::latency_name(kib), Measured(cpu.latency_of(f64::from(kib) * 1024.0), 0.04))),
    );
    if cpu.threads > 1.0 {
        figures.extend([
            (parameter::FORK_JOIN_WARM_NS.to_owned(), Measured(cpu.fork_join_warm_ns, 0.4)),
            (parameter::FORK_JOIN_COLD_NS.to_owned(), Measured(cpu.fork_join_cold_ns, 0.4)),
            (parameter::SCALING_TWO_THREADS_RATIO.to_owned(), Measured(cpu.speed_up(2.0, cpu.second_thread), 0.01)),
            (parameter::SCALING_ALL_THREADS_RATIO.to_owned(), Measured(cpu.speed_up(cpu.threads, cpu.second_thread), 0.02)),
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
                &gpu::parameter::all_names(),
                of_gpu(figures, spec.inside.is_some(), spec),
                seed,
                &spec.name,
            ),
        })
        .collect();
    let group = machine.group.map(|group| {
        let figures = vec![
            (gpu::parameter::GROUP_UPLOAD_RATIO.to_owned(), Measured(group.upload, 0.03)),
            (gpu::parameter::GROUP_ROUND_TRIP_RATIO.to_owned(), Measured(group.round_trip, 0.03)),
            (gpu::parameter::GROUP_ARITHMETIC_RATIO.to_owned(), Measured(group.arithmetic, 0.01)),
        ];
        let names = gpu::parameter::GROUP.map(str::to_owned);
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
        parameters: parameters(&parameter::all_names(), figures, seed, &cpu.name),
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
    use gpu::parameter as name;
    let whole = |gb_per_s: f64| TRANSFER_BYTES / (TRANSFER_BYTES / gb_per_s + gpu.transfer_latency_ns);
    let figures = [
        (name::UPLOAD_GB_PER_S, Measured(whole(gpu.upload_gb_per_s), 0.03)),
        (name::UPLOAD_LATENCY_NS, Measured(gpu.transfer_latency_ns, 0.05)),
        (name::UPLOAD_RATE_GB_PER_S, Measured(gpu.upload_gb_per_s, 0.04)),
        (name::DOWNLOAD_GB_PER_S, Measured(whole(gpu.download_gb_per_s), 0.03)),
        (name::DOWNLOAD_LATENCY_NS, Measured(gpu.transfer_latency_ns, 0.05)),
        (name::DOWNLOAD_RATE_GB_PER_S, Measured(gpu.download_gb_per_s, 0.04)),
        (name::READ_GB_PER_S, Measured(gpu.read_gb_per_s, 0.02)),
        (name::COPY_GB_PER_S, Measured(gpu.copy_gb_per_s, 0.02)),
        (name::MEMORY_BYTES, Reported(gpu.memory_bytes)),
        (name::CLOCK_GHZ, Reported(spec.clock_ghz)),
        (name::PROCESSORS, Reported(f64::from(spec.processors))),
        (name::LANES, Reported(f64::from(spec.lanes))),
        (name::SUBMIT_NS, Measured(gpu.submit_ns, 0.05)),
        (name::ROUND_TRIP_NS, Measured(gpu.round_trip_ns, 0.06)),
        (name::DISPATCH_NS, Measured(gpu.dispatch_ns, 0.03)),
        (name::READ_BACK_NS, Measured(gpu.read_back_ns, 0.05)),
        (name::ARITHMETIC_GFLOP_PER_S, Measured(gpu.gflop_per_s, 0.01)),
        (name::UNIFIED_MEMORY, Reported(if unified { 1.0 } else { 0.0 })),
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
