//! How well a model does on a machine that was left out, and how that differs from what another one does.

use super::super::baselines::{available, by_costs};
use super::super::curve::measured_costs;
use super::super::profile::Profile;
use super::super::yardstick::{NOT_TIMED, Yardstick, average};
use super::borders::{Pair, pairs, slice};
use super::interval::Interval;
use sapwise::{AlgorithmCost, AlgorithmId, Hardware, Load, Model};
use std::collections::BTreeMap;

/// A profile with what its predictions are held against.
pub(super) struct Judge<'a> {
    profile: &'a Profile,
    available: Vec<AlgorithmId>,
    /// With their revisions.
    wanted: Vec<(AlgorithmId, u32)>,
    yardstick: Yardstick,
    slice: Vec<Load>,
    /// The pairs whose border was measured, and where it lies in octaves.
    pairs: Vec<(Pair, f64)>,
}

/// What came of a prediction.
#[derive(Debug, Clone)]
pub(super) struct Outcome {
    pub(super) regret: f64,
    /// Octaves of each pair of the judge; `None` where one side was not predicted.
    octaves: Vec<Option<f64>>,
    /// For each method on a class of processor that was predicted how its measured times lie to the predicted ones.
    pub(super) off: BTreeMap<String, Off>,
}

/// Logarithms of measured over predicted times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Off {
    /// Their mean: above zero where the machine is slower than predicted.
    pub(super) mean_ln: f64,
    /// The mean of their absolute values.
    distance_ln: f64,
}

impl<'a> Judge<'a> {
    pub(super) fn new(profile: &'a Profile) -> Self {
        let available = available(profile);
        let wanted = profile.with_revisions(&available);
        let (slice, measured) = (slice(profile), measured_costs(profile).0);
        let at = |pair: Pair| pair.octaves(&measured, &slice).map(|octaves| (pair, octaves));
        let pairs = pairs(&available).into_iter().filter_map(at).collect();
        Self { profile, available, wanted, yardstick: Yardstick::new(profile), slice, pairs }
    }

    /// The prediction of a model for this machine with some hardware.
    pub(super) fn outcome(&self, model: &Model, hardware: &Hardware) -> Outcome {
        let Ok(prediction) = model.predict(hardware, &self.wanted) else {
            // Nothing is chosen, which is charged like what was never timed.
            return Outcome { regret: NOT_TIMED - 1.0, octaves: vec![None; self.pairs.len()], off: BTreeMap::new() };
        };
        let octaves = self.pairs.iter().map(|(pair, _)| pair.octaves(&prediction.costs, &self.slice)).collect();
        let off = self.off(&prediction.costs);
        let choose = by_costs(prediction.costs, &self.available);
        Outcome { regret: self.yardstick.regret(self.profile, &choose).mean, octaves, off }
    }

    fn off(&self, costs: &[AlgorithmCost]) -> BTreeMap<String, Off> {
        let mut found: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let position = |k: u16| costs.iter().find(|c| c.algorithm == *self.profile.id(k));
        let known: Vec<Option<&AlgorithmCost>> = (0..self.profile.algorithms.len() as u16).map(position).collect();
        for spot in &self.profile.points {
            for &(k, ns) in &spot.medians {
                let Some(cost) = known[usize::from(k)] else { continue };
                let ln = (ns / cost.curve.cost_ns(&spot.load)).ln();
                found.entry(method_name(&cost.algorithm)).or_default().push(ln);
            }
        }
        let off = |logs: Vec<f64>| {
            let distances: Vec<f64> = logs.iter().map(|ln| ln.abs()).collect();
            Off { mean_ln: average(&logs), distance_ln: average(&distances) }
        };
        found.into_iter().map(|(name, logs)| (name, off(logs))).collect()
    }
}

/// A method on a class of processor, whatever the number of threads or GPUs.
fn method_name(id: &AlgorithmId) -> String {
    format!("{} on the {}", id.method(), id.backend().class())
}

/// What of an outcome changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum What {
    /// The mean regret.
    Regret,
    /// The border, to either side.
    Moves,
    /// The distance of the border from the measured one.
    Error,
    /// The distance of the times of an algorithm from the measured ones.
    Time,
}

/// Changes of outcomes: of what and at which border or algorithm, by the position of the physical machine.
#[derive(Debug, Clone, Default)]
pub(super) struct Shifts(BTreeMap<(What, String), BTreeMap<usize, Vec<f64>>>);

impl Shifts {
    /// Adds what changed on a machine from one outcome to another.
    pub(super) fn add(&mut self, machine: usize, judge: &Judge<'_>, before: &Outcome, after: &Outcome) {
        let mut put = |what, border: &str, by| {
            self.0.entry((what, border.to_owned())).or_default().entry(machine).or_default().push(by);
        };
        put(What::Regret, "", after.regret - before.regret);
        for (algorithm, before) in &before.off {
            if let Some(after) = after.off.get(algorithm) {
                put(What::Time, algorithm, after.distance_ln - before.distance_ln);
            }
        }
        for ((pair, measured), (before, after)) in judge.pairs.iter().zip(before.octaves.iter().zip(&after.octaves)) {
            let (Some(before), Some(after)) = (before, after) else { continue };
            put(What::Moves, &pair.name, (after - before).abs());
            put(What::Error, &pair.name, (after - measured).abs() - (before - measured).abs());
        }
    }

    /// Those of both.
    pub(super) fn and(mut self, other: Self) -> Self {
        for (key, machines) in other.0 {
            let own = self.0.entry(key).or_default();
            machines.into_iter().for_each(|(k, values)| own.entry(k).or_default().extend(values));
        }
        self
    }

    /// The borders or algorithms of which something is known.
    pub(super) fn of(&self, what: What) -> Vec<&str> {
        self.0.keys().filter(|k| k.0 == what).map(|k| k.1.as_str()).collect()
    }

    /// Physical machines with this.
    pub(super) fn machines(&self, what: What, border: &str) -> usize {
        self.0.get(&(what, border.to_owned())).map_or(0, BTreeMap::len)
    }

    /// The mean over the machines, each with the mean of its profiles and permutations.
    pub(super) fn interval(&self, what: What, border: &str) -> Option<Interval> {
        let machines = self.0.get(&(what, border.to_owned()))?;
        Interval::of(&machines.values().map(|values| average(values)).collect::<Vec<f64>>())
    }
}
