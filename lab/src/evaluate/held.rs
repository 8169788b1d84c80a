//! What a picture shows of a validation.

use super::crossing::Beside;
use super::profile::Profile;
use super::scores::{Judged, names};
use super::validate::OURS;
use super::yardstick::average;
use sapwise::{AlgorithmCost, BackendClass};
use std::collections::{BTreeMap, BTreeSet};

/// Times of a profile that are kept, about.
const TIMES_OF_PROFILE: usize = 40;
/// Times that are kept of all, at most: more would lie upon each other.
const MOST_TIMES: usize = 900;

/// The held-out machines.
#[derive(Debug, Clone, Default)]
pub(crate) struct Held {
    /// Measured and predicted times, thinned evenly.
    pub(crate) times: Vec<Time>,
    /// For each way to choose the mean regret on each held-out machine, or profile where there is one machine only.
    pub(crate) regrets: Vec<(&'static str, Vec<f64>)>,
    /// The machine, by its physical id, or the file of the profile that each regret of [`OURS`] is of.
    pub(crate) units: Vec<String>,
    /// Whether the regrets are of machines.
    pub(crate) by_machine: bool,
    /// Measured borders beside the predicted ones.
    pub(crate) borders: Vec<HeldBorder>,
}

/// A border of a held-out profile.
#[derive(Debug, Clone)]
pub(crate) struct HeldBorder {
    /// The file of the profile.
    pub(crate) file: String,
    pub(crate) beside: Beside,
}

/// A time of an algorithm on a held-out profile.
#[derive(Debug, Clone)]
pub(crate) struct Time {
    /// The file of the profile.
    pub(crate) file: String,
    pub(crate) objects: u32,
    pub(crate) method: String,
    pub(crate) class: BackendClass,
    pub(crate) measured_ns: f64,
    pub(crate) predicted_ns: f64,
}

impl Time {
    /// Some of the times of a profile, with what was predicted for them.
    pub(super) fn of(profile: &Profile, costs: &[AlgorithmCost]) -> Vec<Self> {
        let mut times = Vec::new();
        for spot in &profile.points {
            for &(k, measured_ns) in &spot.medians {
                let id = profile.id(k);
                let Some(cost) = costs.iter().find(|c| c.algorithm == *id) else { continue };
                times.push((id, spot, measured_ns, cost));
            }
        }
        let step = times.len().div_ceil(TIMES_OF_PROFILE).max(1);
        let time = |&(id, spot, measured_ns, cost): &_| {
            let (id, spot, cost): (&sapwise::AlgorithmId, &super::profile::Spot, &AlgorithmCost) = (id, spot, cost);
            Self {
                file: profile.file.clone(),
                objects: spot.load.objects,
                method: id.method().to_owned(),
                class: id.backend().class(),
                measured_ns,
                predicted_ns: cost.curve.cost_ns(&spot.load),
            }
        };
        times.iter().step_by(step).map(time).collect()
    }
}

impl Held {
    pub(super) fn new(all: &[Judged], times: Vec<Time>, borders: Vec<HeldBorder>, by_machine: bool) -> Self {
        let step = times.len().div_ceil(MOST_TIMES).max(1);
        let regrets = names(all).into_iter().map(|name| {
            let own = all.iter().filter(|j| j.name == name);
            let mut units: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
            own.for_each(|j| units.entry(j.unit(by_machine)).or_default().push(j.regret.mean));
            (name, units.values().map(|m| average(m)).collect())
        });
        let regrets = regrets.collect();
        let ours = all.iter().filter(|j| j.name == OURS);
        let units: BTreeSet<&str> = ours.map(|j| j.unit(by_machine)).collect();
        let units = units.into_iter().map(str::to_owned).collect();
        Self { times: times.into_iter().step_by(step).collect(), regrets, units, by_machine, borders }
    }
}
