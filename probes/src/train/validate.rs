//! How well each way to choose does on machines that it was not trained on.

use super::baselines::{self, Chooser, available, average, by_costs, regrets};
use super::curve::measured_costs;
use super::direct::{Crossings, direct};
use super::model::model;
use super::rows::Profile;
use crate::progress::Progress;
use anyhow::Result;
use sapwise::model::{MethodModel, MethodScore, Validation};
use sapwise::{AlgorithmId, Model};

/// The way that scores are given relative to.
const SINGLE_BEST: &str = "single best";

/// Regrets of one way to choose: for each held-out report, at each of its points.
struct Regrets {
    name: &'static str,
    reports: Vec<Vec<f64>>,
}

/// Leaves out each physical machine with all its profiles, or each profile where there is one machine only, fits to the others
/// and lets every way choose on what was left out. Also sentences on what the scores do not say.
///
/// With one profile no method is scored. Each held-out profile is a step of `progress`.
///
/// # Errors
/// When a regression fails.
pub(crate) fn validate(profiles: &[Profile], progress: &Progress) -> Result<(Validation, Vec<String>)> {
    let machine = |p: &Profile| p.report.hardware.machine.physical_id.clone();
    let mut machines: Vec<String> = Vec::new();
    for profile in profiles {
        if !machines.contains(&machine(profile)) {
            machines.push(machine(profile));
        }
    }
    let by_machine = machines.len() >= 2;
    let mut notes = Vec::new();
    let mut all: Vec<Regrets> = Vec::new();
    if profiles.len() < 2 {
        notes.push("nothing is validated: there is one report only; add reports of other machines".to_owned());
    } else {
        if !by_machine {
            notes.push(
                "validated by leaving out profiles of one physical machine: this says little about machines never seen; add \
                 reports of other machines"
                    .to_owned(),
            );
        }
        notes.push("the full sweep is judged by the timings that it was fitted to".to_owned());
        let crossings: Vec<Crossings<'_>> = profiles.iter().map(Crossings::new).collect();
        for k in 0..profiles.len() {
            let training: Vec<usize> = (0..profiles.len())
                .filter(|&o| if by_machine { machine(&profiles[o]) != machine(&profiles[k]) } else { o != k })
                .collect();
            held_out(profiles, &crossings, k, &training, &mut all, &mut notes)?;
            progress.advance(1);
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
        held_out: if by_machine { "physical machine" } else { "profile" }.to_owned(),
        physical_machines: machines.len(),
        profiles: profiles.len(),
        methods: scores(&all),
    };
    Ok((validation, notes))
}

/// Adds the regrets on one held-out profile of every way, trained on the profiles of `training`.
fn held_out(
    profiles: &[Profile],
    crossings: &[Crossings<'_>],
    held: usize,
    training: &[usize],
    all: &mut Vec<Regrets>,
    notes: &mut Vec<String>,
) -> Result<()> {
    let profile = &profiles[held];
    let hardware = &profile.report.hardware;
    let known: Vec<&Profile> = training.iter().map(|&k| &profiles[k]).collect();
    let crossings: Vec<&Crossings<'_>> = training.iter().map(|&k| &crossings[k]).collect();
    let available = available(profile);
    let (ridge, physics) = match model(&known, "validation") {
        Ok((model, _)) => {
            let bare = |m: &MethodModel| MethodModel { residual: Vec::new(), residual_intercept: 0.0, ..m.clone() };
            let physics = Model { methods: model.methods.iter().map(bare).collect(), ..model.clone() };
            (predicted(&model, profile, &available, notes), predicted(&physics, profile, &available, notes))
        }
        Err(why) => {
            notes.push(format!("no model could be fitted when {} was left out: {why:#}", profile.file));
            (nothing(), nothing())
        }
    };
    let default_machine = baselines::default_machine(&known, &available).unwrap_or_else(|why| {
        notes.push(format!("there is no default machine when {} is left out: {why:#}", profile.file));
        nothing()
    });
    let ways = [
        ("physics + ridge", ridge),
        ("physics", physics),
        ("direct regression", direct(&crossings, hardware, &available, notes)?),
        (SINGLE_BEST, baselines::single_best(&known, &available)),
        ("frozen constants (64)", baselines::frozen(64, "strips", &available)),
        ("frozen constants (1000)", baselines::frozen(999, "sweep", &available)),
        ("default machine", default_machine),
        ("nearest machine", baselines::nearest_machine(&known, hardware, &available)),
        ("full sweep", by_costs(measured_costs(&profile.report).0, &available)),
    ];
    for (name, choose) in ways {
        let regrets = regrets(profile, &choose);
        match all.iter_mut().find(|r| r.name == name) {
            Some(same) => same.reports.push(regrets),
            None => all.push(Regrets { name, reports: vec![regrets] }),
        }
    }
    Ok(())
}

/// The choice of a model; nothing is chosen, which counts as the worst, where it predicts none of the algorithms.
fn predicted<'a>(model: &Model, profile: &Profile, available: &'a [AlgorithmId], notes: &mut Vec<String>) -> Chooser<'a> {
    let revision = |id: &AlgorithmId| profile.report.algorithms.iter().find(|t| t.id == *id).map_or(0, |t| t.revision);
    let wanted: Vec<(AlgorithmId, u32)> = available.iter().map(|id| (id.clone(), revision(id))).collect();
    match model.predict(&profile.report.hardware, &wanted) {
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

fn scores(all: &[Regrets]) -> Vec<MethodScore> {
    let means = |r: &Regrets| r.reports.iter().map(|r| average(r)).collect::<Vec<f64>>();
    let single = all.iter().find(|r| r.name == SINGLE_BEST).map_or(0.0, |r| average(&means(r)));
    let score = |r: &Regrets| {
        let mut means = means(r);
        let mean_regret = average(&means);
        means.sort_by(f64::total_cmp);
        let points: Vec<f64> = r.reports.iter().flatten().copied().collect();
        let over = points.iter().filter(|r| **r > 0.1).count();
        MethodScore {
            name: r.name.to_owned(),
            mean_regret,
            p95_regret: means[((means.len() as f64 * 0.95).ceil() as usize).clamp(1, means.len()) - 1],
            share_over_10_percent: over as f64 / points.len().max(1) as f64,
            // The oracle has no regret. Where the single best has none either there is no gap to close.
            closed_gap: if single > 0.0 { (single - mean_regret) / single } else { 0.0 },
        }
    };
    all.iter().filter(|r| !r.reports.is_empty()).map(score).collect()
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::Machine;
    use super::*;
    use crate::simulate;

    fn profiles(machines: Vec<Machine>) -> Vec<Profile> {
        machines.into_iter().map(|m| Profile { file: format!("{}.json", m.name), report: m.report() }).collect()
    }

    fn mean(validation: &Validation, name: &str) -> f64 {
        validation.methods.iter().find(|m| m.name == name).unwrap().mean_regret
    }

    #[test]
    fn physics_beats_every_constant_on_machines_left_out() {
        let (validation, _) = validate(&profiles(Machine::family()), &Progress::new(0)).unwrap();
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
        let profiles: Vec<Profile> = reports.into_iter().map(|(file, report)| Profile { file, report }).collect();
        let (validation, notes) = validate(&profiles, &Progress::new(0)).unwrap();
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
        let (validation, notes) = validate(&profiles(machines), &Progress::new(0)).unwrap();
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
        two[0].report.points.truncate(1);
        let (validation, notes) = validate(&two, &Progress::new(0)).unwrap();
        assert_eq!(validation.methods.len(), 9);
        assert!(notes.iter().any(|n| n.starts_with("there is no default machine when")), "{notes:?}");
    }

    #[test]
    fn profiles_of_one_machine_are_left_out_together() {
        let mut twins = Machine::family();
        twins.truncate(3);
        twins[1].name = twins[0].name;
        let (validation, _) = validate(&profiles(twins), &Progress::new(0)).unwrap();
        assert_eq!((validation.physical_machines, validation.profiles), (2, 3));
    }

    #[test]
    fn one_machine_is_told_and_one_profile_gives_no_scores() {
        let mut twins = Machine::family();
        twins.truncate(2);
        twins[1].name = twins[0].name;
        let (validation, notes) = validate(&profiles(twins.clone()), &Progress::new(0)).unwrap();
        assert!(validation.held_out == "profile" && notes.iter().any(|n| n.contains("little about machines never seen")));
        twins.truncate(1);
        let (validation, notes) = validate(&profiles(twins), &Progress::new(0)).unwrap();
        assert!(validation.methods.is_empty() && notes[0].contains("one report only"));
    }
}
