use super::super::synthetic::Machine;
use super::*;
use crate::simulate;
use sapwise::Hardware;
use sapwise::hardware::ParameterId;

fn simulated(machines: usize) -> Vec<Profile> {
    let loads = simulate::Loads::of_a_sweep(1, Some(30_000)).unwrap();
    let reports = simulate::simulate(&simulate::built_in().unwrap(), machines, &loads, 1).unwrap();
    reports.into_iter().map(|(file, report)| Profile::of(&file, &report)).collect()
}

#[test]
fn what_the_timings_were_made_of_is_linked_and_what_they_were_not_is_not() {
    let found = importance(&simulated(12)).unwrap();
    let of = |name: &str| found.parameters.iter().find(|p| p.parameter == name).unwrap();
    let fork_join = of(ParameterId::ForkJoinColdNs);
    for border in fork_join.borders.iter().filter(|b| b.border.ends_with("on all threads")) {
        assert_eq!(border.error_rise_octaves.verdict, Verdict::Linked, "{border:#?}");
    }
    // It is nothing to two methods on one thread.
    for border in fork_join.borders.iter().filter(|b| !b.border.contains("all threads") && !b.border.contains("GPU")) {
        assert_eq!(border.permuted_moves_octaves.unwrap().high, 0.0, "{border:#?}");
    }
    let memory = of(ParameterId::MemoryBytes);
    assert!(memory.deviation_octaves > 0.3, "{memory:?}");
    let effects = memory.borders.iter().map(|b| &b.error_rise_octaves).chain([&memory.regret_rise]);
    effects.for_each(|e| assert_eq!(e.verdict, Verdict::NotLinked, "{e:?}"));
}

#[test]
fn of_four_machines_nothing_is_told() {
    let four: Vec<Profile> = Machine::family()[..4].iter().map(|m| Profile::of(m.name, &m.report())).collect();
    let found = importance(&four).unwrap();
    assert!(found.mean_regret.is_none() && found.notes[0].contains("4 physical machines"), "{:?}", found.notes);
    assert_eq!(found.parameters.len(), Figure::ALL.len());
    for p in &found.parameters {
        assert_eq!((p.regret_rise.verdict, p.regret_rise.permuted), (Verdict::CannotBeTold, None));
    }
    assert!(found.page(crate::table::columns).contains("cannot be told from these machines"));
}

/// A parameter that a scale reads and that stands in no list would go unexamined.
#[test]
fn every_parameter_that_a_cost_depends_on_is_looked_at() {
    let profiles = simulated(12);
    let designs = Designs::new(&profiles);
    let model = model(&profiles, &designs, &vec![true; profiles.len()], "all").unwrap().0;
    let costs = |profile: &Profile, hardware: &Hardware| format!("{:?}", Judge::new(profile).outcome(&model, hardware));
    let looked_at: Vec<String> = Figure::ALL.into_iter().map(Figure::name).collect();
    for profile in &profiles {
        let hardware = &profile.hardware;
        let before = costs(profile, hardware);
        for p in 0..hardware.parameters.len() {
            let mut other = hardware.clone();
            let name = other.parameters[p].name.clone();
            other.parameters[p].value = other.parameters[p].value.map(|v| v * 1.7);
            // Where the latency between cores is missing, the warm fork and join stands for it.
            let known = looked_at.contains(&name) || name == ParameterId::ForkJoinWarmNs;
            assert!(known || costs(profile, &other) == before, "{name}");
        }
    }
}
