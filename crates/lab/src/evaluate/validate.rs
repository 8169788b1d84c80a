//! How well each strategy does on machines that it was not trained on, in seen and in unseen scenarios.

use super::contestants::{Contestant, Fitted, Material, Seen};
use super::coverage::{Errors, coverage};
use super::crossovers::MeasuredCrossovers;
use super::floor::floor;
use super::held_out::{HeldOut, HeldOutCrossover};
use super::partition::Partition;
use super::regret_table::{Regret, RegretTable};
use super::scores::{self, Judged};
use crate::data::{Profile, machines};
use crate::fit::Designs;
use crate::progress::Progress;
use crate::training::Validation;
use anyhow::Result;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Approximate number of judged profiles over all folds.
const MOST_JUDGED: usize = 120;
/// Most fits without a fold and a scenario. With many machines, each is held out in some of the scenarios only.
const MOST_UNSEEN: usize = 80;

/// The result of a validation.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Validated {
    /// The score of every strategy.
    pub validation: Validation,
    /// Sentences about the limits of the scores.
    pub notes: Vec<String>,
    /// Regrets on the held-out profiles, and their crossovers.
    pub held_out: HeldOut,
}

/// Holds out each fold of a [`Partition`] in turn, fits to the others, and lets every strategy choose on the held-out
/// profiles.
///
/// Scores no strategy when there is one profile only. Each fold is a step of `progress`.
///
/// # Errors
/// When a regression fails, or the user asked to stop.
pub fn validate(
    profiles: &[Profile],
    designs: &Designs<'_>,
    partition: &Partition,
    progress: &dyn Progress,
) -> Result<Validated> {
    let mut notes = Vec::new();
    let mut all: Vec<Judged> = Vec::new();
    let (mut crossovers, mut chance, mut covered) = (Vec::new(), None, None);
    progress.start(partition.folds.len() as u64);
    progress.message("validating");
    if profiles.len() < 2 {
        notes.push("nothing is validated: there is one report only; add reports of other machines".to_owned());
    } else {
        if !partition.by_machine {
            notes.push(
                "validated by holding out profiles of one physical machine: this says little about machines never \
                 seen; add reports of other machines"
                    .to_owned(),
            );
        }
        notes.push("in seen scenarios, the full sweep is judged by the timings that it was fitted to".to_owned());
        let (data, seen) = (Material::new(profiles), Seen::new(None, designs));
        let most = MOST_JUDGED.div_ceil(partition.folds.len());
        // Evenly over a fold. Profiles of GPUs alone are left out: a program always has the CPU to choose as well.
        let judged = |fold: &Vec<usize>| -> Vec<usize> {
            let whole: Vec<usize> = fold.iter().copied().filter(|&k| profiles[k].has_cpu()).collect();
            let step = whole.len().div_ceil(most).max(1);
            whole.into_iter().step_by(step).collect()
        };
        let fold = |fold: &Vec<usize>| {
            progress.check()?;
            let found = held_out(&data, &seen, &data.fit(fold, &seen)?, &judged(fold))?;
            progress.advance(1);
            Ok(found)
        };
        let mut errors = Vec::new();
        for found in partition.folds.par_iter().map(fold).collect::<Result<Vec<Found>>>()? {
            all.extend(found.judged);
            crossovers.extend(found.crossovers);
            notes.extend(found.notes);
            errors.extend(found.errors);
        }
        let unseen = unseen(&data, partition, &judged, progress)?;
        for judged in &mut all {
            judged.unseen = unseen.get(&(judged.file.clone(), judged.name)).cloned();
        }
        chance = floor(profiles, |k| data.regret_table(k), |k| seen.costs(k));
        covered = coverage(&errors).filter(|_| partition.by_machine);
    }
    let cpu_models: BTreeSet<&str> = profiles.iter().map(Profile::cpu_model).collect();
    if partition.by_machine && cpu_models.len() == 1 {
        notes.push(
            "all hosts are of one CPU model: this says little about other models; add reports of machines with \
             another CPU"
                .to_owned(),
        );
    }
    let validation = Validation {
        held_out: partition.held_out.clone(),
        physical_machines: machines(profiles).len(),
        cpu_models: cpu_models.len(),
        profiles: profiles.len(),
        methods: scores::scores(&all, partition.by_machine),
        floor: chance,
        coverage: covered,
    };
    let regrets = scores::regrets_of_units(&all, partition.by_machine);
    Ok(Validated { validation, notes, held_out: HeldOut { regrets, crossovers } })
}

/// The results on one fold.
#[derive(Default)]
struct Found {
    judged: Vec<Judged>,
    errors: Vec<Errors>,
    crossovers: Vec<HeldOutCrossover>,
    notes: Vec<String>,
}

