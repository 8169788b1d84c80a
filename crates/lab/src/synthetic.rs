//! Made-up machines whose costs are known exactly. TEST DATA: the reports carry a real label because training leaves
//! simulated ones out, so none of them may leave this module's tests.

use crate::data::Profile;
use crate::fit::components;
use crate::report::{Label, Point, Provenance, Report, Timed, Timing};
use sapwise::AlgorithmId;
use sapwise::algorithm::{BackendClass, Entry, Load};
use sapwise::tuning::{AlgorithmCost, Term};
use sapwise_scenes::Random;
use sapwise_tune::hardware::{GpuGroup, GpuHardware, GpuParameterId, ParameterId};
use sapwise_tune::model::{FallbackModel, HelpersModel, MethodModel, ModelTerm, Scale};
use sapwise_tune::{GpuIdentity, GpuKind, Hardware, Model, Parameter};

/// A machine of the made-up family.
#[derive(Debug, Clone)]
pub(crate) struct Machine {
    pub(crate) name: &'static str,
    pub(crate) ghz: f64,
    pub(crate) lanes: f64,
    pub(crate) cores: u32,
    pub(crate) cache_bytes: f64,
    pub(crate) gb_per_s: (f64, f64),
    pub(crate) fork_join_ns: f64,
    pub(crate) gpus: Vec<Gpu>,
    /// Standard deviation of the logarithm of a sample.
    pub(crate) noise: f64,
    pub(crate) frames: usize,
}

/// The profiles of some machines, named after them.
pub(crate) fn profiles(machines: impl IntoIterator<Item = Machine>) -> Vec<Profile> {
    machines.into_iter().map(|m| Profile::of(&format!("{}.json", m.name), &m.report())).collect()
}

/// A made-up GPU: latencies in ns, rates in GB/s, and thousands of millions of operations a second.
#[derive(Debug, Clone)]
pub(crate) struct Gpu {
    pub(crate) kind: GpuKind,
    pub(crate) round_trip_ns: f64,
    pub(crate) dispatch_ns: f64,
    pub(crate) upload: f64,
    pub(crate) download: f64,
    pub(crate) copy: f64,
    pub(crate) gflop: f64,
}

const fn gpu(kind: GpuKind, latencies: (f64, f64), transfers: (f64, f64), copy: f64, gflop: f64) -> Gpu {
    let ((round_trip_ns, dispatch_ns), (upload, download)) = (latencies, transfers);
    Gpu { kind, round_trip_ns, dispatch_ns, upload, download, copy, gflop }
}

fn machine(name: &'static str, ghz: f64, lanes: f64, cores: u32, mib: f64, gb: (f64, f64), join: f64) -> Machine {
    let cache_bytes = mib * 1_048_576.0;
    Machine {
        name,
        ghz,
        lanes,
        cores,
        cache_bytes,
        gb_per_s: gb,
        fork_join_ns: join,
        gpus: Vec::new(),
        noise: 0.02,
        frames: 5,
    }
}

impl Machine {
    /// Seven machines, from a small laptop to a server.
    pub(crate) fn family() -> Vec<Self> {
        vec![
            machine("0000000000000001", 2.4, 8.0, 2, 4.0, (9.0, 14.0), 2500.0),
            machine("0000000000000002", 3.1, 4.0, 4, 8.0, (11.0, 20.0), 4000.0),
            machine("0000000000000003", 3.6, 8.0, 8, 16.0, (16.0, 38.0), 6000.0),
            machine("0000000000000004", 4.7, 16.0, 8, 32.0, (28.0, 70.0), 5000.0),
            machine("0000000000000005", 2.1, 16.0, 16, 24.0, (12.0, 90.0), 14_000.0),
            machine("0000000000000006", 3.3, 4.0, 6, 12.0, (20.0, 45.0), 3000.0),
            machine("0000000000000007", 2.8, 8.0, 4, 6.0, (14.0, 25.0), 9000.0),
        ]
    }

