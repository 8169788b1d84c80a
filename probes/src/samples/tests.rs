use super::replay::{Replay, ReplayPoint};
use super::*;
use crate::simulate;
use crate::train::{self, Profile};
use std::time::Instant;

fn points(profile: &Profile) -> Vec<(&str, ReplayPoint)> {
    let timings = |p| train::medians(p).into_iter().map(|(id, ns)| (id.clone(), ns)).collect();
    profile.report.points.iter().map(|p| (p.scenario.as_str(), ReplayPoint { load: p.load, timings: timings(p) })).collect()
}

/// A machine and what a model that has not seen it predicts.
struct Held<'a> {
    profile: &'a Profile,
    costs: Vec<AlgorithmCost>,
    available: Vec<AlgorithmId>,
    residuals: Vec<train::HeldOut>,
}

fn hold_out(profiles: &[Profile]) -> Vec<Held<'_>> {
    let id = |p: &Profile| p.report.hardware.machine.physical_id.clone();
    let one = profiles.iter().all(|p| id(p) == id(&profiles[0]));
    let machine = |p: &Profile| if one { p.file.clone() } else { id(p) };
    let mut machines: Vec<String> = profiles.iter().map(machine).collect();
    machines.sort();
    machines.dedup();
    let of = |profile| {
        let known: Vec<&Profile> = profiles.iter().filter(|p| machine(p) != machine(profile)).collect();
        let model = train::model(&known, "x").unwrap().0;
        let available = train::available(profile);
        let timed = |id: &AlgorithmId| profile.report.algorithms.iter().find(|t| t.id == *id).unwrap();
        let wanted: Vec<(AlgorithmId, u32)> = available.iter().map(|id| (id.clone(), timed(id).revision)).collect();
        let costs = model.predict(&profile.report.hardware, &wanted).unwrap().costs;
        let number = machines.iter().position(|m| *m == machine(profile)).unwrap();
        let residual = |load: &Load, id: &AlgorithmId, ns: f64| {
            let predicted = costs.iter().find(|c| c.algorithm == *id)?.curve.cost_ns(load);
            let log2_objects = f64::from(load.objects).log2();
            Some(train::HeldOut { machine: number, algorithm: id.clone(), log2_objects, ln_ratio: (ns / predicted).ln() })
        };
        let points = points(profile);
        let residuals = points.iter().flat_map(|(_, p)| p.timings.iter().filter_map(|(id, ns)| residual(&p.load, id, *ns)));
        let residuals = residuals.collect();
        Held { profile, costs, available, residuals }
    };
    profiles.iter().map(of).collect()
}

/// Mean regret of a machine in the scenario that was sampled and in all of its scenarios, and what the samples took.
struct Figures {
    own: f64,
    all: f64,
    seconds: f64,
    thinking: f64,
    taken: usize,
}

fn figures(held: &Held<'_>, prior: &Prior, most: usize, across: bool, tell: bool) -> Figures {
    let scenario = train::slice_scenario(&held.profile.report);
    let within: Vec<ReplayPoint> =
        points(held.profile).into_iter().filter(|p| across || p.0 == scenario).map(|p| p.1).collect();
    let mut slice: Vec<Load> = within.iter().map(|p| p.load).collect();
    if !across {
        slice.sort_by_key(|l| l.objects);
        slice.dedup_by_key(|l| l.objects);
    }
    let began = Instant::now();
    let learned = learn(held.costs.clone(), prior, &slice, &mut Replay::new(&within), most).unwrap();
    let thinking = began.elapsed().as_secs_f64();
    let choose = train::by_costs(learned.costs(), &held.available);
    let regrets = |scenario: Option<&str>| {
        let mut profile = held.profile.clone();
        profile.report.points.retain(|p| scenario.is_none_or(|s| p.scenario == s));
        train::average(&train::regrets(&profile, &choose))
    };
    let figures = Figures {
        own: regrets(Some(scenario)),
        all: regrets(None),
        seconds: learned.taken.iter().map(|t| t.sample.seconds).sum(),
        thinking,
        taken: learned.taken.len(),
    };
    if tell && figures.all > 0.03 {
        eprintln!("  {} own {:.1} % all {:.1} %", held.profile.file, figures.own * 100.0, figures.all * 100.0);
        for t in &learned.taken {
            let Taken { algorithm, sample, predicted_ns } = t;
            let ratio = (sample.ns / predicted_ns).ln();
            eprintln!("    {algorithm:14} {:8} {predicted_ns:12.0} {:12.0} {ratio:6.2}", sample.load.objects, sample.ns);
        }
    }
    figures
}

