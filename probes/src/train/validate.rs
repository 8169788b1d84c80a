//! How well each way to choose does on machines that it was not trained on.

use super::baselines::{self, available, by_costs};
use super::curve::measured_costs;
use super::direct::direct;
use super::fit::Designs;
use super::model::model;
use super::partition::Partition;
use super::profile::Profile;
use super::yardstick::{Chooser, Regret, Yardstick, average};
use crate::progress::Progress;
use anyhow::Result;
use rayon::prelude::*;
use sapwise::model::{MethodModel, MethodScore, Validation};
use sapwise::{AlgorithmId, Model};

/// The way that scores are given relative to.
const SINGLE_BEST: &str = "single best";
/// Profiles of a fold that are judged at most: scores of several hundred machines don't change with thousands more.
const MOST_JUDGED: usize = 40;

/// Regrets of one way to choose on one held-out profile.
struct Judged {
    name: &'static str,
    regret: Regret,
}

/// Leaves out one fold of a [`Partition`] after the other, fits to the others and lets every way choose on what was left out. Also
/// sentences on what the scores do not say.
///
/// With one profile no method is scored. Each held-out profile is a step of `progress`.
///
/// # Errors
/// When a regression fails.
pub(crate) fn validate(
    profiles: &[Profile],
    designs: &Designs<'_>,
    progress: &Progress,
) -> Result<(Validation, Vec<String>)> {
    let partition = Partition::new(profiles);
    let mut machines: Vec<&str> = profiles.iter().map(Profile::machine).collect();
    machines.sort_unstable();
    machines.dedup();
    let mut notes = Vec::new();
    let mut all: Vec<Judged> = Vec::new();
    if profiles.len() < 2 {
        notes.push("nothing is validated: there is one report only; add reports of other machines".to_owned());
    } else {
        if !partition.by_machine {
            notes.push(
                "validated by leaving out profiles of one physical machine: this says little about machines never seen; add \
                 reports of other machines"
                    .to_owned(),
            );
        }
        notes.push("the full sweep is judged by the timings that it was fitted to".to_owned());
        let yardsticks: Vec<Yardstick> = profiles.par_iter().map(Yardstick::new).collect();
        let always: Vec<Vec<f64>> = yardsticks.par_iter().map(Yardstick::always).collect();
        let data = Data { profiles, designs, yardsticks, always };
        let judged = partition.folds.par_iter().map(|fold| data.fold(fold, progress));
        for (fold, told) in judged.collect::<Result<Vec<_>>>()? {
            all.extend(fold);
            notes.extend(told);
        }
    }
    let mut unique: Vec<String> = Vec::new();
    notes.retain(|n| {
        !unique.contains(n) && {
            unique.push(n.clone());
            true
        }
    });
    let validation = Validation {
        held_out: partition.held_out,
        physical_machines: machines.len(),
        profiles: profiles.len(),
        methods: scores(&all),
    };
    Ok((validation, notes))
}

/// What all folds share.
struct Data<'a> {
    profiles: &'a [Profile],
    designs: &'a Designs<'a>,
    yardsticks: Vec<Yardstick>,
    /// Mean regret of each algorithm of each profile when it is chosen always.
    always: Vec<Vec<f64>>,
}

