//! What is taken from a machine for a report, and the proof that its parameters show it.

use crate::args::Lifted;
use crate::contention::{ASSUMED_LLC_BYTES, Contended};
use crate::output;
use anyhow::bail;
use sapwise::hardware::{GpuParameterId, ParameterId};
use sapwise::{GpuHardware, GpuIdentity, Hardware, SimdLevel, usable_cores};
use sapwise_lab::data::Document;
use sapwise_lab::data::read_document;
use sapwise_lab::report::{Proof, Restricted, Restriction};

/// The variable that sets the threads of lavapipe.
pub(crate) const LAVAPIPE_THREADS: &str = "LP_NUM_THREADS";

/// A parameter shows a restriction when it differs by this share of its value without. Smaller differences come by themselves
/// from one run to the next.
const SHOWN: f64 = 0.1;

/// The hardware of a report from which one thing less was taken.
pub(crate) type Reference = (Restricted, Hardware);

/// Reads what [`restriction`] compares with.
///
/// # Errors
/// When a file is no sound report.
pub(crate) fn references(lifted: &[Lifted]) -> anyhow::Result<Vec<Reference>> {
    let read = |l: &Lifted| match read_document(&l.report, &output::warn)? {
        Document::Report(report) => Ok((l.kind, report.hardware)),
        _ => bail!("{} is no report", l.report.display()),
    };
    lifted.iter().map(read).collect()
}

/// Whether a GPU is lavapipe, which calls itself llvmpipe.
pub(crate) fn is_lavapipe(gpu: &GpuIdentity) -> bool {
    gpu.name.to_ascii_lowercase().contains("llvmpipe")
}

/// The threads that lavapipe is told to use, where it is among these GPUs. What is no number it ignores as well.
pub(crate) fn gpu_threads(hardware: &Hardware) -> Option<u32> {
    let told = std::env::var(LAVAPIPE_THREADS).ok()?.trim().parse().ok()?;
    hardware.gpus.iter().any(|g| is_lavapipe(&g.gpu)).then_some(told)
}

/// What a limit on the threads, contention and the environment take from the machine, if anything.
pub(crate) fn restriction(
    threads: Option<u32>,
    contended: Option<Contended>,
    hardware: &Hardware,
    references: &[Reference],
) -> Option<Restriction> {
    let mut kinds = Vec::new();
    if threads.is_some_and(|k| k < usable_cores()) {
        kinds.push(Restricted::Threads);
    }
    if SimdLevel::in_use() < SimdLevel::detected() {
        kinds.push(Restricted::Simd);
    }
    kinds.extend(contended.map(contention));
    // One thread for each core is what it takes by itself.
    if gpu_threads(hardware).is_some_and(|k| k < usable_cores()) {
        kinds.push(Restricted::GpuThreads);
    }
    let proofs = |kind: &Restricted| {
        let without = references.iter().find(|(of, _)| of == kind);
        without.map_or(Vec::new(), |(_, without)| prove(*kind, without, hardware))
    };
    let proof = kinds.iter().flat_map(proofs).collect();
    (!kinds.is_empty()).then_some(Restriction { kinds, proof })
}

/// What contention of a kind takes.
pub(crate) fn contention(kind: Contended) -> Restricted {
    match kind {
        Contended::Memory => Restricted::ContendedMemory,
        Contended::Cache => Restricted::ContendedCache,
    }
}

/// Whether a parameter must show its restriction. Beside a count that the restriction sets, a rate is evidence only: a second
/// thread of one core, or a CPU with a single 512-bit port, may gain less than [`SHOWN`] from what is taken.
fn is_required(proof: &Proof) -> bool {
    match proof.kind {
        Restricted::Threads => proof.parameter == ParameterId::UsableCores,
        Restricted::Simd => proof.parameter == ParameterId::SimdLanes,
        Restricted::ContendedMemory | Restricted::ContendedCache | Restricted::GpuThreads => true,
    }
}

