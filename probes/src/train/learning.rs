//! How accuracy grows with the number of machines.

use super::fit::Designs;
use super::profile::Profile;
use super::validate::validate;
use crate::progress::Progress;
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

/// Some of the machines, each with all of its profiles.
pub(super) struct Subset<'a> {
    machines: usize,
    pub(super) profiles: Vec<&'a Profile>,
}

/// Random subsets of the machines, those of the same size one behind the other.
pub(super) fn subsets(profiles: &[Profile]) -> Vec<Subset<'_>> {
    let mut machines: Vec<&str> = profiles.iter().map(|p| p.machine()).collect();
    machines.sort_unstable();
    machines.dedup();
    let mut turns = Turns::new(SEED);
    let mut all = Vec::new();
    for count in MACHINES.into_iter().filter(|&k| k <= machines.len()) {
        // There is one subset of all.
        let subsets = if count == machines.len() { 1 } else { LEFT_OUT.div_ceil(count) };
        for _ in 0..subsets {
            let chosen: Vec<&str> = turns.order(machines.len())[..count].iter().map(|&k| machines[k]).collect();
            let within = |p: &&Profile| chosen.contains(&p.machine());
            all.push(Subset { machines: count, profiles: profiles.iter().filter(within).collect() });
        }
    }
    all
}

/// Validates each subset. Each profile of each is a step of `progress`.
///
/// # Errors
/// When a regression fails.
pub(super) fn learning(subsets: &[Subset<'_>], progress: &Progress) -> Result<Vec<Learning>> {
    let mut course = Vec::new();
    for alike in subsets.chunk_by(|a, b| a.machines == b.machines) {
        let machines = alike[0].machines;
        let mut sums: Vec<(String, f64)> = Vec::new();
        for subset in alike {
            progress.message(format!("validating subsets of {machines} machines"));
            let profiles: Vec<Profile> = subset.profiles.iter().map(|&p| p.clone()).collect();
            for score in validate(&profiles, &Designs::new(&profiles), progress)?.0.methods {
                match sums.iter_mut().find(|s| s.0 == score.name) {
                    Some(sum) => sum.1 += score.mean_regret,
                    None => sums.push((score.name, score.mean_regret)),
                }
            }
        }
        let mean_regrets = sums.into_iter().map(|(name, sum)| (name, sum / alike.len() as f64)).collect();
        course.push(Learning { machines, subsets: alike.len(), mean_regrets });
    }
    Ok(course)
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::Machine;
    use super::*;

    #[test]
    fn sizes_go_as_far_as_there_are_machines() {
        let of = |m: Machine| Profile::of(m.name, &m.report());
        let profiles: Vec<Profile> = Machine::family().into_iter().map(of).collect();
        let chosen = subsets(&profiles);
        let course = learning(&chosen, &Progress::new(0)).unwrap();
        assert_eq!(course.iter().map(|l| (l.machines, l.subsets)).collect::<Vec<_>>(), [(3, 8), (6, 4)]);
        let regret = |k: usize, name: &str| course[k].mean_regrets.iter().find(|r| r.0 == name).unwrap().1;
        assert!(regret(1, "physics") < 0.1 && regret(1, "physics") < regret(1, "single best"), "{course:?}");
        assert!(subsets(&profiles[..2]).is_empty());
    }
}
