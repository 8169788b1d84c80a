//! Regrets on held-out profiles and their crossovers, for figures and tables.

use super::crossovers::ComparedCrossover;
use crate::training::Regrets;

/// The held-out machines.
#[derive(Debug, Clone, Default)]
pub struct HeldOut {
    /// The mean regrets of each strategy on each held-out machine, or on each profile of the only one.
    pub regrets: Vec<UnitRegrets>,
    /// Measured crossovers beside the predicted ones.
    pub crossovers: Vec<HeldOutCrossover>,
}

/// The mean regrets of a strategy on a held-out machine.
#[derive(Debug, Clone)]
pub struct UnitRegrets {
    /// The strategy.
    pub strategy: &'static str,
    /// The machine, or the file of the profile of the only one.
    pub unit: String,
    /// With only the machine held out.
    pub seen: Regrets,
    /// With the scenario held out too; `None` if the strategy is not judged on that.
    pub unseen: Option<Regrets>,
}

/// A crossover of a held-out profile.
#[derive(Debug, Clone)]
pub struct HeldOutCrossover {
    /// The file of the profile.
    pub file: String,
    /// The scenario of the frames.
    pub scenario: String,
    /// The measured position and the predicted one.
    pub compared: ComparedCrossover,
}