/// One sentence for each parameter that does not show what it must.
pub(crate) fn not_shown(restriction: &Restriction) -> Vec<String> {
    let sentence = |p: &Proof| {
        let of = p.gpu.map_or(String::new(), |k| format!(" of gpu{k}"));
        let value = |v: Option<f64>| v.map_or("missing".to_owned(), |v| format!("{v:.4}"));
        let (kind, parameter) = (p.kind, &p.parameter);
        let (with, without) = (value(p.with), value(p.without));
        format!("the restriction {kind} does not show: {parameter}{of} is {with} with it and {without} without")
    };
    restriction.proof.iter().filter(|p| is_required(p) && !p.shows).map(sentence).collect()
}

/// How a parameter must differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Change {
    /// Lower at all: a count that the restriction sets.
    Fewer,
    /// Lower by [`SHOWN`].
    Lower,
    /// Higher by [`SHOWN`].
    Higher,
}

impl Change {
    fn is_shown(self, without: f64, with: f64) -> bool {
        match self {
            Self::Fewer => with < without,
            Self::Lower => with <= without * (1.0 - SHOWN),
            Self::Higher => with >= without * (1.0 + SHOWN),
        }
    }
}

fn prove(kind: Restricted, without: &Hardware, with: &Hardware) -> Vec<Proof> {
    let on_cpu = |parameter: ParameterId, change: Change| {
        let (without, with) = (without.value(parameter), with.value(parameter));
        proof(kind, parameter.as_str(), None, change, (without, with))
    };
    match kind {
        Restricted::Threads => {
            vec![
                on_cpu(ParameterId::UsableCores, Change::Fewer),
                first_shown([
                    on_cpu(ParameterId::ScalingAllThreadsRatio, Change::Lower),
                    on_cpu(ParameterId::BandwidthAllThreadsGbPerS, Change::Lower),
                ]),
            ]
        }
        Restricted::Simd => {
            vec![on_cpu(ParameterId::SimdLanes, Change::Fewer)]
        }
        // Where one thread can't saturate the memory, others at work make it slower to answer at most.
        Restricted::ContendedMemory => vec![first_shown([
            on_cpu(ParameterId::BandwidthAllThreadsGbPerS, Change::Lower),
            on_cpu(latency_of_memory(), Change::Higher),
        ])],
        Restricted::ContendedCache => {
            let llc = with.value(ParameterId::CacheLlcBytes).unwrap_or(ASSUMED_LLC_BYTES);
            vec![on_cpu(latency_below(llc), Change::Higher)]
        }
        Restricted::GpuThreads => {
            with.gpus.iter().filter(|g| is_lavapipe(&g.gpu)).map(|g| on_gpu(g, without)).collect()
        }
    }
}

/// The first that shows the restriction, or the first of all: each of them is enough.
fn first_shown([first, second]: [Proof; 2]) -> Proof {
    if !first.shows && second.shows { second } else { first }
}

fn on_gpu(with: &GpuHardware, without: &Hardware) -> Proof {
    let same = |g: &&GpuHardware| (&g.gpu.name, &g.gpu.driver) == (&with.gpu.name, &with.gpu.driver);
    let without = without.gpus.iter().find(same);
    let by = |id: GpuParameterId, change: Change| {
        let values = (without.and_then(|g| g.value(id)), with.value(id));
        proof(Restricted::GpuThreads, id.as_str(), Some(with.gpu.index), change, values)
    };
    by(GpuParameterId::ArithmeticGflopPerS, Change::Lower)
}

fn proof(
    kind: Restricted,
    parameter: &str,
    gpu: Option<u32>,
    change: Change,
    (without, with): (Option<f64>, Option<f64>),
) -> Proof {
    let shows = without.zip(with).is_some_and(|(without, with)| change.is_shown(without, with));
    Proof { kind, parameter: parameter.to_owned(), gpu, without, with, shows }
}

/// The latency over the largest working set there is.
fn latency_of_memory() -> ParameterId {
    let [.., (_, largest)] = ParameterId::LATENCIES;
    largest
}