/// Judges every strategy on some of the profiles of a fold, as fitted without it.
///
/// # Errors
/// When a regression fails.
fn held_out(data: &Material<'_>, seen: &Seen<'_>, fitted: &Fitted<'_>, judged: &[usize]) -> Result<Found> {
    let mut found = Found { notes: fitted.notes.clone(), ..Found::default() };
    for &held in judged {
        let (profile, table) = data.judged(held, fitted);
        if profile.algorithms.len() < data.profiles[held].algorithms.len() {
            found.notes.push(format!("{} is judged without its GPU: no other host has a real one", profile.file));
        }
        let ours = fitted.predict(profile, &mut found.notes);
        let available = profile.available();
        let contestants = fitted.contestants(data, held, ours.as_ref(), &available)?;
        let costs = ours.as_ref().map(|o| &o.whole[..]);
        let own = seen.costs(held).iter().filter(|c| available.contains(&c.algorithm));
        let measured = MeasuredCrossovers::of_scenarios(profile, &own.cloned().collect::<Vec<_>>());
        if let Some(costs) = costs {
            for own in &measured {
                let (file, scenario) = (&profile.file, &own.scenario);
                let crossover =
                    |compared| HeldOutCrossover { file: file.clone(), scenario: scenario.clone(), compared };
                found.crossovers.extend(own.predicted(costs).into_iter().map(crossover));
            }
        }
        let means = RegretTable::by_means(profile);
        let judge = |contestant: Contestant<'_>| Judged {
            name: contestant.name,
            file: profile.file.clone(),
            machine: profile.machine().to_owned(),
            several_threads: profile.has_threads(),
            regret: table.regret(profile, &contestant.choose),
            unseen: None,
            by_means: Some(means.regret(profile, &contestant.choose)),
            crossings: contestant.costs.map(|costs| measured.iter().flat_map(|m| m.errors(&costs)).collect()),
        };
        found.judged.extend(contestants.into_iter().map(judge));
        found.errors.push(Errors::of(profile, costs.unwrap_or_default()));
    }
    Ok(found)
}

/// Returns the regret of each strategy on each judged profile when each scenario in turn was held out too.
///
/// # Errors
/// As [`held_out`].
fn unseen(
    data: &Material<'_>,
    partition: &Partition,
    judged: &(dyn Fn(&Vec<usize>) -> Vec<usize> + Sync),
    progress: &dyn Progress,
) -> Result<BTreeMap<(String, &'static str), Regret>> {
    let scenarios: BTreeSet<&str> = data.profiles.iter().flat_map(Profile::scenarios).collect();
    if scenarios.len() < 2 {
        return Ok(BTreeMap::new());
    }
    let step = (partition.folds.len() * scenarios.len()).div_ceil(MOST_UNSEEN);
    let of_scenario = |(turn, scenario): (usize, &&str)| -> Result<Vec<((String, &'static str), Regret)>> {
        let designs = Designs::without(data.profiles, Some(scenario));
        let seen = Seen::new(Some(scenario), &designs);
        let one = |fold: &Vec<usize>| -> Result<Vec<((String, &'static str), Regret)>> {
            progress.check()?;
            let has = |k: &usize| data.profiles[*k].scenarios().any(|s| s == *scenario);
            let held: Vec<usize> = judged(fold).into_iter().filter(has).collect();
            if held.is_empty() {
                return Ok(Vec::new());
            }
            let fitted = data.fit(fold, &seen)?;
            let mut regrets = Vec::new();
            for k in held {
                let (profile, table) = data.judged(k, &fitted);
                let ours = fitted.predict(profile, &mut Vec::new());
                let available = profile.available();
                for c in fitted.contestants(data, k, ours.as_ref(), &available)? {
                    let regret = table.regret_in(Some(scenario), profile, &c.choose);
                    regrets.push(((profile.file.clone(), c.name), regret));
                }
            }
            Ok(regrets)
        };
        let folds: Vec<&Vec<usize>> = partition.folds.iter().skip(turn % step).step_by(step).collect();
        Ok(folds.into_par_iter().map(one).collect::<Result<Vec<_>>>()?.concat())
    };
    let scenarios: Vec<&str> = scenarios.into_iter().collect();
    let mut all: BTreeMap<(String, &'static str), Regret> = BTreeMap::new();
    let found = scenarios.par_iter().enumerate().map(of_scenario).collect::<Result<Vec<_>>>()?;
    for (key, regret) in found.into_iter().flatten() {
        let before = all.remove(&key).unwrap_or_default();
        all.insert(key, before.and(regret));
    }
    Ok(all)
}

#[cfg(test)]
mod reference;
#[cfg(test)]
mod tests;
