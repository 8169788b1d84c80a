//! How a report was made, and which label that gives it.

use crate::algorithms::Algorithms;
use crate::args::Probe;
use crate::date;
use crate::gpus::uses;
use sapwise::algorithm::{Entry, SimdLevel, usable_cores};
use sapwise_lab::report::{Label, Point, Provenance, Restricted, Restriction, Timed, TimedTerm};
use sapwise_tune::stats::median;
use sapwise_tune::{GpuKind, Hardware};
use std::time::Duration;

/// Share of the CPU that other programs take at half of the points of a contended machine.
const CONTENDED_LOAD: f64 = 0.2;

/// Returns the provenance of a report by these arguments.
pub(crate) fn provenance(arguments: &Probe, hardware: &Hardware, took: Duration) -> Provenance {
    let gpu_threads = gpu_threads(hardware);
    Provenance {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        date: date::today(),
        command: command(arguments),
        seed: arguments.seed,
        threads: arguments.threads,
        simd: requested_level().map(|level| level.to_string()),
        gpu_threads,
        restriction: restriction(arguments.threads, gpu_threads),
        optimised: !cfg!(debug_assertions),
        seconds: (took.as_secs_f64() * 10.0).round() / 10.0,
    }
}

/// Returns the restriction of the machine by these limits and the environment, if any.
fn restriction(threads: Option<u32>, gpu_threads: Option<u32>) -> Option<Restriction> {
    let all = usable_cores();
    let mut kinds = Vec::new();
    kinds.extend(threads.filter(|&k| k < all).map(|_| Restricted::Threads));
    kinds.extend((SimdLevel::in_use() < SimdLevel::detected()).then_some(Restricted::Simd));
    // lavapipe takes one thread for each core by itself.
    kinds.extend(gpu_threads.filter(|&k| k < all).map(|_| Restricted::GpuThreads));
    (!kinds.is_empty()).then_some(Restriction { kinds, proof: Vec::new() })
}

/// Returns `LP_NUM_THREADS`, the threads of lavapipe (which names itself llvmpipe), when that is among these GPUs.
fn gpu_threads(hardware: &Hardware) -> Option<u32> {
    let asked = std::env::var("LP_NUM_THREADS").ok()?.trim().parse().ok()?;
    let is_lavapipe = |name: &str| name.to_ascii_lowercase().contains("llvmpipe");
    hardware.gpus.iter().any(|g| is_lavapipe(&g.gpu.name)).then_some(asked)
}

/// Returns the kind of evidence of these points.
pub(crate) fn label(arguments: &Probe, points: &[Point], hardware: &Hardware) -> Label {
    let software = |k: &u32| hardware.gpu(*k).is_some_and(|g| g.gpu.kind == GpuKind::Software);
    let on_software_gpu = points
        .iter()
        .flat_map(|p| &p.timings)
        .any(|t| !t.samples_ns.is_empty() && uses(&t.algorithm).iter().any(software));
    let fewer_cores = arguments.threads.is_some_and(|k| k < usable_cores());
    let lower_level = requested_level().is_some_and(|level| level < SimdLevel::detected());
    let loads: Vec<f64> = points.iter().filter_map(|p| p.foreign_load).collect();
    // Contention comes first: the timings of a disturbed machine are not explained by its restriction.
    if median(&loads).is_some_and(|load| load > CONTENDED_LOAD) {
        Label::RealContended
    } else if on_software_gpu {
        Label::RealSoftwareGpu
    } else if fewer_cores || lower_level {
        Label::RealRestricted
    } else {
        Label::RealFull
    }
}

