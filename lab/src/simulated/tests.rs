use super::*;
use crate::train::{self, Evidence, Selection, Trained};
use std::collections::BTreeSet;

fn some(machines: usize) -> Vec<(String, Report)> {
    let loads = Loads::of_a_sweep(1, Some(30_000)).unwrap();
    simulate(&built_in().unwrap(), machines, &loads, 1).unwrap()
}

#[test]
fn the_same_seed_makes_the_same_bytes_and_another_does_not() {
    let text = |seed: u64| {
        let loads = Loads::of_a_sweep(seed, Some(1000)).unwrap();
        let reports = simulate(&built_in().unwrap(), 4, &loads, seed).unwrap();
        reports.iter().map(|(name, r)| format!("{name}\n{}", sapwise::json::write_report(r).unwrap())).collect::<String>()
    };
    assert!(text(3) == text(3) && text(3) != text(4));
}

#[test]
fn every_report_is_sound_complete_and_labelled() {
    let loads = Loads::of_a_sweep(1, None).unwrap();
    let specifications = built_in().unwrap();
    let reports = simulate(&specifications, specifications.cpus.len(), &loads, 1).unwrap();
    let mut ids = BTreeSet::new();
    for (name, report) in &reports {
        assert!(name.starts_with("simulated-") && report.label == Label::Simulated, "{name}");
        let text = sapwise::json::write_report(report).unwrap();
        assert!(sapwise::json::report(&text).unwrap() == *report, "{name}");
        assert!(text.len() <= 200_000, "{name} has {} bytes", text.len());
        assert!(ids.insert(&report.hardware.machine.physical_id), "{name}");
        let names: Vec<&str> = report.hardware.parameters.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ParameterId::ALL, "{name}");
        for point in &report.points {
            let samples: Vec<usize> = point.timings.iter().map(|t| t.samples_ns.len()).collect();
            assert!(!samples.is_empty() && samples.iter().all(|&n| n == samples[0] && n >= 5), "{name}: {samples:?}");
        }
        let [first, last] = [report.points.first(), report.points.iter().find(|p| p.load.objects == 300_000)];
        let racing = |point: Option<&crate::report::Point>| point.unwrap().timings.len();
        assert!(racing(first) == report.algorithms.len() && racing(last) < racing(first), "{name}: nobody left the race");
    }
}

#[test]
fn a_model_of_simulated_machines_has_a_course_and_a_card_that_say_so() {
    let reports: Vec<(String, Report)> = some(3);
    let Trained { model, .. } = train::train(Selection::of(&reports, Evidence::Simulated), "test").unwrap();
    assert!(model.is_simulated() && model.trained_on.len() == 3);
    let learning = &model.validation.learning;
    // Two of three machines can be drawn in three ways, and each leaves the third to judge by, as validation does.
    assert_eq!(learning.iter().map(|l| (l.machines, l.trainings)).collect::<Vec<_>>(), [(2, 3)]);
    let of_all = |name: &str| model.validation.methods.iter().find(|m| m.name == name).unwrap().mean_regret;
    for score in &learning[0].methods {
        // Which machine is the default one depends on the order of the reports, and a forest on that of its rows.
        let ordered = ["default machine", "random forest"].contains(&&score.name[..]);
        assert!((score.mean_regret - of_all(&score.name)).abs() < 1e-9 || ordered, "{score:?}");
    }
    let card = crate::model_card::page(&model, &[]);
    assert!(card.contains("Trained on simulated machines") && card.contains("| 2 machines |"), "{card}");
}

#[test]
fn a_prediction_by_simulated_machines_says_so() {
    let reports = some(4);
    let model = train::train(Selection::of(&reports[..3], Evidence::Simulated), "test").unwrap().model;
    let held_out = &reports[3].1;
    let algorithms: Vec<_> = held_out.algorithms.iter().map(|t| (t.id.clone(), t.revision)).collect();
    let prediction = model.predict(&held_out.hardware, &algorithms).unwrap();
    assert!(prediction.warnings.iter().any(|w| w.contains("simulated machines")), "{:?}", prediction.warnings);
    for point in &held_out.points {
        assert!(prediction.costs.iter().all(|c| c.curve.cost_ns(&point.load).is_finite()));
    }
    assert!(!sapwise::Model::built_in().unwrap().is_simulated());
}

#[test]
fn simulated_reports_alone_are_refused_without_the_option_and_real_ones_with_it() {
    let mut reports = some(1);
    let refused = |reports: &[(String, Report)], evidence| {
        train::train(Selection::of(reports, evidence), "test").unwrap_err().to_string()
    };
    assert!(refused(&reports, Evidence::Real).contains("is simulated"));
    reports[0].1.label = Label::RealFull;
    assert!(refused(&reports, Evidence::Simulated).contains("sapwise simulate"));
}
