//! How accuracy grows with the number of machines.

use super::rows::Profile;
use super::validate::validate;
use crate::turns::Turns;
use anyhow::Result;
use serde::Serialize;

/// Numbers of machines.
const MACHINES: [usize; 5] = [3, 6, 12, 24, 48];
/// Machines that are left out in all the subsets of one size, about: a single subset of three machines says little.
const LEFT_OUT: usize = 24;
/// Seed of the subsets.
const SEED: u64 = 1;

/// How well each way to choose did with so many machines.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Learning {
    /// Machines in a subset, one of which is left out in turn.
    pub(crate) machines: usize,
    /// Random subsets.
    pub(crate) subsets: usize,
    /// Ways to choose with their mean regret over the subsets.
    pub(crate) mean_regrets: Vec<(String, f64)>,
}

/// Validates random subsets of the machines, each with all of its profiles.
///
/// # Errors
/// When a regression fails.
pub(crate) fn learning(profiles: &[Profile]) -> Result<Vec<Learning>> {
    let mut machines: Vec<&str> = profiles.iter().map(|p| p.report.hardware.machine.physical_id.as_str()).collect();
    machines.sort_unstable();
    machines.dedup();
    let mut turns = Turns::new(SEED);
    let mut course = Vec::new();
    for count in MACHINES.into_iter().filter(|&k| k <= machines.len()) {
        // There is one subset of all.
        let subsets = if count == machines.len() { 1 } else { LEFT_OUT.div_ceil(count) };
        let mut sums: Vec<(String, f64)> = Vec::new();
        for _ in 0..subsets {
            let chosen: Vec<&str> = turns.order(machines.len())[..count].iter().map(|&k| machines[k]).collect();
            let within = |p: &&Profile| chosen.contains(&p.report.hardware.machine.physical_id.as_str());
            let subset: Vec<Profile> = profiles.iter().filter(within).cloned().collect();
            for score in validate(&subset)?.0.methods {
                match sums.iter_mut().find(|s| s.0 == score.name) {
                    Some(sum) => sum.1 += score.mean_regret,
                    None => sums.push((score.name, score.mean_regret)),
                }
            }
        }
        let mean_regrets = sums.into_iter().map(|(name, sum)| (name, sum / subsets as f64)).collect();
        course.push(Learning { machines: count, subsets, mean_regrets });
    }
    Ok(course)
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::Machine;
    use super::*;

    #[test]
    fn sizes_go_as_far_as_there_are_machines() {
        let of = |m: Machine| Profile { file: m.name.to_owned(), report: m.report() };
        let profiles: Vec<Profile> = Machine::family().into_iter().map(of).collect();
        let course = learning(&profiles).unwrap();
        assert_eq!(course.iter().map(|l| (l.machines, l.subsets)).collect::<Vec<_>>(), [(3, 8), (6, 4)]);
        let regret = |k: usize, name: &str| course[k].mean_regrets.iter().find(|r| r.0 == name).unwrap().1;
        assert!(regret(1, "physics") < 0.1 && regret(1, "physics") < regret(1, "single best"), "{course:?}");
        assert!(learning(&profiles[..2]).unwrap().is_empty());
    }
}