impl Data<'_> {
    /// The regrets on the profiles of a fold of every way, trained on the others.
    fn fold(&self, fold: &[usize], progress: &Progress) -> Result<(Vec<Judged>, Vec<String>)> {
        let mut notes = Vec::new();
        let mut chosen = vec![true; self.profiles.len()];
        fold.iter().for_each(|&k| chosen[k] = false);
        let known: Vec<usize> = (0..self.profiles.len()).filter(|&k| chosen[k]).collect();
        let models = match model(self.profiles, self.designs, &chosen, "validation") {
            Ok((model, _)) => {
                let bare = |m: &MethodModel| MethodModel { residual: Vec::new(), residual_intercept: 0.0, ..m.clone() };
                let physics = Model { methods: model.methods.iter().map(bare).collect(), ..model.clone() };
                Some((model, physics))
            }
            Err(why) => {
                notes.push(format!("no model could be fitted when {} was left out: {why:#}", self.profiles[fold[0]].file));
                None
            }
        };
        let mut judged = Vec::new();
        // Evenly over the fold, in which the profiles of a machine stand together.
        for &held in fold.iter().step_by(fold.len().div_ceil(MOST_JUDGED)) {
            judged.extend(self.held_out(held, &known, models.as_ref(), &mut notes)?);
            progress.advance(1);
        }
        Ok((judged, notes))
    }

    fn held_out(
        &self,
        held: usize,
        known: &[usize],
        models: Option<&(Model, Model)>,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Judged>> {
        let profile = &self.profiles[held];
        let training: Vec<&Profile> = known.iter().map(|&k| &self.profiles[k]).collect();
        let always: Vec<(&Profile, &[f64])> = known.iter().map(|&k| (&self.profiles[k], &self.always[k][..])).collect();
        let available = available(profile);
        let (ridge, physics) = match models {
            Some((ridge, physics)) => {
                (predicted(ridge, profile, &available, notes), predicted(physics, profile, &available, notes))
            }
            None => (nothing(), nothing()),
        };
        let default_machine = baselines::default_machine(&training, &available).unwrap_or_else(|why| {
            notes.push(format!("there is no default machine when {} is left out: {why:#}", profile.file));
            nothing()
        });
        let ways = [
            ("physics + ridge", ridge),
            ("physics", physics),
            ("direct regression", direct(&training, &profile.hardware, &available, notes)?),
            (SINGLE_BEST, baselines::single_best(&always, &available)),
            ("frozen constants (64)", baselines::frozen(64, "strips", &available)),
            ("frozen constants (1000)", baselines::frozen(999, "sweep", &available)),
            ("default machine", default_machine),
            ("nearest machine", baselines::nearest_machine(&training, &profile.hardware, &available)),
            ("full sweep", by_costs(measured_costs(profile).0, &available)),
        ];
        let regret = |choose: &Chooser<'_>| self.yardsticks[held].regret(profile, choose);
        Ok(ways.iter().map(|(name, choose)| Judged { name, regret: regret(choose) }).collect())
    }
}

/// The choice of a model; nothing is chosen, which counts as the worst, where it predicts none of the algorithms.
fn predicted<'a>(model: &Model, profile: &Profile, available: &'a [AlgorithmId], notes: &mut Vec<String>) -> Chooser<'a> {
    let revision = |id: &AlgorithmId| profile.algorithms.iter().find(|t| t.id == *id).map_or(0, |t| t.revision);
    let wanted: Vec<(AlgorithmId, u32)> = available.iter().map(|id| (id.clone(), revision(id))).collect();
    match model.predict(&profile.hardware, &wanted) {
        Ok(prediction) => by_costs(prediction.costs, available),
        Err(why) => {
            notes.push(format!("{} could not be predicted when it was left out: {why}", profile.file));
            nothing()
        }
    }
}

/// Chooses nothing, which counts as the worst.
fn nothing<'a>() -> Chooser<'a> {
    Box::new(|_| None)
}

