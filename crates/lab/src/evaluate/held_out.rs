//! Regrets and crossovers of what was held out, for figures and tables.

use super::crossovers::ComparedCrossover;
use super::scores::{Judged, OURS, regrets_of_units};
use std::collections::BTreeSet;

/// The held-out machines.
#[derive(Debug, Clone, Default)]
pub struct HeldOut {
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

impl HeldOut {
    pub(super) fn new(all: &[Judged], crossovers: Vec<HeldOutCrossover>, by_machine: bool) -> Self {
        let ours = all.iter().filter(|j| j.name == OURS);
        let units: BTreeSet<&str> = ours.map(|j| j.unit(by_machine)).collect();
        Self {
            regrets: regrets_of_units(all, by_machine),
            units: units.into_iter().map(str::to_owned).collect(),
            by_machine,
            crossovers,
        }
    }
}
