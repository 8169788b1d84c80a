//! A machine out of its report: which loads its scenes had, and what the frames of each algorithm took there.

use crate::broad_phase::{FrameKind, FrameWork};
use crate::model::Prediction;
use crate::stats::{mean, median};
use crate::tuning::corrected;
use crate::{AlgorithmCost, AlgorithmId, Entry, Hardware, Load, Model, Source, Tuning};
use std::collections::BTreeMap;

/// The report of a host of `datasets/`, by the beginning of its file name.
pub(super) struct Recorded {
    pub(super) ids: Vec<AlgorithmId>,
    entries: Vec<Entry>,
    hardware: Hardware,
    /// Of each scenario its loads, ascending by objects.
    scenes: BTreeMap<String, Vec<Spot>>,
}

/// One load.
#[derive(Clone)]
pub(super) struct Spot {
    pub(super) load: Load,
    /// By algorithm: nanoseconds of frames in a row. Where it was not timed, what it took of the best at the nearest size.
    pub(super) ns: Vec<Vec<f64>>,
}

impl Spot {
    pub(super) fn mean_ns(&self, algorithm: usize) -> f64 {
        mean(&self.ns[algorithm])
    }
}

/// Work of the frames of an incremental algorithm over that of the mean one, by kind: it does not stand in a report, and is taken to be in
/// proportion to their times.
#[derive(Clone, Copy)]
pub(super) struct Kinds {
    median_ns: f64,
    updated: f64,
    rebuilt: f64,
}

/// An incremental algorithm whose last frame is further back than these begins again.
pub(super) const FORGOTTEN: usize = 3;
/// What that costs over `bvh`, and the first frame of any other over the usual one.
pub(super) const FROM_NOTHING: f64 = 2.0;
pub(super) const COLD: f64 = 1.15;

/// A recorded frame over so many medians of its timing is taken for one in which all was made again.
const REBUILT: f64 = 2.5;

impl Kinds {
    pub(super) fn of(ns: &[f64]) -> Self {
        let (median_ns, all) = (median(ns).unwrap(), mean(ns));
        let (rebuilt, updated): (Vec<f64>, Vec<f64>) = ns.iter().partition(|&&ns| ns > REBUILT * median_ns);
        let over = |of: &[f64]| if of.is_empty() { 1.0 } else { mean(of) / all };
        Self { median_ns, updated: over(&updated), rebuilt: over(&rebuilt) }
    }

    /// How a frame that took so long came about.
    pub(super) fn work(&self, ns: f64) -> FrameWork {
        if ns > REBUILT * self.median_ns {
            FrameWork::new(FrameKind::Rebuilt, self.rebuilt)
        } else {
            FrameWork::new(FrameKind::Updated, self.updated)
        }
    }
}

/// Standard deviation of the logarithm of a timing of a report around what a load tells.
const NOISE_LN: f64 = 0.1;
/// An algorithm that left the race at a size takes at least so many times what the best takes beyond.
const LEFT: f64 = 3.0;

/// Fewer boxes than these run on one thread.
const FEWEST_FOR_TWO: u32 = 2048;

