//! Made-up machines whose costs are known exactly. TEST DATA: the reports carry a real label because training leaves
//! simulated ones out, so none of them may leave this module's tests.

use sapwise::hardware::{How, parameter};
use sapwise::model::{MethodModel, ModelTerm, Scale};
use sapwise::report::{Label, Point, Provenance, Report, ReportSchema, Timed, Timing};
use sapwise::{AlgorithmId, Hardware, Load, Parameter, Term};

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
    /// Standard deviation of the logarithm of a sample.
    pub(crate) noise: f64,
    pub(crate) frames: usize,
}

const fn machine(name: &'static str, ghz: f64, lanes: f64, cores: u32, mib: f64, gb: (f64, f64), join: f64) -> Machine {
    let cache_bytes = mib * 1_048_576.0;
    Machine { name, ghz, lanes, cores, cache_bytes, gb_per_s: gb, fork_join_ns: join, noise: 0.02, frames: 5 }
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
            (parameter::USABLE_CORES, f64::from(self.cores)),
            (parameter::CLOCK_MEASURED_GHZ, self.ghz),
            (parameter::SIMD_LANES, self.lanes),
            (parameter::CACHE_LLC_BYTES, self.cache_bytes),
            (parameter::BANDWIDTH_ONE_THREAD_GB_PER_S, self.gb_per_s.0),
            (parameter::BANDWIDTH_ALL_THREADS_GB_PER_S, self.gb_per_s.1),
            (parameter::FORK_JOIN_COLD_NS, self.fork_join_ns),
            (parameter::SCALING_TWO_THREADS_RATIO, Self::scaling(2)),
            (parameter::SCALING_ALL_THREADS_RATIO, Self::scaling(self.cores)),
        ];
        let parameters =
            figures.map(|(name, value)| Parameter { how: How::Measured, ..Parameter::reported(name, value, "test") });
        let machine = sapwise::Machine { physical_id: self.name.to_owned(), ..sapwise::Machine::default() };
        Hardware { machine, parameters: parameters.into(), gpus: Vec::new(), gpu_groups: Vec::new() }
    }

    /// A full sweep: 23 sizes from 16 to 700 000 objects of two scenarios; from 500 objects up whoever is eight times slower than
    /// the best leaves the race.
    pub(crate) fn report(&self) -> Report {
        let hardware = self.hardware();
        let mut random = Random::new(u64::from(self.cores) * 1000 + self.ghz.to_bits() % 997);
        let threads = (0..).map(|k| 1 << k).take_while(|&k| k < self.cores).chain([self.cores]);
        let methods = truth();
        let ids: Vec<(AlgorithmId, &MethodModel)> = threads
            .flat_map(|k| methods.iter().map(move |m| (format!("{}@cpu{k}", m.method).parse().unwrap(), m)))
            .collect();
        let curves: Vec<_> = ids.iter().map(|(id, m)| m.curve(&hardware, id.threads()).unwrap()).collect();
        let mut points = Vec::new();
        for scenario in ["uniform", "clustered"] {
            let mut racing = vec![true; ids.len()];
            for k in 0..23 {
                let load = load(scenario, 2.0_f64.powf(4.0 + 0.7 * f64::from(k)).round());
                let ns: Vec<f64> = curves.iter().map(|c| c.cost_ns(&load)).collect();
                let best = ns.iter().copied().fold(f64::INFINITY, f64::min);
                let timings = (0..ids.len()).filter(|&a| racing[a]).map(|a| Timing {
                    algorithm: ids[a].0.clone(),
                    samples_ns: (0..self.frames)
                        .map(|_| (ns[a] * (self.noise * random.normal()).exp()).round() as u64)
                        .collect(),
                    error: None,
                });
                points.push(point(scenario, load, timings.collect()));
                racing.iter_mut().zip(&ns).for_each(|(r, ns)| *r &= load.objects < 500 || *ns < 8.0 * best);
            }
        }
        let algorithms = ids.into_iter().map(|(id, m)| Timed { id, revision: m.revision }).collect();
        Report {
            schema: ReportSchema,
            label: Label::RealFull,
            provenance: provenance(),
            hardware,
            algorithms,
            points,
            remarks: Vec::new(),
        }
    }
}

fn provenance() -> Provenance {
    Provenance {
        version: "test".to_owned(),
        date: "2000-01-01".to_owned(),
        command: "test data, not a measurement".to_owned(),
        seed: 1,
        threads: None,
        simd: None,
        optimised: true,
        seconds: 0.0,
    }
}

fn point(scenario: &str, load: Load, timings: Vec<Timing>) -> Point {
    Point {
        scenario: scenario.to_owned(),
        load,
        pairs: load.pairs as u64,
        fingerprint: "0".repeat(16),
        foreign_load: None,
        spoiled: 0,
        timings,
    }
}

/// Loads like those of a constant density, and of clusters of growing density.
pub(crate) fn load(scenario: &str, n: f64) -> Load {
    let (axis, strip, pairs) = match scenario {
        "uniform" => (0.3 * n.powf(5.0 / 3.0), 4.0 * n, 1.0 * n),
        _ => (0.8 * n.powf(1.7), 3.0 * n.powf(1.25), 1.2 * n.powf(1.2)),
    };
    Load { objects: n as u32, axis_candidates: axis, strip_candidates: strip, pairs, moved: 1.0 }
}

/// The costs that the reports are made from.
pub(crate) fn truth() -> Vec<MethodModel> {
    use {Scale::*, Term::*};
    let method = |name: &str, terms: &[(Term, Scale, f64)]| MethodModel {
        method: name.to_owned(),
        revision: 1,
        max_threads: 16,
        min_objects: 1,
        max_objects: u32::MAX,
        terms: terms.iter().map(|&(term, scale, unit)| ModelTerm { term, scale, unit }).collect(),
        residual_intercept: 0.0,
        residual: Vec::new(),
        spread_ln: 0.0,
    };
    let sorted = |call, join, tests| {
        [
            (Call, Cycle, call),
            (Call, ForkJoin, join),
            (Objects, SharedCycle, 20.0),
            (Objects, Cycle, 5.0),
            (Sort, SharedCycle, 2.5),
            (ColdObjects, Byte, 100.0),
            tests,
            (Pairs, SharedCycle, 12.0),
        ]
    };
    vec![
        method(
            "brute",
            &[
                (Call, Cycle, 600.0),
                (Call, ForkJoin, 1.0),
                (Objects, SharedCycle, 4.0),
                (AllPairs, SharedLane, 6.0),
                (Pairs, SharedCycle, 12.0),
            ],
        ),
        method("sweep", &sorted(1500.0, 3.0, (AxisCandidates, SharedLane, 7.0))),
        method("strips", &sorted(6000.0, 4.0, (StripCandidates, SharedLane, 60.0))),
    ]
}

/// SplitMix64, with normal deviates from twelve uniform ones.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}
