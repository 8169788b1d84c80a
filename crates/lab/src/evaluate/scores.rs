//! From regrets on held-out profiles to the scores of strategies.

use super::held_out::UnitRegrets;
use super::regret_table::Regret;
use crate::spread::range;
use crate::text::once;
use crate::training::{MethodScore, Regrets, Split};
use sapwise_tune::stats::{self, median};
use std::collections::BTreeMap;

/// The strategy that the other ones must beat.
pub const SINGLE_BEST: &str = "single best";
/// The strategy of `predict`.
pub const OURS: &str = "physics + load";
/// The same among the algorithms that a program runs unless it asks for others.
pub(super) const RUNNING: &str = "physics + load (running)";

/// A crossover that is predicted within this many octaves is near: a factor of 1.4.
const NEAR_OCTAVES: f64 = 0.5;

/// How one strategy did on one held-out profile.
pub(super) struct Judged {
    pub(super) name: &'static str,
    /// The file of the profile.
    pub(super) file: String,
    /// The physical machine.
    pub(super) machine: String,
    /// Whether any algorithm ran on several threads.
    pub(super) several_threads: bool,
    pub(super) regret: Regret,
    /// Regret with the scenario held out too; `None` if the strategy is not judged on that.
    pub(super) unseen: Option<Regret>,
    /// Regret by the means over frames.
    pub(super) by_means: Option<Regret>,
    /// Octaves between measured and predicted crossovers; `None` of a strategy that predicts no costs.
    pub(super) crossings: Option<Vec<f64>>,
}

impl Judged {
    /// Returns the unit of one regret: the machine, or the file of the profile if there is one machine only.
    pub(super) fn unit(&self, by_machine: bool) -> &str {
        if by_machine { &self.machine } else { &self.file }
    }
}

/// Scores every strategy. Every physical machine counts the same; its profiles share its weight.
pub(super) fn scores(all: &[Judged], by_machine: bool) -> Vec<MethodScore> {
    names(all).into_iter().map(|name| score(all, name, by_machine)).collect()
}

/// Returns the mean regrets of each strategy, in the order of the first profile, on each held-out machine, or on each
/// profile of the only one.
pub(super) fn regrets_of_units(all: &[Judged], by_machine: bool) -> Vec<UnitRegrets> {
    names(all).into_iter().flat_map(|name| of_units(all, name, by_machine)).collect()
}

/// Returns the mean regrets of a strategy on each held-out machine or profile.
fn of_units(all: &[Judged], strategy: &'static str, by_machine: bool) -> Vec<UnitRegrets> {
    let mut units: BTreeMap<&str, Vec<&Judged>> = BTreeMap::new();
    all.iter().filter(|j| j.name == strategy).for_each(|j| units.entry(j.unit(by_machine)).or_default().push(j));
    let regrets = |(unit, own): (&str, Vec<&Judged>)| {
        let unseen = split(&of(&own, |j| j.unseen.as_ref())).map(|s| s.all);
        let seen = split(&of(&own, |j| Some(&j.regret)))?.all;
        Some(UnitRegrets { strategy, unit: unit.to_owned(), seen, unseen })
    };
    units.into_iter().filter_map(regrets).collect()
}

/// Returns the names of the strategies, in the order of the first profile.
fn names(all: &[Judged]) -> Vec<&'static str> {
    once(all.iter().map(|j| j.name))
}

fn score(all: &[Judged], name: &'static str, by_machine: bool) -> MethodScore {
    let own: Vec<&Judged> = all.iter().filter(|j| j.name == name).collect();
    let mut profiles: BTreeMap<&str, f64> = BTreeMap::new();
    own.iter().for_each(|j| *profiles.entry(&j.machine).or_default() += 1.0);
    let weighted = |of: &dyn Fn(&Regret) -> f64| -> Vec<(f64, f64)> {
        own.iter().map(|j| (of(&j.regret), 1.0 / profiles[&j.machine[..]])).collect()
    };
    let (means, in_games) = (weighted(&|r| r.mean), weighted(&|r| r.as_in_games));
    let over = |r: &Regret| r.cells.iter().filter(|c| **c > 0.1).count() as f64 / r.cells.len().max(1) as f64;
    let crossings: Option<Vec<f64>> =
        own.iter().map(|j| j.crossings.as_deref()).collect::<Option<Vec<_>>>().map(|c| c.concat());
    let near = |c: &Vec<f64>| c.iter().filter(|e| **e <= NEAR_OCTAVES).count() as f64 / c.len() as f64;
    let of_units: Vec<f64> = of_units(all, name, by_machine).iter().map(|u| u.seen.all).collect();
    let ends = range(&of_units);
    let seen = split(&of(&own, |j| Some(&j.regret)));
    MethodScore {
        name: name.to_owned(),
        mean_regret: mean(&means),
        least_regret: ends.map(|e| e[0]),
        largest_regret: ends.map(|e| e[1]),
        unseen_scenario: split(&of(&own, |j| j.unseen.as_ref())),
        by_means: split(&of(&own, |j| j.by_means.as_ref())).map(|s| s.all),
        one_thread: seen.and_then(|s| s.one_thread),
        several_threads: seen.and_then(|s| s.several_threads),
        share_over_10_percent: mean(&weighted(&over)),
        mean_regret_in_games: Some(mean(&in_games)),
        crossing_error_octaves: crossings.as_deref().and_then(median),
        crossings_within_half_octave: crossings.as_ref().filter(|c| !c.is_empty()).map(near),
    }
}

