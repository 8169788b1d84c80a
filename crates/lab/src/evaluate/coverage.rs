//! How far times lie from their prediction on held-out machines, and how well the other machines predict that.

use crate::data::Profile;
use crate::training::Coverage;
use sapwise::tuning::AlgorithmCost;
use sapwise_tune::stats::{mean, quantile};
use std::collections::{BTreeMap, BTreeSet};

/// The share of times that an interval should hold.
const HELD: f64 = 0.9;

/// Errors on one profile, as absolute natural logarithms.
#[derive(Debug, Clone, Default)]
pub(super) struct Errors {
    pub(super) machine: String,
    /// Of the times of all algorithms.
    times: Vec<f64>,
    /// Of the ratio of the two fastest algorithms under each load.
    ratios: Vec<f64>,
}

impl Errors {
    pub(super) fn of(profile: &Profile, costs: &[AlgorithmCost]) -> Self {
        let mut errors = Self { machine: profile.machine().to_owned(), ..Self::default() };
        for spot in &profile.points {
            let off = |&(k, ns): &(u16, f64)| {
                let cost = costs.iter().find(|c| c.algorithm == *profile.id(k))?;
                Some((ns, (ns / cost.curve.cost_ns(&spot.load)).ln()))
            };
            let mut all: Vec<(f64, f64)> = spot.medians.iter().filter_map(off).collect();
            errors.times.extend(all.iter().map(|(_, ln)| ln.abs()));
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            if let [first, second, ..] = all[..] {
                errors.ratios.push((first.1 - second.1).abs());
            }
        }
        errors
    }
}

/// Returns the intervals over all machines, and how much of each machine lies within those of the others. `None` with
/// fewer than two machines.
pub(super) fn coverage(all: &[Errors]) -> Option<Coverage> {
    let (times_90_ln, times) = of(all, |e| &e.times)?;
    let (ratios_90_ln, ratios) = of(all, |e| &e.ratios)?;
    let machines: BTreeSet<&str> = all.iter().map(|e| e.machine.as_str()).collect();
    Some(Coverage { physical_machines: machines.len(), times_90_ln, times, ratios_90_ln, ratios })
}

fn of(all: &[Errors], which: impl Fn(&Errors) -> &Vec<f64>) -> Option<(f64, f64)> {
    let mut machines: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    all.iter().for_each(|e| machines.entry(&e.machine).or_default().extend(which(e)));
    machines.retain(|_, errors| !errors.is_empty());
    if machines.len() < 2 {
        return None;
    }
    // Each machine counts the same: the mean of their quantiles.
    let limit = |left_out: Option<&str>| {
        let others = machines.iter().filter(|(m, _)| left_out.is_none_or(|l| l != **m));
        mean(&others.filter_map(|(_, errors)| quantile(errors, HELD)).collect::<Vec<f64>>())
    };
    let held = |(machine, errors): (&&str, &Vec<f64>)| {
        let limit = limit(Some(machine));
        errors.iter().filter(|e| **e <= limit).count() as f64 / errors.len() as f64
    };
    Some((limit(None), mean(&machines.iter().map(held).collect::<Vec<f64>>())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(machine: &str, scale: f64) -> Errors {
        let ramp: Vec<f64> = (0..=100).map(|k| scale * f64::from(k) / 100.0).collect();
        Errors { machine: machine.to_owned(), times: ramp.clone(), ratios: ramp }
    }

    #[test]
    fn a_machine_lies_within_what_the_others_tell() {
        assert_eq!(coverage(&[errors("a", 1.0)]), None);
        let alike = coverage(&[errors("a", 1.0), errors("b", 1.0)]).unwrap();
        assert!((alike.times_90_ln - 0.9).abs() < 1e-9 && (alike.ratios - 0.9).abs() < 0.02, "{alike:?}");
        // The second is off by twice as much. Its limit holds all errors of the first; the limit of the first holds 45
        // of its 100.
        let apart = coverage(&[errors("a", 1.0), errors("b", 2.0)]).unwrap();
        let times = (1.0 + 0.455) / 2.0;
        assert!((apart.times_90_ln - 1.35).abs() < 1e-9 && (apart.times - times).abs() < 0.01, "{apart:?}");
    }
}
