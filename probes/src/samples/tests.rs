use super::replay::{Replay, ReplayPoint};
use super::*;
use crate::simulate;
use crate::train::{self, Profile};
use sapwise::{CostCurve, CostTerm, Term};
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

fn figures(held: &Held<'_>, prior: &Prior, most: usize, tell: bool) -> Figures {
    let scenario = train::slice_scenario(&held.profile.report);
    let within: Vec<ReplayPoint> = points(held.profile).into_iter().filter(|p| p.0 == scenario).map(|p| p.1).collect();
    let mut slice: Vec<Load> = within.iter().map(|p| p.load).collect();
    slice.sort_by_key(|l| l.objects);
    slice.dedup_by_key(|l| l.objects);
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

/// The prior as training would have it without the machine.
fn of_others(group: &[Held<'_>], held: &Held<'_>) -> Prior {
    let own = held.residuals.first().map(|r| r.machine);
    let rest = group.iter().flat_map(|h| &h.residuals).filter(|r| Some(r.machine) != own);
    train::prior(&rest.cloned().collect::<Vec<_>>())
}

fn evaluate(name: &str, groups: &[Vec<Held<'_>>]) {
    type Make<'a> = &'a dyn Fn(&[Held<'_>], &Held<'_>) -> Prior;
    let ways: [(&str, Make<'_>); 2] = [("assumed", &|_, _| Prior::ASSUMED), ("fitted", &of_others)];
    for (way, make) in ways {
        for most in [0, 4, 8, 16] {
            let all: Vec<Figures> =
                groups.iter().flat_map(|g| g.iter().map(move |h| figures(h, &make(g, h), most, most == 8))).collect();
            tell(&format!("{name}, prior {way}, {most} samples"), &all);
        }
    }
}

/// Real over predicted time of a made-up machine.
struct MadeUp {
    real: Vec<(AlgorithmId, f64)>,
    /// Those that fail, and the GPUs that go with them.
    failing: Vec<(AlgorithmId, Vec<u32>)>,
    asked: Vec<(AlgorithmId, u32)>,
    /// Answers before the time is over.
    answers: usize,
}

impl Source for MadeUp {
    fn effort(&self, _: &AlgorithmId, load: &Load) -> Option<Effort> {
        Some(Effort { objects: load.objects, keeps_work: false })
    }

    fn sample(&mut self, algorithm: &AlgorithmId, load: &Load) -> anyhow::Result<Answer> {
        self.asked.push((algorithm.clone(), load.objects));
        if let Some((_, gpus)) = self.failing.iter().find(|f| f.0 == *algorithm) {
            return Ok(Answer::Failed { why: "it broke".to_owned(), gpus: gpus.clone() });
        }
        if self.answers == 0 {
            return Ok(Answer::Over);
        }
        self.answers -= 1;
        let ratio = self.real.iter().find(|r| r.0 == *algorithm).map_or(1.0, |r| r.1);
        let cost = costs().into_iter().find(|c| c.algorithm == *algorithm).unwrap();
        let ns = cost.curve.cost_ns(load) * ratio;
        let seconds = Effort { objects: load.objects, keeps_work: false }.seconds(ns);
        Ok(Answer::Taken(Sample { load: *load, ns, noise_ln: 0.01, seconds }))
    }
}

fn id(text: &str) -> AlgorithmId {
    text.parse().unwrap()
}

/// `strips@cpu1` and a user's tree lie 5 % apart at every size; the GPUs gain with many objects.
fn costs() -> Vec<AlgorithmCost> {
    let cost = |text: &str, call_ns: f64, object_ns: f64| {
        let terms = [(Term::Call, call_ns), (Term::Objects, object_ns)];
        let terms = terms.map(|(term, unit_ns)| CostTerm { term, unit_ns }).into();
        let curve = CostCurve { terms, ..CostCurve::default() };
        AlgorithmCost { algorithm: id(text), revision: 1, curve, spread_ln: 0.2 }
    };
    vec![
        cost("strips@cpu1", 100.0, 40.0),
        cost("my-tree@cpu1", 105.0, 42.0),
        cost("brute@cpu1", 1e6, 400.0),
        cost("strips@gpu0", 2e5, 10.0),
        cost("sweep@gpu0", 2.2e5, 11.0),
    ]
}

fn slice() -> Vec<Load> {
    (2..=12).map(|k| Load { objects: 10_u32.pow(k / 2) * if k % 2 == 0 { 1 } else { 3 }, ..Load::default() }).collect()
}

fn made_up(real: &[(&str, f64)]) -> MadeUp {
    let real = real.iter().map(|&(text, ratio)| (id(text), ratio)).collect();
    MadeUp { real, failing: Vec::new(), asked: Vec::new(), answers: usize::MAX }
}

fn cheapest(costs: &[AlgorithmCost], objects: u32) -> String {
    let load = Load { objects, ..Load::default() };
    let best = costs.iter().min_by(|a, b| a.curve.cost_ns(&load).total_cmp(&b.curve.cost_ns(&load)));
    best.unwrap().algorithm.to_string()
}

#[test]
fn samples_go_where_the_choice_is_in_doubt_and_turn_it() {
    let mut source = made_up(&[("strips@cpu1", 1.3), ("my-tree@cpu1", 0.9)]);
    let learned = learn(costs(), &Prior::ASSUMED, &slice(), &mut source, 6).unwrap();
    assert_eq!(cheapest(&costs(), 1000), "strips@cpu1");
    assert_eq!(cheapest(&learned.costs(), 1000), "my-tree@cpu1");
    assert!(source.asked.iter().all(|a| a.0 != id("brute@cpu1")), "{:?}", source.asked);
    assert!(source.asked.len() <= 6 && source.asked.len() == learned.taken.len());
    let mut places = source.asked.clone();
    places.sort();
    places.dedup();
    assert_eq!(places.len(), source.asked.len(), "a place was sampled twice");
    let first = &learned.taken[0];
    assert!((first.predicted_ns / first.observation().predicted_ns - 1.0).abs() < 1e-12);
    assert!(learn(costs(), &Prior::ASSUMED, &slice(), &mut source, 0).unwrap().taken.is_empty());
}

#[test]
fn samples_stay_within_their_time_on_a_slow_machine() {
    let slow: Vec<AlgorithmCost> = costs()
        .into_iter()
        .map(|mut cost| {
            cost.curve.terms.iter_mut().for_each(|t| t.unit_ns *= 100.0);
            cost
        })
        .collect();
    let real: Vec<(String, f64)> = slow.iter().map(|c| (c.algorithm.to_string(), 100.0)).collect();
    let real: Vec<(&str, f64)> = real.iter().map(|(id, ratio)| (id.as_str(), *ratio)).collect();
    let mut source = made_up(&real);
    let learned = learn(slow, &Prior::ASSUMED, &slice(), &mut source, 8).unwrap();
    let spent: f64 = learned.taken.iter().map(|t| t.sample.seconds).sum();
    assert!(!learned.taken.is_empty() && spent <= SECONDS, "{spent}");
    assert!(source.asked.iter().all(|a| a.1 < 1_000_000), "{:?}", source.asked);
}

#[test]
fn who_fails_is_left_out_with_all_on_its_gpus_and_the_rest_goes_on() {
    let mut source = made_up(&[]);
    source.failing = vec![(id("strips@gpu0"), vec![0]), (id("my-tree@cpu1"), Vec::new())];
    let learned = learn(costs(), &Prior::ASSUMED, &slice(), &mut source, 8).unwrap();
    let left: Vec<String> = learned.costs().iter().map(|c| c.algorithm.to_string()).collect();
    assert_eq!(left, ["strips@cpu1", "brute@cpu1"], "{:?}", learned.remarks);
    assert!(learned.remarks.len() == 2 && learned.remarks.iter().any(|r| r.contains("all on gpu0: it broke")));
    let mut source = made_up(&[]);
    source.answers = 1;
    let learned = learn(costs(), &Prior::ASSUMED, &slice(), &mut source, 8).unwrap();
    assert_eq!((learned.taken.len(), source.asked.len(), learned.costs().len()), (1, 2, 5));
}

#[test]
fn eight_samples_take_off_more_than_half_of_the_regret_of_simulated_machines() {
    let loads = simulate::Loads::of_a_sweep(1, Some(30_000)).unwrap();
    let reports = simulate::simulate(&simulate::built_in().unwrap(), 8, &loads, 1).unwrap();
    let profiles: Vec<Profile> = reports.into_iter().map(|(file, report)| Profile { file, report }).collect();
    let group = hold_out(&profiles);
    let mean = |most| {
        let of = |h: &Held<'_>| figures(h, &of_others(&group, h), most, false).own;
        train::average(&group.iter().map(of).collect::<Vec<f64>>())
    };
    let (without, with) = (mean(0), mean(8));
    assert!(without > 0.01 && with < 0.5 * without, "{without} {with}");
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
