//! A report reduced for training: the hardware, and the median of each algorithm at each point.

use super::compared::is_real;
use crate::paired::median_error;
use crate::report::{Label, Point, Report, Timed, Timing};
use sapwise::AlgorithmId;
use sapwise::algorithm::{Backend, BackendClass, Entry, Load};
use sapwise_tune::Hardware;
use sapwise_tune::hardware::ParameterId;
use sapwise_tune::stats::{mean, median};
use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};

/// A report without its samples, of which thousands fit into memory.
#[derive(Debug, Clone)]
pub struct Profile {
    /// Name of the report, as [`read_report`](super::read_report) gives it.
    pub file: String,
    /// The kind of evidence.
    pub label: Label,
    /// The host that it was measured on.
    pub host: String,
    /// How the machine was restricted, the same for two runs that repeat each other.
    pub setup: String,
    /// The hardware, without the raw samples of its parameters.
    pub hardware: Hardware,
    /// The algorithms that were timed.
    pub algorithms: Vec<Timed>,
    /// The points at which they were timed, in the order of the report.
    pub points: Vec<Spot>,
}

/// One point of a report.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Spot {
    /// Name of the scenario.
    pub scenario: String,
    /// The load, as a program estimates it from the previous frame.
    pub load: Load,
    /// Position in [`Profile::algorithms`], and the median over the frames in ns.
    pub medians: Vec<(u16, f64)>,
    /// The mean over the frames of each of these, in the same order. It includes the frames in which an incremental
    /// algorithm rebuilds.
    pub means: Vec<f64>,
    /// The standard error of the natural logarithm of each median, in the same order.
    pub errors_ln: Vec<f64>,
}

/// Samples that a median needs, so that one disturbed frame does not move it.
pub(super) const FEWEST_SAMPLES: usize = 3;

impl Profile {
    /// Reduces a report. Drops timings with an error or too few samples, and points that are empty then.
    pub fn of(file: &str, report: &Report) -> Self {
        let mut hardware = report.hardware.clone();
        let of_gpus = hardware.gpus.iter_mut().flat_map(|g| &mut g.parameters);
        hardware.parameters.iter_mut().chain(of_gpus).for_each(|p| p.raw = Vec::new());
        let p = &report.provenance;
        let points = report.points.iter().map(|p| Spot::of(p, &report.algorithms));
        Self {
            file: file.to_owned(),
            label: report.label,
            host: host(&hardware),
            setup: format!(
                "{:?} {:?} {:?} {:?}",
                p.threads,
                p.simd,
                p.gpu_threads,
                p.restriction.as_ref().map(|r| &r.kinds)
            ),
            hardware,
            algorithms: report.algorithms.clone(),
            points: points.filter(|s| !s.medians.is_empty() && s.load.objects > 0).collect(),
        }
    }

    /// Returns the host. Reports of one host are no independent evidence.
    pub fn machine(&self) -> &str {
        &self.host
    }

    /// Returns the CPU model with its caches, which several hosts may share.
    pub fn cpu_model(&self) -> &str {
        &self.hardware.machine.physical_id
    }

    /// Returns the algorithm at a position.
    pub fn id(&self, position: u16) -> &AlgorithmId {
        &self.algorithms[usize::from(position)].id
    }

    /// Returns these algorithms with the revisions that were timed, 0 for one that was not, to ask a model for them.
    pub fn with_revisions(&self, ids: &[AlgorithmId]) -> Vec<Entry> {
        let revision = |id: &AlgorithmId| self.algorithms.iter().find(|t| t.id == *id).map_or(0, |t| t.revision);
        ids.iter().map(|id| Entry::new(id.clone(), revision(id))).collect()
    }

    /// Returns the algorithms that were timed at any point.
    pub fn available(&self) -> Vec<AlgorithmId> {
        let mut timed = vec![false; self.algorithms.len()];
        self.points.iter().flat_map(|s| &s.medians).for_each(|m| timed[usize::from(m.0)] = true);
        self.algorithms.iter().zip(timed).filter(|(_, timed)| *timed).map(|(t, _)| t.id.clone()).collect()
    }

    /// Returns the scenario of each point.
    pub fn scenarios(&self) -> impl Iterator<Item = &str> + Clone {
        self.points.iter().map(|p| p.scenario.as_str())
    }

    /// Returns `uniform` if it has that scenario, else its first one.
    pub fn usual_scenario(&self) -> &str {
        usual(self.scenarios())
    }

    /// Returns the loads of a scenario, ascending by objects, each size once.
    pub fn slice(&self, scenario: &str) -> Vec<Load> {
        let mut loads: Vec<Load> = self.points.iter().filter(|p| p.scenario == scenario).map(|p| p.load).collect();
        loads.sort_by_key(|l| l.objects);
        loads.dedup_by_key(|l| l.objects);
        loads
    }

    /// Returns whether an algorithm ran on several threads.
    pub fn has_threads(&self) -> bool {
        self.algorithms.iter().any(|t| t.id.threads() > 1)
    }

    /// Returns whether an algorithm ran on the CPU.
    pub fn has_cpu(&self) -> bool {
        self.algorithms.iter().any(|t| t.id.backend().class() == BackendClass::Cpu)
    }