    /// Eight machines, all but the last of the family, each with one GPU and two of them with a second one; the
    /// eighth is the first again with the GPU of a server.
    pub(crate) fn family_with_gpus() -> Vec<Self> {
        use GpuKind::{Discrete, Integrated};
        let gpus = [
            vec![gpu(Integrated, (60e3, 3e3), (9.0, 6.0), 40.0, 800.0)],
            vec![
                gpu(Discrete, (30e3, 2e3), (12.0, 11.0), 400.0, 9e3),
                gpu(Discrete, (40e3, 1.5e3), (5.0, 9.0), 250.0, 6e3),
            ],
            vec![gpu(Discrete, (25e3, 4e3), (24.0, 15.0), 700.0, 3e4)],
            vec![gpu(Integrated, (90e3, 9e3), (15.0, 22.0), 80.0, 2e3)],
            vec![
                gpu(Discrete, (15e3, 1e3), (50.0, 30.0), 2500.0, 5e4),
                gpu(Discrete, (15e3, 1e3), (50.0, 30.0), 2500.0, 5e4),
            ],
            vec![gpu(Discrete, (45e3, 2.5e3), (6.0, 5.0), 200.0, 5e3)],
            vec![gpu(Integrated, (35e3, 6e3), (20.0, 8.0), 60.0, 4e3)],
            vec![gpu(Discrete, (20e3, 2e3), (30.0, 20.0), 900.0, 2e4)],
        ];
        let mut machines = Self::family();
        machines.push(Self { name: "0000000000000008", ghz: 3.9, ..machines[3].clone() });
        machines.into_iter().zip(gpus).map(|(m, gpus)| Self { gpus, ..m }).collect()
    }

    pub(crate) fn exact(mut self) -> Self {
        self.noise = 0.0;
        self
    }

    /// Work of `k` threads over that of one: each further thread adds 85 %.
    fn scaling(k: u32) -> f64 {
        1.0 + 0.85 * f64::from(k - 1)
    }

    pub(crate) fn hardware(&self) -> Hardware {
        let figures = [
            (ParameterId::UsableCores, f64::from(self.cores)),
            (ParameterId::ClockMeasuredGhz, self.ghz),
            (ParameterId::SimdLanes, self.lanes),
            (ParameterId::CacheLlcBytes, self.cache_bytes),
            (ParameterId::BandwidthOneThreadGbPerS, self.gb_per_s.0),
            (ParameterId::BandwidthAllThreadsGbPerS, self.gb_per_s.1),
            (ParameterId::CoreToCoreNs, self.fork_join_ns / 80.0),
            (ParameterId::ForkJoinColdNs, self.fork_join_ns),
            (ParameterId::ScalingTwoThreadsRatio, Self::scaling(2)),
            (ParameterId::ScalingAllThreadsRatio, Self::scaling(self.cores)),
        ];
        let parameters = figures.map(measured);
        let gpus: Vec<GpuHardware> = self.gpus.iter().enumerate().map(|(k, gpu)| gpu.hardware(k as u32)).collect();
        let together = [(GpuParameterId::GroupUploadRatio, 1.4), (GpuParameterId::GroupRoundTripRatio, 1.2)];
        let group = GpuGroup::new((0..gpus.len() as u32).collect(), together.map(measured).into());
        let gpu_groups = if gpus.len() > 1 { vec![group] } else { Vec::new() };
        let mut hardware = Hardware::new(sapwise_tune::Machine::of(self.name), parameters.into()).with_gpus(gpus);
        hardware.gpu_groups = gpu_groups;
        hardware
    }

