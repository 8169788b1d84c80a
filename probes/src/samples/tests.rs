use super::replay::{Replay, ReplayPoint};
use super::*;
use crate::simulate;
use crate::train::{self, Profile};

fn points(profile: &Profile, scenario: &str) -> Vec<ReplayPoint> {
    let within = profile.report.points.iter().filter(|p| p.scenario == scenario);
    within
        .map(|p| ReplayPoint {
            load: p.load,
            timings: train::medians(p).into_iter().map(|(id, ns)| (id.clone(), ns)).collect(),
        })
        .collect()
}

fn p95(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() as f64 * 0.95).ceil() as usize).clamp(1, sorted.len()) - 1]
}

fn evaluate(profiles: &[Profile], label: &str) {
    let one =
        profiles.iter().all(|p| p.report.hardware.machine.physical_id == profiles[0].report.hardware.machine.physical_id);
    let machine = |p: &Profile| if one { p.file.clone() } else { p.report.hardware.machine.physical_id.clone() };
    let predictions: Vec<_> = profiles
        .iter()
        .map(|held| {
            let known: Vec<&Profile> = profiles.iter().filter(|p| machine(p) != machine(held)).collect();
            let model = train::model(&known, "x").unwrap().0;
            let available = train::available(held);
            let wanted: Vec<_> = available
                .iter()
                .map(|id| (id.clone(), held.report.algorithms.iter().find(|t| t.id == *id).unwrap().revision))
                .collect();
            (model.predict(&held.report.hardware, &wanted).unwrap().costs, available)
        })
        .collect();
    let mut machines: Vec<String> = profiles.iter().map(machine).collect();
    machines.sort();
    machines.dedup();
    let residuals: Vec<train::HeldOut> = profiles
        .iter()
        .zip(&predictions)
        .flat_map(|(profile, (costs, _))| {
            let number = machines.iter().position(|m| *m == machine(profile)).unwrap();
            profile.report.points.iter().flat_map(move |point| {
                train::medians(point).into_iter().filter_map(move |(id, ns)| {
                    let cost = costs.iter().find(|c| c.algorithm == *id)?;
                    Some(train::HeldOut {
                        machine: number,
                        algorithm: id.clone(),
                        log2_objects: f64::from(point.load.objects).log2(),
                        ln_ratio: (ns / cost.curve.cost_ns(&point.load)).ln(),
                    })
                })
            })
        })
        .collect();
    eprintln!("{label}: fitted of all {:#?}", train::prior(&residuals));
    let scenarios: Vec<String> = {
        let mut s: Vec<String> = profiles[0].report.points.iter().map(|p| p.scenario.clone()).collect();
        s.dedup();
        s.sort();
        s.dedup();
        s
    };
    for (name, fitted) in [("assumed", false), ("fitted", true)] {
        for k in [0, 4, 8, 16] {
            for (what, across) in [("slice", false), ("all scenarios", true)] {
                let mut of_slice = Vec::new();
                let mut of_all = Vec::new();
                let mut seconds = 0.0;
                let mut count = 0;
                let mut spent: f64 = 0.0;
                for (profile, (costs, available)) in profiles.iter().zip(&predictions) {
                    let number = machines.iter().position(|m| *m == machine(profile)).unwrap();
                    let others: Vec<_> = residuals.iter().filter(|r| r.machine != number).cloned().collect();
                    let prior = if fitted { train::prior(&others) } else { Prior::ASSUMED };
                    let scenario = train::slice_scenario(&profile.report);
                    let points: Vec<ReplayPoint> = if across {
                        scenarios.iter().flat_map(|s| points(profile, s)).collect()
                    } else {
                        points(profile, scenario)
                    };
                    let mut slice: Vec<Load> = points.iter().map(|p| p.load).collect();
                    if !across {
                        slice.sort_by_key(|l| l.objects);
                        slice.dedup_by_key(|l| l.objects);
                    }
                    let began = std::time::Instant::now();
                    let learned = learn(costs.clone(), &prior, &slice, &mut Replay::new(&points), k).unwrap();
                    seconds += began.elapsed().as_secs_f64();
                    count += learned.taken.len();
                    spent = spent.max(learned.taken.iter().map(|t| t.sample.seconds).sum());
                    let choose = train::by_costs(learned.costs(), available);
                    let all = train::average(&train::regrets(profile, &choose));
                    of_all.push(all);
                    let mut only = profile.clone();
                    only.report.points.retain(|p| p.scenario == scenario);
                    of_slice.push(train::average(&train::regrets(&only, &choose)));
                    if k == 8 && all > 0.03 {
                        eprintln!("  {} {what} {:.1} %", profile.file, all * 100.0);
                        for t in &learned.taken {
                            eprintln!(
                                "     {} {} {:.0} {:.0} {:.2}",
                                t.algorithm,
                                t.sample.load.objects,
                                t.predicted_ns,
                                t.sample.ns,
                                (t.sample.ns / t.predicted_ns).ln()
                            );
                        }
                    }
                }
                let n = profiles.len() as f64;
                eprintln!(
                    "{label} {name:8} k {k:2} sampled {what:14}: slice {:.2} % p95 {:.2} %, all scenarios {:.2} % p95 {:.2} %; {:.2} ms, {:.1} taken, {spent:.2} s",
                    train::average(&of_slice) * 100.0,
                    p95(&of_slice) * 100.0,
                    train::average(&of_all) * 100.0,
                    p95(&of_all) * 100.0,
                    seconds / n * 1e3,
                    count as f64 / n
                );
            }
        }
    }
}

#[test]
#[ignore = "takes minutes and prints figures to read"]
fn regret_of_simulated_machines_by_number_of_samples() {
    let loads = simulate::Loads::of_a_sweep(1, None).unwrap();
    let specifications = simulate::built_in().unwrap();
    let reports = simulate::simulate(&specifications, 51, &loads, 1).unwrap();
    for part in 0..4 {
        let of = reports.iter().skip(part).step_by(4).take(12);
        let profiles: Vec<Profile> =
            of.map(|(file, report)| Profile { file: file.clone(), report: report.clone() }).collect();
        evaluate(&profiles, &format!("simulated {part}"));
    }
}

#[test]
#[ignore = "takes minutes and prints figures to read"]
fn regret_of_real_profiles_by_number_of_samples() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets");
    let reports = crate::document::read_reports(&[folder]).unwrap();
    let (profiles, notes) = train::usable(&reports, train::Evidence::Real);
    notes.iter().for_each(|n| eprintln!("{n}"));
    evaluate(&profiles, "real");
}