impl Recorded {
    pub(super) fn of(file: &str) -> Self {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/datasets");
        let text = std::fs::read_to_string(format!("{folder}/{file}.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        let entry = |a: &serde_json::Value| {
            Entry::new(a["id"].as_str().unwrap().parse().unwrap(), a["revision"].as_u64().unwrap() as u32)
        };
        let entries: Vec<Entry> = report["algorithms"].as_array().unwrap().iter().map(entry).collect();
        let ids: Vec<AlgorithmId> = entries.iter().map(|e| e.id.clone()).collect();
        let mut scenes: BTreeMap<String, Vec<Spot>> = BTreeMap::new();
        for point in report["points"].as_array().unwrap() {
            let of = |key: &str| point["load"][key].as_f64().unwrap();
            let load = Load::of_objects(of("objects") as u32)
                .with_pairs(of("pairs"))
                .with_candidates(of("axis_candidates"), of("strip_candidates"))
                .with_moved(of("moved"));
            let mut ns = vec![Vec::new(); ids.len()];
            for timing in point["timings"].as_array().unwrap() {
                let k = ids.iter().position(|id| id.to_string() == timing["algorithm"]).unwrap();
                let samples = timing["samples_ns"].as_array().unwrap().iter();
                ns[k] = samples.map(|s| s.as_f64().unwrap()).collect();
            }
            scenes.entry(point["scenario"].as_str().unwrap().to_owned()).or_default().push(Spot { load, ns });
        }
        scenes.values_mut().for_each(fill);
        scenes.values_mut().flatten().filter(|s| s.load.objects < FEWEST_FOR_TWO).for_each(|s| join(&ids, s));
        let hardware = serde_json::from_value(report["hardware"].clone()).unwrap();
        Self { ids, entries, hardware, scenes }
    }

    /// The load of a scenario with about so many objects.
    pub(super) fn spot(&self, scenario: &str, objects: f64) -> &Spot {
        let off = |s: &&Spot| (f64::from(s.load.objects) / objects).ln().abs();
        self.scenes[scenario].iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
    }

    fn prediction(&self) -> Prediction {
        Model::built_in().unwrap().predict(&self.hardware, &self.entries).unwrap()
    }

    /// What the built-in model predicts for this machine.
    pub(super) fn predicted(&self) -> Tuning {
        self.tuning(self.prediction().costs)
    }

    /// What the timings of the report tell.
    pub(super) fn measured(&self) -> Tuning {
        let of_spot = |spot: &Spot| {
            let load = spot.load;
            let timed = spot.ns.iter().enumerate().filter(|(_, ns)| ns.len() > 1);
            timed.map(|(k, ns)| (k, load, median(ns).unwrap(), NOISE_LN)).collect::<Vec<_>>()
        };
        let timings = self.scenes.values().flatten().flat_map(of_spot);
        self.tuning(corrected(&self.prediction().costs, timings))
    }

    fn tuning(&self, costs: Vec<AlgorithmCost>) -> Tuning {
        assert_eq!(costs.iter().map(|c| &c.algorithm).collect::<Vec<_>>(), self.ids.iter().collect::<Vec<_>>());
        let loads: Vec<Load> = self.scenes["uniform"].iter().map(|s| s.load).collect();
        Tuning::from_costs(Source::Measured, "uniform", costs, &loads)
    }
}

/// Two threads of which one does all are one algorithm: what their timings differ by is chance, from which no choice is to gain or lose.
fn join(ids: &[AlgorithmId], spot: &mut Spot) {
    for k in 0..ids.len() {
        let one = ids.iter().position(|id| id.method() == ids[k].method() && id.threads() == 1).unwrap();
        if one != k && spot.ns[k].len() > 1 {
            let more = spot.ns[k].clone();
            spot.ns[one].extend(more);
            spot.ns[k] = spot.ns[one].clone();
        }
    }
}

/// Sorts the loads, keeps one of each size, and fills in what was not timed.
fn fill(spots: &mut Vec<Spot>) {
    spots.sort_by_key(|s| s.load.objects);
    spots.dedup_by_key(|s| s.load.objects);
    let best = |s: &Spot| s.ns.iter().filter_map(|ns| median(ns)).min_by(f64::total_cmp).unwrap();
    let timed = spots.clone();
    for (at, spot) in spots.iter_mut().enumerate() {
        for k in 0..spot.ns.len() {
            if spot.ns[k].is_empty() {
                let near = (0..timed.len()).filter(|&s| !timed[s].ns[k].is_empty()).min_by_key(|s| s.abs_diff(at));
                let over = near.map_or(LEFT, |s| median(&timed[s].ns[k]).unwrap() / best(&timed[s]));
                spot.ns[k] = vec![best(&timed[at]) * if near.is_some_and(|s| s < at) { over.max(LEFT) } else { over }];
            }
        }
    }
}
