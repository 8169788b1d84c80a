use super::*;
use crate::data::{Evidence, Selection};
use crate::progress::Silent;
use crate::train::train;
use crate::{Trained, report};
use sapwise::Entry;
use sapwise::hardware::ParameterId;
use std::collections::BTreeSet;

fn some(machines: usize) -> Vec<(String, Report)> {
    let loads = Loads::of_a_sweep(1, Some(30_000)).unwrap();
    simulate(&built_in().unwrap(), machines, &loads, 1, &Silent).unwrap()
}

#[test]
fn the_same_seed_makes_the_same_bytes_and_another_does_not() {
    let text = |seed: u64| {
        let loads = Loads::of_a_sweep(seed, Some(1000)).unwrap();
        let reports = simulate(&built_in().unwrap(), 4, &loads, seed, &Silent).unwrap();
        reports.iter().map(|(name, r)| format!("{name}\n{}", report::write(r).unwrap())).collect::<String>()
    };
    assert!(text(3) == text(3) && text(3) != text(4));
}

#[test]
fn every_report_is_sound_complete_and_labelled() {
    let loads = Loads::of_a_sweep(1, None).unwrap();
    let specifications = built_in().unwrap();
    let reports = simulate(&specifications, specifications.cpus.len(), &loads, 1, &Silent).unwrap();
    let mut ids = BTreeSet::new();
    for (name, own) in &reports {
        assert!(name.starts_with("simulated-") && own.label == Label::Simulated, "{name}");
        let text = report::write(own).unwrap();
        assert!(report::read(&text).unwrap().value == *own, "{name}");
        assert!(text.len() <= 200_000, "{name} has {} bytes", text.len());
        assert!(ids.insert(&own.hardware.machine.physical_id), "{name}");
        let names: Vec<&str> = own.hardware.parameters.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ParameterId::ALL.map(ParameterId::as_str), "{name}");
        for point in &own.points {
            let samples: Vec<usize> = point.timings.iter().map(|t| t.samples_ns.len()).collect();
            assert!(!samples.is_empty() && samples.iter().all(|&n| n == samples[0] && n >= 5), "{name}: {samples:?}");
        }
        let [first, last] = [own.points.first(), own.points.iter().find(|p| p.load.objects == 300_000)];
        let racing = |point: Option<&report::Point>| point.unwrap().timings.len();
        assert!(racing(first) == own.algorithms.len() && racing(last) < racing(first), "{name}: nobody left the race");
    }
}

#[test]
fn a_model_of_simulated_machines_and_its_card_say_so() {
    let reports: Vec<(String, Report)> = some(3);
    let Trained { model, training, .. } = train(Selection::of(&reports, Evidence::Simulated), "test", &Silent).unwrap();
    assert!(model.simulated && training.trained_on.len() == 3);
    let card = crate::model_card::page(&model, &training, &[]);
    assert!(card.contains("Trained on simulated machines"), "{card}");
}

#[test]
fn a_prediction_by_simulated_machines_says_so() {
    let reports = some(4);
    let model = train(Selection::of(&reports[..3], Evidence::Simulated), "test", &Silent).unwrap().model;
    let held_out = &reports[3].1;
    let algorithms: Vec<_> = held_out.algorithms.iter().map(|t| Entry::new(t.id.clone(), t.revision)).collect();
    let prediction = model.predict(&held_out.hardware, &algorithms).unwrap();
    assert!(prediction.warnings.iter().any(|w| w.contains("simulated machines")), "{:?}", prediction.warnings);
    for point in &held_out.points {
        assert!(prediction.costs.iter().all(|c| c.curve.cost_ns(&point.load).is_finite()));
    }
    assert!(!sapwise::Model::built_in().unwrap().simulated);
}

#[test]
fn simulated_reports_alone_are_refused_without_the_option_and_real_ones_with_it() {
    let mut reports = some(1);
    let refused = |reports: &[(String, Report)], evidence| {
        train(Selection::of(reports, evidence), "test", &Silent).unwrap_err().to_string()
    };
    assert!(refused(&reports, Evidence::Real).contains("is simulated"));
    reports[0].1.label = Label::RealFull;
    assert!(refused(&reports, Evidence::Simulated).contains("sapwise simulate"));
}
