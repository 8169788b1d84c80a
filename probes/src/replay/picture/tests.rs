//! Tests of the picture of a simulation.

use super::*;
use crate::plot::Picture;
use crate::simulation::examples::{outcome, taken};
use crate::simulation::{CoRunner, Footage};
use sapwise_scenes::Scenario;

fn course(co_runner: Option<CoRunner>) -> Course {
    let footage = Footage::Scene { scenario: Scenario::Slab, objects: 10, seed: 1, swing: None };
    Course { footage, frames: 3, repeats: 1, seed: 1, learning: true, exploring: true, co_runner }
}

fn drawn(outcome: &Outcome, co_runner: Option<CoRunner>) -> String {
    let told = ["regret 3 %".to_owned(), "Made by: sapwise run slab".to_owned()];
    let figure = Simulation { course: &course(co_runner), outcome };
    String::from_utf8(figure.draw(Picture::Svg, &told).unwrap()).unwrap()
}

#[test]
fn the_best_algorithm_stands_for_each_number_of_cores_and_gpus() {
    let mut explored = taken(0);
    explored.explored = true;
    let ids = ["brute@cpu1", "grid-sap@cpu1", "grid-sap@cpu2", "sap@gpu0", "grid-sap@gpu0+1"];
    let both = outcome(
        &ids,
        &[
            (10, 1.0, &[1.0, 4.0, 3.0, 9.0, 8.0], taken(0)),
            (20, 3.0, &[9.0, 2.0, 2.0, 9.0, f64::INFINITY], taken(2)),
            (30, 9.0, &[9.0, 2.0, 1.0, 9.0, 8.0], explored),
        ],
    );
    let cores = Panel::new(BackendClass::Cpu, &both);
    assert_eq!(cores.units, [(1, 1), (2, 2)]);
    // The pair of GPUs sat out a frame.
    let gpus = Panel::new(BackendClass::Gpu, &both);
    assert_eq!(gpus.units, [(1, 3)]);
    let row = |panel: &Panel, id: &str| panel.rows()[panel.row(panel.unit(&id.parse().unwrap()))].clone();
    let named = ["brute@cpu1", "brute@cpu2", "sap@gpu0"].map(|id| row(&cores, id));
    assert_eq!(named, ["1 core", "2 cores", "a GPU"]);
    assert_eq!(["brute@cpu1", "grid-sap@gpu1"].map(|id| row(&gpus, id)), ["the CPU", "1 GPU"]);
    let svg = drawn(&both, Some(CoRunner { from_frame: 1, threads: None }));
    let needed = [
        "1 core: grid-sap@cpu1",
        "2 cores: grid-sap@cpu2",
        "1 GPU: sap@gpu0",
        "GPUs (slab)",
        "Cores (slab)",
        "the CPU",
        "explored",
        "switches",
        "co-runner",
        "regret 3 %",
        "Made by: sapwise run slab",
    ];
    assert!(needed.iter().all(|text| svg.contains(text)), "{svg}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
}

#[test]
fn a_machine_without_gpus_is_told_so() {
    let svg = drawn(&outcome(&["brute@cpu1"], &[(10, 1.0, &[1.0], taken(0))]), None);
    assert!(svg.contains("no GPU algorithm ran here") && !svg.contains("a GPU"), "{svg}");
}

#[test]
fn many_frames_are_drawn_as_few_points() {
    let values = (0..10_000).map(|k| if k % 9 == 0 { f64::INFINITY } else { f64::from(k) });
    let points = curve(values, 10_000);
    assert!(points.len() <= POINTS && points.iter().all(|p| p.1.is_finite()));
    assert!(points.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 < w[1].1));
    assert_eq!(curve([2.0, 3.0].into_iter(), 2), [(0, 2.0), (1, 3.0)]);
}
