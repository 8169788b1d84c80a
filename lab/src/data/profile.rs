//! What training keeps of a report: the hardware, and the median of each algorithm at each point.

use crate::report::{Label, Point, Report, Timed, Timing};
use crate::sweep::median;
use sapwise::{AlgorithmId, Entry, Hardware, Load};
use std::borrow::Cow;
use std::hash::{DefaultHasher, Hash, Hasher};

/// A report without its samples, of which thousands fit into memory.
#[derive(Debug, Clone)]
pub struct Profile {
    /// File name without folders.
    pub file: String,
    /// What kind of evidence it is.
    pub label: Label,
    /// Without the raw samples of its parameters, its cores as far apart as at half of the points.
    pub hardware: Hardware,
    /// The same as it was measured, where that differs.
    pub measured: Option<Hardware>,
    /// The algorithms that were timed.
    pub algorithms: Vec<Timed>,
    /// Where they were timed, in the order of the report.
    pub points: Vec<Spot>,
}

/// One point of a report.
#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    /// Name of the scenario.
    pub scenario: String,
    /// The load that an in-line choice would have estimated.
    pub load: Load,
    /// Latency between cores before and after the samples, their geometric mean; `None` where it is not known.
    pub core_to_core_ns: Option<f64>,
    /// Position in [`Profile::algorithms`], and the median over the frames in ns.
    pub medians: Vec<(u16, f64)>,
}

/// A median of fewer samples says nothing about disturbed frames.
pub(super) const FEWEST_SAMPLES: usize = 3;

impl Profile {
    /// Keeps of a report what is sound. Timings with an error or too few samples go, and with them points that are empty then.
    pub fn of(file: &str, report: &Report) -> Self {
        let mut hardware = report.hardware.clone();
        let of_gpus = hardware.gpus.iter_mut().flat_map(|g| &mut g.parameters);
        hardware.parameters.iter_mut().chain(of_gpus).for_each(|p| p.raw = Vec::new());
        let points = report.points.iter().map(|p| Spot::of(p, &report.algorithms));
        let moved = as_at_the_points(&hardware, report);
        let measured = (moved != hardware).then_some(hardware);
        Self {
            file: file.to_owned(),
            label: report.label,
            hardware: moved,
            measured,
            algorithms: report.algorithms.clone(),
            points: points.filter(|s| !s.medians.is_empty() && s.load.objects > 0).collect(),
        }
    }

    /// The hardware with its cores as far apart as they were at a point, where that is known. Always from what was measured: a fork and
    /// join that was bounded on the way to another place does not find back.
    pub fn hardware_at(&self, core_to_core_ns: Option<f64>) -> Cow<'_, Hardware> {
        match core_to_core_ns {
            Some(ns) => Cow::Owned(self.measured.as_ref().unwrap_or(&self.hardware).with_cores_apart(ns)),
            None => Cow::Borrowed(&self.hardware),
        }
    }

    /// The physical machine.
    pub fn machine(&self) -> &str {
        &self.hardware.machine.physical_id
    }

    /// An algorithm by its position.
    pub fn id(&self, position: u16) -> &AlgorithmId {
        &self.algorithms[usize::from(position)].id
    }

    /// The medians of a point, in ns.
    #[cfg(test)]
    pub fn medians<'a>(&'a self, spot: &'a Spot) -> impl Iterator<Item = (&'a AlgorithmId, f64)> {
        spot.medians.iter().map(|&(k, ns)| (self.id(k), ns))
    }

    /// These algorithms with the revisions that they were timed in, 0 of one that was not, as a model is asked for them.
    pub fn with_revisions(&self, ids: &[AlgorithmId]) -> Vec<Entry> {
        let revision = |id: &AlgorithmId| self.algorithms.iter().find(|t| t.id == *id).map_or(0, |t| t.revision);
        ids.iter().map(|id| Entry::new(id.clone(), revision(id))).collect()
    }

    /// The algorithms that were timed anywhere in it.
    pub fn available(&self) -> Vec<AlgorithmId> {
        let mut timed = vec![false; self.algorithms.len()];
        self.points.iter().flat_map(|s| &s.medians).for_each(|m| timed[usize::from(m.0)] = true);
        self.algorithms.iter().zip(timed).filter(|(_, timed)| *timed).map(|(t, _)| t.id.clone()).collect()
    }

    /// `uniform` where it has that scenario, else its first one.
    pub fn usual_scenario(&self) -> &str {
        usual(self.points.iter().map(|p| p.scenario.as_str()))
    }

    /// The loads of a scenario, ascending by objects, each size once.
    pub fn slice(&self, scenario: &str) -> Vec<Load> {
        let mut loads: Vec<Load> = self.points.iter().filter(|p| p.scenario == scenario).map(|p| p.load).collect();
        loads.sort_by_key(|l| l.objects);
        loads.dedup_by_key(|l| l.objects);
        loads
    }

    /// Position of an algorithm among those of the report.
    pub fn position(&self, id: &AlgorithmId) -> Option<u16> {
        self.algorithms.iter().position(|t| t.id == *id).map(|k| k as u16)
    }

    /// Leaves out the algorithms that `stays` does not admit, with their timings, and the points that are empty then.
    pub fn retain(&mut self, stays: impl Fn(&Timed) -> bool) {
        let kept: Vec<bool> = self.algorithms.iter().map(stays).collect();
        if kept.iter().all(|k| *k) {
            return;
        }
        let place = |k: u16| kept[..usize::from(k)].iter().filter(|k| **k).count() as u16;
        for spot in &mut self.points {
            spot.medians.retain(|m| kept[usize::from(m.0)]);
            spot.medians.iter_mut().for_each(|m| m.0 = place(m.0));
        }
        self.points.retain(|s| !s.medians.is_empty());
        let mut kept = kept.into_iter();
        self.algorithms.retain(|_| kept.next() == Some(true));
    }

    /// The same for two copies of one measurement, whatever their file names and labels; in all likelihood for no two others.
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