    /// A full sweep: 23 sizes from 16 to 700 000 objects of two scenarios; from 500 objects on, an
    /// algorithm at eight times the best leaves the race, unless it runs on a GPU and gains.
    pub(crate) fn report(&self) -> Report {
        let hardware = self.hardware();
        let mut random = Random::named(u64::from(self.cores) * 1000 + self.ghz.to_bits() % 997, &[]);
        let threads = (0..).map(|k| 1 << k).take_while(|&k| k < self.cores).chain([self.cores]);
        let of = |methods: &'_ [MethodModel], backend: String| -> Vec<AlgorithmId> {
            methods.iter().map(|m| format!("{}@{backend}", m.method).parse().unwrap()).collect()
        };
        let mut ids: Vec<AlgorithmId> = threads.flat_map(|k| of(&truth(), format!("cpu{k}"))).collect();
        ids.extend((0..self.gpus.len()).flat_map(|k| of(&gpu_truth(), format!("gpu{k}"))));
        if self.gpus.len() == 2 {
            ids.extend(of(&gpu_truth(), "gpu0+1".to_owned()));
        }
        let costs = true_costs(&hardware, &ids);
        let mut points = Vec::new();
        for scenario in ["uniform", "clustered"] {
            let mut racing = vec![true; ids.len()];
            let mut before = vec![0.0; ids.len()];
            for k in 0..23 {
                let load = load(scenario, 2.0_f64.powf(4.0 + 0.7 * f64::from(k)).round());
                let ns: Vec<f64> = costs.iter().map(|c| c.curve.cost_ns(&load)).collect();
                let best = ns.iter().copied().fold(f64::INFINITY, f64::min);
                let timings = (0..ids.len()).filter(|&a| racing[a]).map(|a| Timing {
                    algorithm: ids[a].clone(),
                    samples_ns: (0..self.frames)
                        .map(|_| (ns[a] * (self.noise * random.normal()).exp()).round() as u64)
                        .collect(),
                    error: None,
                });
                points.push(Point {
                    scenario: scenario.to_owned(),
                    load,
                    pairs: load.pairs as u64,
                    fingerprint: "0".repeat(16),
                    timings: timings.collect(),
                    ..Point::default()
                });
                for (a, ns) in ns.iter().enumerate() {
                    let ratio = ns / best;
                    // A GPU starts far behind and gains.
                    let gains = ratio < before[a] && ids[a].backend().class() == BackendClass::Gpu;
                    racing[a] &= load.objects < 500 || ratio < 8.0 || gains;
                    before[a] = ratio;
                }
            }
        }
        let provenance = Provenance {
            version: "test".to_owned(),
            date: "2000-01-01".to_owned(),
            command: "test data, not a measurement".to_owned(),
            seed: 1,
            optimised: true,
            ..Provenance::default()
        };
        let algorithms = ids.into_iter().map(|id| Timed::new(id, 1)).collect();
        Report { label: Label::RealFull, provenance, hardware, algorithms, points, remarks: Vec::new() }
    }
}

impl Gpu {
    fn hardware(&self, index: u32) -> GpuHardware {
        let name = format!("GPU of {} GFLOP/s", self.gflop);
        let [device, driver, api] = ["0000:0000", "test", "vulkan"].map(str::to_owned);
        let identity = GpuIdentity { device, driver, api, ..GpuIdentity::new(index, name, self.kind) };
        let figures = [
            (GpuParameterId::UploadRateGbPerS, self.upload),
            (GpuParameterId::DownloadRateGbPerS, self.download),
            (GpuParameterId::CopyGbPerS, self.copy),
            (GpuParameterId::RoundTripNs, self.round_trip_ns),
            (GpuParameterId::DispatchNs, self.dispatch_ns),
            (GpuParameterId::ReadBackNs, self.round_trip_ns / 3.0),
            (GpuParameterId::ArithmeticGflopPerS, self.gflop),
        ];
        GpuHardware::new(identity, figures.map(measured).into())
    }
}

fn measured((id, value): (impl AsRef<str>, f64)) -> Parameter {
    Parameter::measured(id, value, "test")
}

/// Loads like those of a constant density that moves little, and of clusters of growing density that move less and
/// less.
pub(crate) fn load(scenario: &str, n: f64) -> Load {
    let (axis, strip, pairs, moved) = match scenario {
        "uniform" => (0.3 * n.powf(5.0 / 3.0), 4.0 * n, 1.0 * n, 0.04),
        _ => (0.8 * n.powf(1.7), 3.0 * n.powf(1.25), 1.2 * n.powf(1.2), n.powf(-0.2)),
    };
    Load::of_objects(n as u32).with_candidates(axis, strip).with_pairs(pairs).with_moved(moved).with_moved_share(moved)
}