    /// Returns whether an algorithm ran on a GPU that is no software adapter.
    pub fn has_real_gpu(&self) -> bool {
        let real = |index: &u32| self.hardware.gpu(*index).is_some_and(is_real);
        self.algorithms.iter().any(|t| matches!(t.id.backend(), Backend::Gpu(indices) if indices.iter().any(real)))
    }

    /// Returns the position of an algorithm among those of the report.
    pub fn position(&self, id: &AlgorithmId) -> Option<u16> {
        self.algorithms.iter().position(|t| t.id == *id).map(|k| k as u16)
    }

    /// Drops the algorithms that `stays` rejects, with their timings, and the points that are empty then.
    pub fn retain(&mut self, stays: impl Fn(&Timed) -> bool) {
        let kept: Vec<bool> = self.algorithms.iter().map(stays).collect();
        if kept.iter().all(|k| *k) {
            return;
        }
        let place = |k: u16| kept[..usize::from(k)].iter().filter(|k| **k).count() as u16;
        for spot in &mut self.points {
            let stays: Vec<bool> = spot.medians.iter().map(|m| kept[usize::from(m.0)]).collect();
            let mut stays_too = stays.iter().cycle();
            spot.medians.retain(|_| stays_too.next() == Some(&true));
            spot.means.retain(|_| stays_too.next() == Some(&true));
            spot.errors_ln.retain(|_| stays_too.next() == Some(&true));
            spot.medians.iter_mut().for_each(|m| m.0 = place(m.0));
        }
        self.points.retain(|s| !s.medians.is_empty());
        let mut kept = kept.into_iter();
        self.algorithms.retain(|_| kept.next() == Some(true));
    }

    /// Returns a hash of the measurement. Copies under another name or label have the same one.
    pub fn fingerprint(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.machine().hash(&mut hasher);
        for p in &self.hardware.parameters {
            p.value.map(f64::to_bits).hash(&mut hasher);
        }
        for spot in &self.points {
            spot.scenario.hash(&mut hasher);
            spot.load.objects.hash(&mut hasher);
            spot.medians.iter().for_each(|m| (m.0, m.1.to_bits()).hash(&mut hasher));
        }
        hasher.finish()
    }
}

/// Identifies a host without a serial number: by its CPU model with its caches and, in a guest, by the clock in MHz
/// that the hypervisor reports, which is the host's own. Without a hypervisor the reported clock is that of the
/// moment and not used, so that two machines of one model count as one.
pub fn host(hardware: &Hardware) -> String {
    let machine = &hardware.machine;
    let clock =
        hardware.value(ParameterId::ClockReportedGhz).filter(|_| !matches!(&machine.hypervisor[..], "" | "none"));
    clock.map_or_else(|| machine.physical_id.clone(), |ghz| format!("{}-{:.0}", machine.physical_id, 1000.0 * ghz))
}

/// Returns `uniform` if a report has that scenario, else its first one.
pub fn usual_scenario(report: &Report) -> &str {
    usual(report.points.iter().map(|p| p.scenario.as_str()))
}

fn usual<'a>(mut names: impl Iterator<Item = &'a str> + Clone) -> &'a str {
    let first = names.clone().next();
    names.find(|n| *n == "uniform").or(first).unwrap_or("uniform")
}

/// Returns the hosts of profiles, each once, in order.
pub fn machines(profiles: &[Profile]) -> BTreeSet<&str> {
    profiles.iter().map(Profile::machine).collect()
}

/// Returns whether a timing has no error and enough samples.
pub fn is_sound(timing: &Timing) -> bool {
    timing.error.is_none() && timing.samples_ns.len() >= FEWEST_SAMPLES
}

impl Spot {
    fn of(point: &Point, algorithms: &[Timed]) -> Self {
        let mut spot = Self { scenario: point.scenario.clone(), load: point.load, ..Self::default() };
        for timing in point.timings.iter().filter(|t| is_sound(t)) {
            let position = algorithms.iter().position(|a| a.id == timing.algorithm);
            let ns: Vec<f64> = timing.samples_ns.iter().map(|&ns| ns as f64).collect();
            let (Some(k), Some(median_ns)) = (position, median(&ns)) else { continue };
            // A clock may read 0.
            let ln: Vec<f64> = ns.iter().map(|ns| ns.max(1.0).ln()).collect();
            spot.medians.push((k as u16, median_ns));
            spot.means.push(mean(&ns));
            spot.errors_ln.push(median_error(&ln).unwrap_or(0.0));
        }
        spot
    }

    /// Returns the least median in ns.
    pub fn best(&self) -> Option<f64> {
        self.medians.iter().map(|m| m.1).min_by(f64::total_cmp)
    }

    /// Returns the median of the algorithm at a position, in ns.
    pub fn of_position(&self, algorithm: u16) -> Option<f64> {
        self.with_error(algorithm).map(|m| m.0)
    }

    /// Returns the median of the algorithm at a position in ns, and the standard error of its natural logarithm.
    pub fn with_error(&self, algorithm: u16) -> Option<(f64, f64)> {
        self.medians.iter().zip(&self.errors_ln).find(|(m, _)| m.0 == algorithm).map(|(m, error)| (m.1, *error))
    }
}