/// The hardware with its cores as far apart as they were at half of the points. Where a host moves them, the seconds in which the
/// parameters were measured may have been unlike the minutes after.
pub fn as_at_the_points(hardware: &Hardware, report: &Report) -> Hardware {
    let apart: Vec<f64> = report.points.iter().filter_map(between_cores).collect();
    sapwise::stats::median(&apart).map_or_else(|| hardware.clone(), |ns| hardware.with_cores_apart(ns))
}

/// The latency between cores at a point: the geometric mean of before and after.
fn between_cores(point: &Point) -> Option<f64> {
    point.core_to_core_ns.map(|[before, after]| (before * after).sqrt())
}

/// `uniform` where a report has it, else its first scenario.
pub fn usual_scenario(report: &Report) -> &str {
    usual(report.points.iter().map(|p| p.scenario.as_str()))
}

/// `uniform` where it is among the names, else the first of them.
fn usual<'a>(mut names: impl Iterator<Item = &'a str> + Clone) -> &'a str {
    let first = names.clone().next();
    names.find(|n| *n == "uniform").or(first).unwrap_or("uniform")
}

/// The physical machines of profiles, each once, in order.
pub fn machines(profiles: &[Profile]) -> Vec<&str> {
    let mut machines: Vec<&str> = profiles.iter().map(Profile::machine).collect();
    machines.sort_unstable();
    machines.dedup();
    machines
}

/// Whether a timing has no error and enough samples.
pub fn is_sound(timing: &Timing) -> bool {
    timing.error.is_none() && timing.samples_ns.len() >= FEWEST_SAMPLES
}

impl Spot {
    fn of(point: &Point, algorithms: &[Timed]) -> Self {
        let median = |t: &Timing| {
            let k = algorithms.iter().position(|a| a.id == t.algorithm)?;
            Some((k as u16, median(&t.samples_ns)?))
        };
        Self {
            scenario: point.scenario.clone(),
            load: point.load,
            core_to_core_ns: between_cores(point),
            medians: point.timings.iter().filter(|t| is_sound(t)).filter_map(median).collect(),
        }
    }

    /// The least median in ns; `None` of none.
    pub fn best(&self) -> Option<f64> {
        self.medians.iter().map(|m| m.1).min_by(f64::total_cmp)
    }

    /// The median of an algorithm by its position.
    pub fn of_position(&self, algorithm: u16) -> Option<f64> {
        self.medians.iter().find(|m| m.0 == algorithm).map(|m| m.1)
    }
}