fn method(name: &str, backend: BackendClass, terms: &[(Term, Scale, f64)]) -> MethodModel {
    let mut method = MethodModel::new(name, backend, 1);
    method.max_threads = 16;
    method.terms = terms.iter().map(|&(term, scale, unit)| ModelTerm { term, scale, unit }).collect();
    method
}

/// Returns the costs on GPUs that the reports are made from: the counted ones, each higher than by the hardware
/// parameters.
pub(crate) fn gpu_truth() -> Vec<MethodModel> {
    let truth = |name: &str, operations: f64| {
        let dearer = |term, scale| match (scale, term) {
            (Scale::GpuRoundTrip, _) => 2.0,
            (Scale::GpuDispatch, _) => 1.3,
            (Scale::GpuMemoryByte, _) => 1.5,
            (Scale::GpuOperation, _) => operations,
            (Scale::Cycle, Term::Objects) => 6.0,
            (Scale::Cycle, _) => 0.0,
            _ => 1.0,
        };
        let counts = components(name, BackendClass::Gpu).into_iter().flat_map(|component| component.0);
        let terms: Vec<_> = counts.map(|(times, term, scale)| (term, scale, times * dearer(term, scale))).collect();
        let kept: Vec<_> = terms.into_iter().filter(|t| t.2 > 0.0).collect();
        method(name, BackendClass::Gpu, &kept)
    };
    vec![truth("brute", 12.0), truth("sap", 15.0), truth("grid-sap", 300.0)]
}

/// Returns the costs on the CPU that the reports are made from.
pub(crate) fn truth() -> Vec<MethodModel> {
    use {Scale::*, Term::*};
    let method = |name: &str, terms: &[(Term, Scale, f64)]| {
        let mut method = method(name, BackendClass::Cpu, terms);
        method.helpers = Some(HelpersModel::new(400.0, 0.35, 0.1, 0));
        method
    };
    let sorted = |call, tests| {
        [
            (Call, Cycle, call),
            (Objects, Cycle, 25.0),
            (Sort, Cycle, 2.5),
            (ColdObjects, Byte, 100.0),
            tests,
            (Pairs, Cycle, 12.0),
        ]
    };
    let mut pair_cache = method(
        "pair-cache",
        &[
            (Call, Cycle, 800.0),
            (Objects, Cycle, 15.0),
            (ColdObjects, Byte, 60.0),
            (Pairs, Cycle, 20.0),
            (MovedShare, Cycle, 150.0),
        ],
    );
    pair_cache.fallback = Some(FallbackModel { method: "bvh".to_owned(), factor: 1.1 });
    vec![
        method("brute", &[(Call, Cycle, 600.0), (Objects, Cycle, 4.0), (AllPairs, Lane, 6.0), (Pairs, Cycle, 12.0)]),
        method("sap", &sorted(1500.0, (AxisCandidates, Lane, 7.0))),
        method("grid-sap", &sorted(6000.0, (StripCandidates, Lane, 60.0))),
        method(
            "bvh",
            &[
                (Call, Cycle, 2000.0),
                (Objects, Cycle, 175.0),
                (Sort, Cycle, 5.0),
                (ColdObjects, Byte, 100.0),
                (Pairs, Cycle, 25.0),
            ],
        ),
        pair_cache,
    ]
}

/// Returns the true costs of the algorithms of a machine, in the order of their ids.
pub(crate) fn true_costs(machine: &Hardware, ids: &[AlgorithmId]) -> Vec<AlgorithmCost> {
    let entries: Vec<Entry> = ids.iter().map(|id| Entry::new(id.clone(), 1)).collect();
    let model = Model::new("truth", [truth(), gpu_truth()].concat(), Vec::new());
    let costs = model.predict(machine, &entries).unwrap().costs;
    assert_eq!(costs.len(), ids.len());
    costs
}
