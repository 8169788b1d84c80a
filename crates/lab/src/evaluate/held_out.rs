//! Times, regrets and crossovers of what was held out, for figures and tables.

use super::crossovers::ComparedCrossover;
use super::scores::{Judged, OURS, regrets_of_units};
use crate::data::{Profile, Spot};
use sapwise::AlgorithmId;
use sapwise::tuning::AlgorithmCost;
use std::collections::BTreeSet;

/// Times of a profile that are kept, about.
const TIMES_OF_PROFILE: usize = 40;
/// Times that are kept of all, at most: more would lie upon each other.
const MOST_TIMES: usize = 900;

/// The held-out machines.
#[derive(Debug, Clone, Default)]
pub struct HeldOut {
    /// Measured and predicted times, thinned evenly.
    pub times: Vec<Time>,
    /// For each strategy the mean regret on each held-out machine, or on each profile of the only one.
    pub regrets: Vec<(&'static str, Vec<f64>)>,
    /// The machine, or the file of the profile, that each regret of [`OURS`] is of.
    pub units: Vec<String>,
    /// Whether the regrets are of machines.
    pub by_machine: bool,
    /// Measured crossovers beside the predicted ones.
    pub crossovers: Vec<HeldOutCrossover>,
}

/// A crossover of a held-out profile.
#[derive(Debug, Clone)]
pub struct HeldOutCrossover {
    /// The file of the profile.
    pub file: String,
    /// The scenario of the frames.
    pub scenario: String,
    /// Where it was measured, and where it was predicted.
    pub compared: ComparedCrossover,
}

/// A time of an algorithm on a held-out profile.
#[derive(Debug, Clone)]
pub struct Time {
    /// The file of the profile.
    pub file: String,
    /// The scenario of the frames.
    pub scenario: String,
    /// Their objects.
    pub objects: u32,
    /// The algorithm.
    pub algorithm: AlgorithmId,
    /// The median over the frames.
    pub measured_ns: f64,
    /// What was predicted for it.
    pub predicted_ns: f64,
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
            let (id, spot, cost): (&AlgorithmId, &Spot, &AlgorithmCost) = (id, spot, cost);
            Self {
                file: profile.file.clone(),
                scenario: spot.scenario.clone(),
                objects: spot.load.objects,
                algorithm: id.clone(),
                measured_ns,
                predicted_ns: cost.curve.cost_ns(&spot.load),
            }
        };
        times.iter().step_by(step).map(time).collect()
    }
}

impl HeldOut {
    pub(super) fn new(all: &[Judged], times: Vec<Time>, crossovers: Vec<HeldOutCrossover>, by_machine: bool) -> Self {
        let step = times.len().div_ceil(MOST_TIMES).max(1);
        let ours = all.iter().filter(|j| j.name == OURS);
        let units: BTreeSet<&str> = ours.map(|j| j.unit(by_machine)).collect();
        Self {
            times: times.into_iter().step_by(step).collect(),
            regrets: regrets_of_units(all, by_machine),
            units: units.into_iter().map(str::to_owned).collect(),
            by_machine,
            crossovers,
        }
    }
}