fn tell(label: &str, figures: &[Figures]) {
    let line = |of: &dyn Fn(&Figures) -> f64| {
        let mut values: Vec<f64> = figures.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        let p95 = values[((values.len() as f64 * 0.95).ceil() as usize).clamp(1, values.len()) - 1];
        format!("{:.2} / {:.2} %", train::average(&values) * 100.0, p95 * 100.0)
    };
    let mean = |of: &dyn Fn(&Figures) -> f64| train::average(&figures.iter().map(of).collect::<Vec<f64>>());
    eprintln!(
        "{label}: own {}, all {}; {:.1} samples in {:.2} s, {:.1} ms to choose them",
        line(&|f| f.own),
        line(&|f| f.all),
        mean(&|f| f.taken as f64),
        mean(&|f| f.seconds),
        mean(&|f| f.thinking) * 1e3
    );
}

fn evaluate(name: &str, groups: &[Vec<Held<'_>>]) {
    let assumed = |change: &dyn Fn(&mut sapwise::posterior::Deviations)| {
        let mut prior = Prior::ASSUMED;
        change(&mut prior.cpu);
        change(&mut prior.gpu);
        prior
    };
    let others = |group: &[Held<'_>], held: &Held<'_>| {
        let own = held.residuals.first().map(|r| r.machine);
        let rest = group.iter().flat_map(|h| &h.residuals).filter(|r| Some(r.machine) != own);
        train::prior(&rest.cloned().collect::<Vec<_>>())
    };
    type Make<'a> = &'a dyn Fn(&[Held<'_>], &Held<'_>) -> Prior;
    let ways: [(&str, Make<'_>); 6] = [
        ("assumed", &|_, _| Prior::ASSUMED),
        ("assumed, noise .1", &|_, _| assumed(&|d| d.noise_ln = 0.1)),
        ("assumed, noise .2", &|_, _| assumed(&|d| d.noise_ln = 0.2)),
        ("assumed, counts .2", &|_, _| assumed(&|d| d.count_ln = 0.2)),
        ("fitted", &others),
        ("fitted, counts .1", &|g, h| {
            let mut prior = others(g, h);
            (prior.cpu.count_ln, prior.gpu.count_ln) = (0.1, 0.1);
            prior
        }),
    ];
    for (way, make) in ways {
        for (most, across) in [(8, false)] {
            let all: Vec<Figures> =
                groups.iter().flat_map(|g| g.iter().map(move |h| figures(h, &make(g, h), most, across, false))).collect();
            tell(&format!("{name}, {way}, {most} samples {across}"), &all);
        }
    }
}

#[test]
#[ignore = "takes minutes and prints figures to read"]
fn regret_of_simulated_machines_by_number_of_samples() {
    let loads = simulate::Loads::of_a_sweep(1, None).unwrap();
    let reports = simulate::simulate(&simulate::built_in().unwrap(), 51, &loads, 1).unwrap();
    let profiles: Vec<Profile> = reports.into_iter().map(|(file, report)| Profile { file, report }).collect();
    let parts: Vec<Vec<Profile>> = (0..4).map(|k| profiles.iter().skip(k).step_by(4).take(12).cloned().collect()).collect();
    let groups: Vec<Vec<Held<'_>>> = parts.iter().map(|p| hold_out(p)).collect();
    evaluate("simulated", &groups);
}

#[test]
#[ignore = "takes minutes and prints figures to read"]
fn regret_of_real_profiles_by_number_of_samples() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets");
    let reports = crate::document::read_reports(&[folder]).unwrap();
    let (profiles, notes) = train::usable(&reports, train::Evidence::Real);
    notes.iter().for_each(|n| eprintln!("{n}"));
    evaluate("real", &[hold_out(&profiles)]);
}