fn scores(all: &[Judged]) -> Vec<MethodScore> {
    let mut names: Vec<&str> = Vec::new();
    all.iter().for_each(|j| {
        if !names.contains(&j.name) {
            names.push(j.name);
        }
    });
    let of = |name: &str| all.iter().filter(|j| j.name == name).map(|j| &j.regret).collect::<Vec<&Regret>>();
    let mean =
        |regrets: &[&Regret], of: &dyn Fn(&Regret) -> f64| average(&regrets.iter().map(|r| of(r)).collect::<Vec<_>>());
    let single = mean(&of(SINGLE_BEST), &|r| r.mean);
    let score = |name: &str| {
        let regrets = of(name);
        let mut means: Vec<f64> = regrets.iter().map(|r| r.mean).collect();
        let mean_regret = average(&means);
        means.sort_by(f64::total_cmp);
        let cells: Vec<f64> = regrets.iter().flat_map(|r| &r.cells).copied().collect();
        let over = cells.iter().filter(|r| **r > 0.1).count();
        MethodScore {
            name: name.to_owned(),
            mean_regret,
            p95_regret: means[((means.len() as f64 * 0.95).ceil() as usize).clamp(1, means.len()) - 1],
            share_over_10_percent: over as f64 / cells.len().max(1) as f64,
            // The oracle has no regret. Where the single best has none either there is no gap to close.
            closed_gap: if single > 0.0 { (single - mean_regret) / single } else { 0.0 },
            mean_regret_in_games: Some(mean(&regrets, &|r| r.as_in_games)),
        }
    };
    names.into_iter().map(score).collect()
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::Machine;
    use super::*;
    use crate::simulate;

    fn profiles(machines: Vec<Machine>) -> Vec<Profile> {
        machines.into_iter().map(|m| Profile::of(&format!("{}.json", m.name), &m.report())).collect()
    }

    fn validated(profiles: &[Profile]) -> (Validation, Vec<String>) {
        validate(profiles, &Designs::new(profiles), &Progress::new(0)).unwrap()
    }

    fn mean(validation: &Validation, name: &str) -> f64 {
        validation.methods.iter().find(|m| m.name == name).unwrap().mean_regret
    }

    #[test]
    fn physics_beats_every_constant_on_machines_left_out() {
        let (validation, _) = validated(&profiles(Machine::family()));
        assert_eq!((validation.physical_machines, validation.profiles, validation.methods.len()), (7, 7, 9));
        assert_eq!(validation.held_out, "physical machine");
        for name in ["physics", "physics + ridge", "full sweep"] {
            assert!(mean(&validation, name) < 0.05, "{name}: {}", mean(&validation, name));
            for constant in [SINGLE_BEST, "frozen constants (64)", "frozen constants (1000)", "default machine"] {
                assert!(mean(&validation, name) < mean(&validation, constant), "{name} {constant}");
            }
        }
        for m in &validation.methods {
            assert!(m.mean_regret >= 0.0 && m.p95_regret >= m.mean_regret && m.closed_gap <= 1.0, "{m:?}");
        }
    }

    #[test]
    fn a_dozen_simulated_machines_predict_those_left_out_better_than_the_nearest_one_does() {
        let loads = simulate::Loads::of_a_sweep(1, Some(30_000)).unwrap();
        let reports = simulate::simulate(&simulate::built_in().unwrap(), 12, &loads, 1).unwrap();
        let profiles: Vec<Profile> = reports.into_iter().map(|(file, report)| Profile::of(&file, &report)).collect();
        let (validation, notes) = validated(&profiles);
        assert_eq!((validation.physical_machines, validation.held_out.as_str()), (12, "physical machine"));
        assert!(validation.methods.iter().all(|m| m.mean_regret.is_finite() && m.mean_regret >= 0.0), "{validation:?}");
        for other in ["nearest machine", SINGLE_BEST, "default machine"] {
            assert!(mean(&validation, "physics + ridge") < mean(&validation, other), "{other} {validation:#?} {notes:?}");
        }
        // Their truth is no sum of the predictor's terms: one that is always right has seen it.
        assert!(mean(&validation, "physics + ridge") > 0.005, "{validation:#?}");
    }

    #[test]
    fn machines_with_and_without_gpus_are_validated_together() {
        let mut machines = Machine::family_with_gpus();
        machines[6].gpus.clear();
        let (validation, notes) = validated(&profiles(machines));
        assert_eq!((validation.physical_machines, validation.methods.len()), (8, 9));
        for name in ["physics", "physics + ridge", "full sweep"] {
            assert!(mean(&validation, name) < 0.1, "{name}: {} {notes:?}", mean(&validation, name));
        }
        assert!(mean(&validation, "physics") < mean(&validation, SINGLE_BEST));
    }

    #[test]
    fn a_weak_profile_costs_its_folds_and_not_the_validation() {
        let mut two = profiles(Machine::family());
        two.truncate(2);
        two[0].points.truncate(1);
        let (validation, notes) = validated(&two);
        assert_eq!(validation.methods.len(), 9);
        assert!(notes.iter().any(|n| n.starts_with("there is no default machine when")), "{notes:?}");
    }

    #[test]
    fn profiles_of_one_machine_are_left_out_together() {
        let mut twins = Machine::family();
        twins.truncate(3);
        twins[1].name = twins[0].name;
        let (validation, _) = validated(&profiles(twins));
        assert_eq!((validation.physical_machines, validation.profiles), (2, 3));
    }

    #[test]
    fn one_machine_is_told_and_one_profile_gives_no_scores() {
        let mut twins = Machine::family();
        twins.truncate(2);
        twins[1].name = twins[0].name;
        let (validation, notes) = validated(&profiles(twins.clone()));
        assert!(
            validation.held_out.starts_with("SIMD level")
                && notes.iter().any(|n| n.contains("little about machines never seen"))
        );
        twins.truncate(1);
        let (validation, notes) = validated(&profiles(twins));
        assert!(validation.methods.is_empty() && notes[0].contains("one report only"));
    }
}
