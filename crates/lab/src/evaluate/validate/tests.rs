use super::*;
use crate::evaluate::scores::RUNNING;
use crate::evaluate::{OURS, SINGLE_BEST};
use crate::progress::Silent;
use crate::synthetic::{Machine, profiles};
use sapwise::AlgorithmId;
use sapwise::algorithm::BackendClass;
use sapwise_tune::GpuKind;

fn validated(profiles: &[Profile]) -> (Validation, Vec<String>) {
    let partition = Partition::new(profiles);
    let found = validate(profiles, &Designs::new(profiles), &partition, &Silent).unwrap();
    (found.validation, found.notes)
}

fn mean(validation: &Validation, name: &str) -> f64 {
    validation.methods.iter().find(|m| m.name == name).unwrap().mean_regret
}

#[test]
fn physics_beats_every_constant_and_near_crossovers_on_machines_held_out() {
    let (validation, _) = validated(&profiles(Machine::family()));
    assert_eq!((validation.physical_machines, validation.profiles, validation.methods.len()), (7, 7, 10));
    assert_eq!(validation.held_out, "physical machine");
    for name in ["physics", OURS, RUNNING, "full sweep"] {
        assert!(mean(&validation, name) < 0.05, "{name}: {}", mean(&validation, name));
        for constant in [SINGLE_BEST, "frozen constants (64)", "frozen constants (1000)"] {
            assert!(mean(&validation, name) < mean(&validation, constant), "{name} {constant}");
        }
    }
    for m in &validation.methods {
        let [least, largest] = m.regret_range().unwrap();
        assert!(m.mean_regret >= 0.0, "{m:?}");
        assert!(least <= m.mean_regret + 1e-12 && largest >= m.mean_regret - 1e-12, "{m:?}");
    }
    // Crossovers are judged for strategies that predict costs.
    let of = |name: &str| {
        let score = validation.methods.iter().find(|m| m.name == name).unwrap();
        score.crossing_error_octaves.zip(score.crossings_within_half_octave)
    };
    let (error, within) = of(OURS).unwrap();
    assert!(error < 0.5 && within > 0.5, "{validation:#?}");
    assert!(of("nearest machine").unwrap().0 > error, "{validation:#?}");
    assert_eq!((of("random forest"), of("full sweep")), (None, None));
}

#[test]
fn the_score_counts_a_machine_once_however_many_profiles_it_has() {
    let family = Machine::family();
    let mut many = vec![family[0].clone(); 5];
    many.extend_from_slice(&family[1..4]);
    let (few, many) = (validated(&profiles(family[..4].to_vec())).0, validated(&profiles(many)).0);
    assert_eq!((many.physical_machines, many.profiles), (4, 8));
    // The repeated profiles are held out together, so that no fit sees its own machine.
    for (a, b) in few.methods.iter().zip(&many.methods).filter(|(a, _)| a.name == "full sweep" || a.name == OURS) {
        assert!((a.mean_regret - b.mean_regret).abs() < 1e-3, "{a:?} {b:?}");
    }
}

#[test]
fn machines_with_and_without_gpus_are_validated_together() {
    let mut machines = Machine::family_with_gpus();
    machines[6].gpus.clear();
    let (validation, notes) = validated(&profiles(machines));
    assert_eq!((validation.physical_machines, validation.methods.len()), (8, 10));
    for name in ["physics", OURS, "full sweep"] {
        assert!(mean(&validation, name) < 0.1, "{name}: {} {notes:?}", mean(&validation, name));
    }
    assert!(mean(&validation, "physics") < mean(&validation, SINGLE_BEST));
}

#[test]
fn a_real_gpu_is_judged_only_if_the_training_has_one() {
    let mut machines = Machine::family_with_gpus();
    machines.truncate(4);
    let judged = |machines: &[Machine]| {
        let all = profiles(machines.iter().cloned());
        let found = validate(&all, &Designs::new(&all), &Partition::new(&all), &Silent).unwrap();
        let on_gpu = |id: &AlgorithmId| id.backend().class() == BackendClass::Gpu;
        let crossed =
            found.held_out.crossovers.iter().filter(|c| on_gpu(&c.compared.below) || on_gpu(&c.compared.above));
        let files: BTreeSet<String> = crossed.map(|c| c.file.clone()).collect();
        let told = found.notes.iter().filter(|n| n.contains("is judged without its GPU")).count();
        (files.len(), told, mean(&found.validation, OURS), found.validation.coverage.unwrap())
    };
    let (files, told, ..) = judged(&machines);
    assert!(files > 1 && told == 0, "{files} {told}");
    machines[3].gpus.clear();
    machines[0].gpus.clear();
    // The other one has a software adapter.
    machines[1].gpus.iter_mut().for_each(|gpu| gpu.kind = GpuKind::Software);
    let (files, told, regret, coverage) = judged(&machines);
    // The one with the adapter is judged by a model of the real GPU.
    assert!(files <= 1 && told == 1 && regret < 0.1, "{files} {told} {regret}");
    machines.iter_mut().for_each(|m| m.gpus.clear());
    assert!((judged(&machines).3.times_90_ln - coverage.times_90_ln).abs() < 0.1, "{coverage:?}");
}

#[test]
fn a_weak_profile_costs_its_folds_and_not_the_validation() {
    let mut two = profiles(Machine::family());
    two.truncate(2);
    two[0].points.truncate(1);
    let (validation, notes) = validated(&two);
    assert_eq!(validation.methods.len(), 10, "{notes:?}");
}

#[test]
fn one_machine_is_told_and_one_profile_has_no_scores() {
    let mut twins = Machine::family();
    twins.truncate(2);
    twins[1].name = twins[0].name;
    let (validation, notes) = validated(&profiles(twins.clone()));
    assert!(validation.held_out.starts_with("SIMD level"), "{validation:?}");
    assert!(notes.iter().any(|n| n.contains("little about machines never seen")), "{notes:?}");
    twins.truncate(1);
    let (validation, notes) = validated(&profiles(twins));
    assert!(validation.methods.is_empty() && notes[0].contains("one report only"));
}
