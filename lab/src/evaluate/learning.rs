//! How accuracy grows with the number of machines.

use super::fit::Designs;
use super::profile::{Profile, machines};
use super::scores;
use super::validate::Data;
use crate::progress::Progress;
use sapwise_scenes::Random;
use anyhow::Result;
use rayon::prelude::*;
use sapwise::stats::quantile;
use sapwise::model::{Learning, LearningScore};
use std::collections::BTreeSet;

/// Numbers of machines in a training.
const MACHINES: [usize; 7] = [2, 3, 6, 12, 30, 60, 120];
/// Trainings of one size: the mean over them and their range are told.
const TRAININGS: usize = 8;
/// Machines that a training is judged on, at most, out of those that are not in it.
const JUDGED: usize = 4;
/// Profiles of a machine that are trained or judged on, at most.
const OF_MACHINE: usize = 20;
/// Seed of the draws.
const SEED: u64 = 1;

/// Some of the machines, and some of the others.
#[derive(Debug)]
pub(super) struct Training {
    machines: usize,
    /// Positions of the profiles to train on.
    known: Vec<usize>,
    /// Positions of the profiles to judge by.
    judged: Vec<usize>,
}

/// Random trainings, those of the same size one behind the other, no two of them on the same machines. None of as many machines as there
/// are, since there would be nothing to judge them by.
pub(super) fn trainings(profiles: &[Profile]) -> Vec<Training> {
    let machines = machines(profiles);
    let mut of_machine: Vec<Vec<usize>> = vec![Vec::new(); machines.len()];
    for (k, profile) in profiles.iter().enumerate() {
        // Every machine of a profile is in the list.
        of_machine[machines.partition_point(|m| *m < profile.machine())].push(k);
    }
    let profiles_of = |chosen: &[usize]| -> Vec<usize> {
        let some = |&m: &usize| of_machine[m].iter().copied().step_by(of_machine[m].len().div_ceil(OF_MACHINE));
        chosen.iter().flat_map(some).collect()
    };
    let mut random = Random::new(SEED);
    let mut all = Vec::new();
    for count in MACHINES.into_iter().filter(|&k| k < machines.len()) {
        let mut drawn: BTreeSet<Vec<usize>> = BTreeSet::new();
        for _ in 0..TRAININGS {
            let order = random.shuffled(machines.len());
            let (mut known, others) = (order[..count].to_vec(), &order[count..]);
            known.sort_unstable();
            if drawn.insert(known.clone()) {
                let judged = profiles_of(&others[..others.len().min(JUDGED)]);
                all.push(Training { machines: count, known: profiles_of(&known), judged });
            }
        }
    }
    all
}

/// Trains and judges each. Each is a step of `progress`.
///
/// # Errors
/// When a regression fails.
pub(super) fn learning(profiles: &[Profile], trainings: &[Training], progress: &Progress) -> Result<Vec<Learning>> {
    let regrets = |training: &Training| -> Result<Vec<(&'static str, f64)>> {
        let positions = training.judged.iter().chain(&training.known);
        let some: Vec<Profile> = positions.map(|&k| profiles[k].clone()).collect();
        let judged: Vec<usize> = (0..training.judged.len()).collect();
        let found = Data::new(&some, &Designs::new(&some)).fold(&judged, &judged)?;
        progress.advance(1);
        let scored = scores::scores(&found.judged);
        Ok(scores::names(&found.judged).into_iter().zip(scored).map(|(name, s)| (name, s.mean_regret)).collect())
    };
    let all: Vec<Vec<(&str, f64)>> = trainings.par_iter().map(regrets).collect::<Result<_>>()?;
    let mut course = Vec::new();
    let mut done = 0;
    for alike in trainings.chunk_by(|a, b| a.machines == b.machines) {
        let own = &all[done..done + alike.len()];
        done += alike.len();
        let score = |k: usize| {
            let values: Vec<f64> = own.iter().map(|regrets| regrets[k].1).collect();
            LearningScore {
                name: own[0][k].0.to_owned(),
                mean_regret: values.iter().sum::<f64>() / values.len() as f64,
                low: quantile(&values, 0.05).unwrap_or_default(),
                high: quantile(&values, 0.95).unwrap_or_default(),
            }
        };
        let methods = (0..own[0].len()).map(score).collect();
        course.push(Learning { machines: alike[0].machines, trainings: alike.len(), methods });
    }
    Ok(course)
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::Machine;
    use super::*;

    fn profiles(machines: Vec<Machine>) -> Vec<Profile> {
        machines.into_iter().map(|m| Profile::of(m.name, &m.report())).collect()
    }

    #[test]
    fn sizes_go_as_far_as_there_are_machines() {
        let profiles = profiles(Machine::family());
        let drawn = trainings(&profiles);
        let course = learning(&profiles, &drawn, &Progress::new(0)).unwrap();
        assert_eq!(course.iter().map(|l| l.machines).collect::<Vec<_>>(), [2, 3, 6]);
        assert!(course.iter().all(|l| (4..=TRAININGS).contains(&l.trainings)), "{course:?}");
        let of = |k: usize, name: &str| course[k].methods.iter().find(|r| r.name == name).unwrap().clone();
        let (few, many) = (of(0, "physics"), of(2, "physics"));
        assert!(many.mean_regret < 0.1 && many.mean_regret < of(2, "single best").mean_regret, "{course:?}");
        assert!(few.low <= few.mean_regret && few.mean_regret <= few.high && few.low < few.high, "{few:?}");
        assert!(trainings(&profiles[..2]).is_empty());
    }

    #[test]
    fn no_machine_is_judged_that_was_trained_on() {
        let mut machines = Machine::family();
        machines[1].name = machines[0].name;
        machines[2].name = machines[0].name;
        let profiles = profiles(machines);
        let machine = |k: &usize| profiles[*k].machine();
        let drawn = trainings(&profiles);
        assert!(drawn.iter().any(|t| t.known.len() > t.machines));
        for training in drawn {
            assert!(training.judged.iter().all(|j| training.known.iter().all(|k| machine(k) != machine(j))), "{training:?}");
        }
    }
}