/// The latency over the largest working set that fits into a last-level cache; over the smallest there is where none does.
fn latency_below(llc_bytes: f64) -> ParameterId {
    let sets = ParameterId::LATENCIES;
    let fits = |(kib, _): &&(u32, ParameterId)| f64::from(*kib) * 1024.0 < llc_bytes;
    sets.iter().rev().find(fits).unwrap_or(&sets[0]).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::{GpuKind, Machine, Parameter};

    fn hardware(values: &[(ParameterId, f64)]) -> Hardware {
        let parameters = values.iter().map(|(name, value)| Parameter::reported(*name, *value, "test")).collect();
        Hardware::new(Machine::default(), parameters)
    }

    fn shown(kind: Restricted, without: &[(ParameterId, f64)], with: &[(ParameterId, f64)]) -> Vec<bool> {
        prove(kind, &hardware(without), &hardware(with)).iter().map(|p| p.shows).collect()
    }

    #[test]
    fn a_parameter_that_hardly_differs_shows_nothing() {
        let threads = |cores, ratio| [(ParameterId::UsableCores, cores), (ParameterId::ScalingAllThreadsRatio, ratio)];
        assert_eq!(shown(Restricted::Threads, &threads(4.0, 3.9), &threads(2.0, 2.0)), [true, true]);
        assert_eq!(shown(Restricted::Threads, &threads(4.0, 3.9), &threads(4.0, 3.6)), [false, false]);
        assert_eq!(shown(Restricted::Threads, &[], &threads(1.0, 1.0)), [false, false]);
        let bandwidth = |v| [(ParameterId::BandwidthAllThreadsGbPerS, v)];
        assert_eq!(shown(Restricted::ContendedMemory, &bandwidth(50.0), &bandwidth(44.9)), [true]);
        assert_eq!(shown(Restricted::ContendedMemory, &bandwidth(50.0), &bandwidth(45.1)), [false]);
        let both = |v, ns| [(ParameterId::BandwidthAllThreadsGbPerS, v), (ParameterId::Latency262144KibNs, ns)];
        assert_eq!(shown(Restricted::ContendedMemory, &both(50.0, 200.0), &both(50.0, 230.0)), [true]);
        assert_eq!(shown(Restricted::ContendedMemory, &both(50.0, 200.0), &both(50.0, 210.0)), [false]);
    }

    #[test]
    fn a_contended_cache_shows_in_the_latency_just_below_its_size() {
        assert_eq!(latency_below(32.0 * 1024.0 * 1024.0), ParameterId::Latency16384KibNs);
        assert_eq!(latency_below(16.0 * 1024.0 * 1024.0), ParameterId::Latency4096KibNs);
        assert_eq!(latency_below(1.0), ParameterId::Latency16KibNs);
        let latency = |llc, ns| [(ParameterId::CacheLlcBytes, llc), (ParameterId::Latency16384KibNs, ns)];
        assert_eq!(shown(Restricted::ContendedCache, &latency(3.3e7, 20.0), &latency(3.3e7, 23.0)), [true]);
        assert_eq!(shown(Restricted::ContendedCache, &latency(3.3e7, 20.0), &latency(3.3e7, 19.0)), [false]);
    }

    #[test]
    fn threads_of_lavapipe_show_in_its_arithmetic_whatever_its_number() {
        let with_gpu = |index, gflop| {
            let text = |t: &str| t.to_owned();
            let (name, driver) = (text("llvmpipe (LLVM 15)"), text("llvmpipe Mesa 22"));
            let gpu = GpuIdentity::new(index, name, GpuKind::Software).with_driver("", driver, "");
            let parameters = vec![Parameter::reported(GpuParameterId::ArithmeticGflopPerS, gflop, "test")];
            hardware(&[]).with_gpus(vec![GpuHardware::new(gpu, parameters)])
        };
        let proofs = prove(Restricted::GpuThreads, &with_gpu(0, 147.0), &with_gpu(1, 74.0));
        assert_eq!((proofs[0].gpu, proofs[0].without, proofs[0].shows), (Some(1), Some(147.0), true));
        let restriction = Restriction { kinds: vec![Restricted::GpuThreads], proof: proofs };
        assert_eq!(not_shown(&restriction), Vec::<String>::new());
        let proof = prove(Restricted::GpuThreads, &with_gpu(0, 147.0), &with_gpu(1, 146.0));
        let told = not_shown(&Restriction { kinds: vec![Restricted::GpuThreads], proof });
        assert_eq!(
            told,
            [
                "the restriction gpu_threads does not show: arithmetic_gflop_per_s of gpu1 is 146.0000 with it and 147.0000 without"
            ]
        );
    }
}
