use super::*;
use sapwise::{CostCurve, CostTerm, Term};

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
        Some(Effort { objects: load.objects, is_incremental: false })
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
        let seconds = Effort { objects: load.objects, is_incremental: false }.seconds(ns);
        Ok(Answer::Taken(Sample { load: *load, ns, noise_ln: 0.01, seconds }))
    }
}

fn id(text: &str) -> AlgorithmId {
    text.parse().unwrap()
}

/// `grid-sap@cpu1` and a user's tree lie 5 % apart at every size; the GPUs gain with many objects.
fn costs() -> Vec<AlgorithmCost> {
    let cost = |text: &str, call_ns: f64, object_ns: f64| {
        let terms = [(Term::Call, call_ns), (Term::Objects, object_ns)];
        let terms = terms.map(|(term, unit_ns)| CostTerm { term, unit_ns }).into();
        AlgorithmCost::new(id(text), 1, CostCurve::new(terms), 0.2)
    };
    vec![
        cost("grid-sap@cpu1", 100.0, 40.0),
        cost("my-tree@cpu1", 105.0, 42.0),
        cost("brute@cpu1", 1e6, 400.0),
        cost("grid-sap@gpu0", 2e5, 10.0),
        cost("sap@gpu0", 2.2e5, 11.0),
    ]
}

fn slice() -> Vec<Load> {
    (2..=12).map(|k| Load::of_objects(10_u32.pow(k / 2) * if k % 2 == 0 { 1 } else { 3 })).collect()
}

fn made_up(real: &[(&str, f64)]) -> MadeUp {
    let real = real.iter().map(|&(text, ratio)| (id(text), ratio)).collect();
    MadeUp { real, failing: Vec::new(), asked: Vec::new(), answers: usize::MAX }
}

fn cheapest(costs: &[AlgorithmCost], objects: u32) -> String {
    let load = Load::of_objects(objects);
    let best = costs.iter().min_by(|a, b| a.curve.cost_ns(&load).total_cmp(&b.curve.cost_ns(&load)));
    best.unwrap().algorithm.to_string()
}

#[test]
fn samples_go_where_the_choice_is_in_doubt_and_turn_it() {
    let mut source = made_up(&[("grid-sap@cpu1", 1.3), ("my-tree@cpu1", 0.9)]);
    let learned = learn(Observed::of_unlike_machine(costs()), &slice(), &mut source, 6).unwrap();
    assert_eq!(cheapest(&costs(), 1000), "grid-sap@cpu1");
    assert_eq!(cheapest(&learned.costs(), 1000), "my-tree@cpu1");
    assert!(source.asked.iter().all(|a| a.0 != id("brute@cpu1")), "{:?}", source.asked);
    assert!(source.asked.len() <= 6 && source.asked.len() == learned.taken.len());
    let mut places = source.asked.clone();
    places.sort();
    places.dedup();
    assert_eq!(places.len(), source.asked.len(), "a place was sampled twice");
    let first = &learned.taken[0];
    assert!((first.predicted_ns / first.observation().predicted_ns - 1.0).abs() < 1e-12);
    assert!(learn(Observed::of_unlike_machine(costs()), &slice(), &mut source, 0).unwrap().taken.is_empty());
}

#[test]
fn samples_stay_within_their_time_on_a_slow_machine() {
    let slow: Vec<AlgorithmCost> = costs()
        .into_iter()
        .map(|mut cost| {
            cost.curve.work_mut().terms.iter_mut().for_each(|t| t.unit_ns *= 100.0);
            cost
        })
        .collect();
    let real: Vec<(String, f64)> = slow.iter().map(|c| (c.algorithm.to_string(), 100.0)).collect();
    let real: Vec<(&str, f64)> = real.iter().map(|(id, ratio)| (id.as_str(), *ratio)).collect();
    let mut source = made_up(&real);
    let learned = learn(Observed::of_unlike_machine(slow), &slice(), &mut source, 8).unwrap();
    let spent: f64 = learned.taken.iter().map(|t| t.sample.seconds).sum();
    assert!(!learned.taken.is_empty() && spent <= SECONDS, "{spent}");
    assert!(source.asked.iter().all(|a| a.1 < 1_000_000), "{:?}", source.asked);
}

#[test]
fn who_fails_is_left_out_with_all_on_its_gpus_and_the_rest_goes_on() {
    let mut source = made_up(&[]);
    source.failing = vec![(id("grid-sap@gpu0"), vec![0]), (id("my-tree@cpu1"), Vec::new())];
    let learned = learn(Observed::of_unlike_machine(costs()), &slice(), &mut source, 8).unwrap();
    let left: Vec<String> = learned.costs().iter().map(|c| c.algorithm.to_string()).collect();
    assert_eq!(left, ["grid-sap@cpu1", "brute@cpu1"], "{:?}", learned.remarks);
    assert!(learned.remarks.len() == 2 && learned.remarks.iter().any(|r| r.contains("all on gpu0: it broke")));
    let mut source = made_up(&[]);
    source.answers = 1;
    let learned = learn(Observed::of_unlike_machine(costs()), &slice(), &mut source, 8).unwrap();
    assert_eq!((learned.taken.len(), source.asked.len(), learned.costs().len()), (1, 2, 5));
}
