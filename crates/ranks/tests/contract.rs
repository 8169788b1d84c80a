//! The pairs of ranks compared with those of one process and with the definition. Ranks are threads.

mod harness;

use harness::{Owners, distributed, edge_cases, play};
use sapwise::tuning::{AlgorithmCost, CostCurve, CostTerm, Source, Term};
use sapwise::{Aabb, AlgorithmId, Registry, Tuning};
use sapwise_ranks::{Distributed, Error, Exchange, Failure, RankPairs, Threads};
use sapwise_scenes::Scenario;

const OWNERS: [Owners; 4] = [Owners::Random, Owners::Parts, Owners::One, Owners::Even];

#[test]
fn every_scenario_has_the_pairs_of_one_process() {
    for size in [1, 2, 3, 4, 7] {
        let counts = Threads::run(size, |threads| {
            let mut ranks = distributed::<Threads>(threads);
            let mut count = 0;
            for (k, scenario) in Scenario::ALL.into_iter().enumerate() {
                ranks.set_cut_every((k % 2 == 0).then_some(7));
                count += play(&mut ranks, scenario, 220, 40, OWNERS[k % 4]);
            }
            count
        });
        assert!(counts.iter().sum::<u64>() > 50_000, "{counts:?}");
    }
}

#[test]
fn edge_cases_and_errors() {
    for size in [1, 2, 3, 4, 7] {
        Threads::run(size, |threads| {
            let mut ranks = distributed::<Threads>(threads);
            edge_cases(&mut ranks);
            ranks.set_cut_every(Some(1));
            edge_cases(&mut ranks);
        });
    }
}

/// A tuning of one algorithm with this cost of a box.
fn tuning(unit_ns: f64) -> Tuning {
    let curve = CostCurve::new(vec![CostTerm::new(Term::Objects, unit_ns)]);
    let id = "bvh@cpu1".parse::<AlgorithmId>().unwrap();
    let revision = Registry::with_cores(1).entries().iter().find(|e| e.id == id).unwrap().revision;
    Tuning::from_costs(Source::Predicted, "uniform", vec![AlgorithmCost::new(id, revision, curve, 0.1)], &[])
}

#[test]
fn a_slow_machine_gets_less() {
    let searched = Threads::run(3, |threads| {
        let registry = Registry::with_cores(1);
        let slow = threads.rank() == 1;
        let mut ranks: Distributed<Threads> =
            Distributed::new(threads, &registry, tuning(if slow { 300.0 } else { 100.0 })).unwrap();
        let mut scene = Scenario::Uniform.start(6000, 1);
        let (own, ids): (Vec<Aabb>, Vec<u64>) =
            (0..6000).skip(ranks.rank()).step_by(3).map(|k| (scene.boxes()[k], k as u64)).unzip();
        scene.advance();
        ranks.find_pairs(&own, &ids, &mut RankPairs::new()).unwrap();
        assert!(ranks.last_frame().cut && ranks.last_frame().memory_bytes > 24 * 2000);
        ranks.last_frame().boxes_searched as f64 / 6000.0
    });
    // The tolerance includes boxes that are searched twice.
    for (found, wanted) in searched.iter().zip([3.0 / 7.0, 1.0 / 7.0, 3.0 / 7.0]) {
        assert!((found / wanted - 1.0).abs() < 0.15, "{searched:?}");
    }
}

#[test]
fn only_what_crosses_is_sent() {
    let reports = Threads::run(4, |threads| {
        let mut ranks = distributed::<Threads>(threads);
        let scene = Scenario::Uniform.start(20_000, 1);
        let boxes = scene.boxes();
        let mut pairs = RankPairs::new();
        let mut last = None;
        for _ in 0..2 {
            // In the second frame each rank owns the boxes in its region.
            let own = |k: &usize| {
                ranks.cuts().rank_of(boxes[*k].min) == ranks.rank()
                    || ranks.cuts().regions().len() == 1 && k % 4 == ranks.rank()
            };
            let (own, ids): (Vec<Aabb>, Vec<u64>) = (0..boxes.len()).filter(own).map(|k| (boxes[k], k as u64)).unzip();
            ranks.find_pairs(&own, &ids, &mut pairs).unwrap();
            last = Some(ranks.last_frame().clone());
        }
        last.unwrap()
    });
    let sum = |of: fn(&sapwise_ranks::FrameReport) -> u64| reports.iter().map(of).sum::<u64>();
    assert_eq!(sum(|r| r.boxes), 20_000);
    assert_eq!(sum(|r| r.boxes_sent), sum(|r| r.boxes_received));
    assert_eq!(sum(|r| r.pairs_sent), sum(|r| r.pairs_received));
    // Unit cubes in a world of edge 54: each plane crosses about one box in 54.
    let crossing = sum(|r| r.boxes_sent) as f64 / 20_000.0;
    assert!((0.02..0.06).contains(&crossing), "{crossing}");
    assert!(sum(|r| r.pairs_sent) < sum(|r| r.boxes_sent) && reports.iter().all(|r| !r.cut));
}

#[test]
fn a_rank_without_an_algorithm_is_an_error_on_all() {
    let errors = Threads::run(3, |threads| {
        let registry = Registry::with_cores(1);
        let unknown =
            Tuning::from_steps(vec![sapwise::tuning::Step::new(0, "bvh@cpu64".parse::<AlgorithmId>().unwrap())])
                .unwrap();
        let tuning = if threads.rank() == 2 { unknown } else { Tuning::usual(&registry) };
        Distributed::<Threads>::new(threads, &registry, tuning).map(|_| ()).unwrap_err()
    });
    assert_eq!(errors, vec![Error::Search { rank: 2, failure: Failure::NoAlgorithm }; 3]);
}