/// A regret on one report.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part<'a> {
    pub(super) machine: &'a str,
    pub(super) several_threads: bool,
    pub(super) regret: &'a Regret,
}

fn of<'a>(own: &[&'a Judged], which: impl Fn(&'a Judged) -> Option<&'a Regret>) -> Vec<Part<'a>> {
    let part =
        |j: &&'a Judged| Some(Part { machine: &j.machine, several_threads: j.several_threads, regret: which(j)? });
    own.iter().filter_map(part).collect()
}

/// Returns mean regrets, each physical machine counting the same; `None` without any.
pub(super) fn split(parts: &[Part<'_>]) -> Option<Split> {
    let of = |admitted: &dyn Fn(&Part<'_>) -> bool| -> Option<Regrets> {
        let mut machines: BTreeMap<&str, Vec<&Regret>> = BTreeMap::new();
        parts.iter().filter(|p| admitted(p)).for_each(|p| machines.entry(p.machine).or_default().push(p.regret));
        let over = |of: fn(&Regret) -> f64| {
            let means: Vec<f64> =
                machines.values().map(|all| stats::mean(&all.iter().map(|r| of(r)).collect::<Vec<_>>())).collect();
            stats::mean(&means)
        };
        (!machines.is_empty()).then(|| Regrets { all: over(|r| r.mean), in_games: over(|r| r.as_in_games) })
    };
    Some(Split {
        all: of(&|_| true)?,
        one_thread: of(&|p| !p.several_threads),
        several_threads: of(&|p| p.several_threads),
    })
}

/// Returns the mean of values with weights.
fn mean(values: &[(f64, f64)]) -> f64 {
    let total: f64 = values.iter().map(|v| v.1).sum();
    values.iter().map(|v| v.0 * v.1).sum::<f64>() / total
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(name: &'static str, machine: &str, mean: f64) -> Judged {
        let regret = Regret { cells: vec![0.0, 2.0 * mean], weights: vec![1.0; 2], mean, as_in_games: mean / 2.0 };
        Judged {
            name,
            file: String::new(),
            machine: machine.to_owned(),
            several_threads: machine == "b",
            unseen: None,
            by_means: None,
            regret,
            crossings: (name == "ours").then(|| vec![mean, 1.0]),
        }
    }

    #[test]
    fn machines_share_their_weight_among_their_profiles() {
        let mut all = vec![judged("ours", "b", 0.3), judged(SINGLE_BEST, "b", 1.0), judged(SINGLE_BEST, "a", 1.0)];
        // Nine profiles without regret and one with little are one machine.
        all.extend((0..9).map(|_| judged("ours", "a", 0.0)));
        all.push(judged("ours", "a", 0.1));
        let scores = scores(&all, true);
        let ours = scores.iter().find(|s| s.name == "ours").unwrap();
        assert!((ours.mean_regret - 0.155).abs() < 1e-12, "{ours:?}");
        assert!((ours.share_over_10_percent - 0.275).abs() < 1e-12, "{ours:?}");
        assert!((ours.mean_regret_in_games.unwrap() - 0.0775).abs() < 1e-12);
        // Only "b" has several threads.
        assert_eq!((ours.one_thread.map(|r| r.all), ours.several_threads.map(|r| r.all)), (Some(0.01), Some(0.3)));
        assert_eq!(ours.unseen_scenario, None);
        // The range over machines holds the mean.
        assert_eq!((ours.least_regret.map(|r| (100.0 * r).round()), ours.largest_regret), (Some(1.0), Some(0.3)));
        // Eleven crossovers are one octave off, of the others one is 0.3, one 0.1 and nine are exact.
        assert!((ours.crossing_error_octaves.unwrap() - 0.65).abs() < 1e-12);
        assert_eq!(ours.crossings_within_half_octave, Some(0.5));
        assert_eq!(scores.iter().find(|s| s.name == SINGLE_BEST).unwrap().crossing_error_octaves, None);
    }
}