/// Returns the algorithms with timings at these points in the order of the registry, then those of the GPUs.
pub(crate) fn timed(
    points: &[Point],
    threads: Option<u32>,
    hardware: &Hardware,
    algorithms: &Algorithms,
) -> Vec<Timed> {
    let registry = algorithms.registry(threads.unwrap_or_else(usable_cores));
    let raced = |id| points.iter().any(|p| p.timings.iter().any(|t| t.algorithm == id));
    let on_gpus = sapwise_gpu::algorithms(hardware.gpus.iter().map(|g| &g.gpu));
    let entries = registry.available().into_iter().chain(on_gpus);
    let timed = |Entry { id, revision, .. }: Entry| {
        let terms = algorithms.terms(&id).iter().map(|&(term, scale)| TimedTerm { term, scale }).collect();
        Timed { terms, ..Timed::new(id, revision) }
    };
    entries.filter(|e| raced(e.id.clone())).map(timed).collect()
}

/// Returns the SIMD level that the environment forces. The program has refused a wrong one before.
fn requested_level() -> Option<SimdLevel> {
    SimdLevel::requested().ok().flatten()
}

/// Returns the arguments without `--out`, because paths name users.
pub(crate) fn command(arguments: &Probe) -> String {
    let mut words = vec!["probe".to_owned()];
    let flags = [("--hardware-only", arguments.hardware_only), ("--quick", arguments.quick)];
    words.extend(flags.iter().filter(|f| f.1).map(|f| f.0.to_owned()));
    words.extend(arguments.gpus.words().split_whitespace().map(str::to_owned));
    words.extend(arguments.threads.map(|k| format!("--threads {k}")));
    words.push(format!("--seed {}", arguments.seed));
    words.extend(arguments.max_objects.map(|n| format!("--max-objects {n}")));
    words.extend(arguments.scenarios.iter().map(|s| format!("--scenario {s}")));
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_lab::report::Timing;
    use sapwise_tune::{GpuHardware, GpuIdentity, Machine};

    fn point(foreign_load: Option<f64>) -> Point {
        Point { scenario: "uniform".to_owned(), foreign_load, ..Point::default() }
    }

    #[test]
    fn the_command_holds_no_path() {
        let arguments = Probe::of("--quick --out /home/someone/r.json --threads 1 --scenario slab --no-gpus");
        assert_eq!(command(&arguments), "probe --quick --no-gpus --threads 1 --seed 1 --scenario slab");
        assert_eq!(command(&Probe::of("--gpu 0 --gpu 2")), "probe --gpu 0 --gpu 2 --seed 1");
    }

    #[test]
    fn contention_and_restriction_are_labelled() {
        let quiet = [point(Some(0.01)), point(None), point(Some(0.9)), point(Some(0.0))];
        let busy = [point(Some(0.3)), point(Some(0.4)), point(Some(0.0))];
        let label = |words: &str, points: &[Point]| label(&Probe::of(words), points, &hardware(GpuKind::Discrete));
        assert_eq!(label("", &busy), Label::RealContended);
        if requested_level().is_none() {
            assert_eq!(label("", &quiet), Label::RealFull);
        }
        if usable_cores() > 1 {
            assert_eq!(label("--threads 1", &quiet), Label::RealRestricted);
        }
    }

    fn hardware(kind: GpuKind) -> Hardware {
        let gpus = vec![GpuHardware::new(GpuIdentity::new(0, "", kind), Vec::new())];
        Hardware::new(Machine::default(), Vec::new()).with_gpus(gpus)
    }

    #[test]
    fn a_swept_software_adapter_is_labelled() {
        let timing =
            |samples_ns: Vec<u64>| Timing { algorithm: "brute@gpu0".parse().unwrap(), samples_ns, error: None };
        let swept = [Point { timings: vec![timing(vec![1, 2, 3])], ..point(None) }];
        let failed = [Point { timings: vec![timing(Vec::new())], ..point(None) }];
        let software = hardware(GpuKind::Software);
        assert_eq!(label(&Probe::of(""), &swept, &software), Label::RealSoftwareGpu);
        assert_ne!(label(&Probe::of(""), &failed, &software), Label::RealSoftwareGpu);
        assert_ne!(label(&Probe::of(""), &swept, &hardware(GpuKind::Discrete)), Label::RealSoftwareGpu);
        assert_eq!(timed(&swept, Some(1), &software, &Algorithms::default())[0].id.to_string(), "brute@gpu0");
    }
}
