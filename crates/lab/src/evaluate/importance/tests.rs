use super::*;
use crate::progress::Silent;
use crate::synthetic::Machine;
use sapwise::Hardware;
use sapwise::hardware::ParameterId;

fn family() -> Vec<Profile> {
    Machine::family_with_gpus().iter().map(|m| Profile::of(m.name, &m.report())).collect()
}

#[test]
fn what_the_timings_were_made_of_is_linked_and_what_they_were_not_is_not() {
    let found = importance(&family(), &Silent).unwrap();
    let of = |name: &str| found.parameters.iter().find(|p| p.parameter == name).unwrap();
    let of_gpus = of("gpu/upload_rate_gb_per_s");
    // What GPUs do is nothing to the CPU.
    for (method, effect) in of_gpus.distance_rise_ln.iter().filter(|(method, _)| method.ends_with("CPU")) {
        assert_eq!(effect.rise.map_or(0.0, |i| i.high), 0.0, "{method} {effect:?}");
    }
    let linked = |p: &OfParameter| p.distance_rise_ln.values().filter(|e| e.verdict == Verdict::Linked).count();
    let told = [ParameterId::ClockMeasuredGhz, ParameterId::SimdLanes, ParameterId::ScalingAllThreadsRatio];
    let links: Vec<usize> = told.iter().map(|id| linked(of(id.as_str()))).collect();
    assert!(links.iter().sum::<usize>() > 0, "{links:?}");
}

#[test]
fn of_four_machines_nothing_is_told() {
    let four: Vec<Profile> = Machine::family()[..4].iter().map(|m| Profile::of(m.name, &m.report())).collect();
    let found = importance(&four, &Silent).unwrap();
    assert!(found.mean_regret.is_none() && found.notes[0].contains("4 physical machines"), "{:?}", found.notes);
    assert!(found.parameters.is_empty() && found.page(crate::text::columns).contains("nothing is told"));
}

/// A parameter that a scale reads and that stands in no list would go unexamined.
#[test]
fn every_parameter_that_a_cost_depends_on_is_looked_at() {
    let profiles = family();
    let designs = Designs::new(&profiles);
    let model = model(&profiles, &designs, TrainingSet::of(&vec![true; profiles.len()]), "all").unwrap().0;
    let costs = |profile: &Profile, hardware: &Hardware| {
        format!("{:?}", model.predict(hardware, &profile.with_revisions(&profile.available())).map(|p| p.costs))
    };
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
