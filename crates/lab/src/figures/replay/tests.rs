//! Tests of the picture of a replay.

use super::*;
use crate::figures::Picture;

/// Frames with the time of the adaptive module, those of the algorithms in milliseconds, what ran, and whether it explored.
fn replay(ids: &[&str], frames: &[(usize, f64, &[f64], usize, bool)], switches: &[usize]) -> ReplayPicture {
    ReplayPicture {
        name: "slab".to_owned(),
        algorithms: ids.iter().map(|id| id.parse().unwrap()).collect(),
        fixed_ns: (0..ids.len()).map(|k| frames.iter().map(|f| f.2[k] * 1e6).collect()).collect(),
        adaptive_ns: frames.iter().map(|f| f.1 * 1e6).collect(),
        objects: frames.iter().map(|f| f.0).collect(),
        ran: frames.iter().map(|f| Some(f.3)).collect(),
        explored: frames.iter().map(|f| f.4).collect(),
        switches: switches.to_vec(),
        co_runner_from: None,
    }
}

fn drawn(replay: &ReplayPicture) -> String {
    let told = ["regret 3 %".to_owned(), "Made by: sapwise run slab".to_owned()];
    String::from_utf8(replay.draw(Picture::Svg, &told).unwrap()).unwrap()
}

#[test]
fn algorithms_that_ran_are_shown_with_their_frames_beside_the_best_of_each_width() {
    let ids = ["brute@cpu1", "grid-sap@cpu1", "grid-sap@cpu2", "sap@gpu0", "grid-sap@gpu0+1"];
    let inf = f64::INFINITY;
    let frames: [(usize, f64, &[f64], usize, bool); 3] = [
        (10, 1.0, &[1.0, 4.0, 3.0, 9.0, 8.0], 0, false),
        (20, 3.0, &[9.0, 2.0, 2.0, 9.0, inf], 2, false),
        (30, 9.0, &[9.0, 2.0, 1.0, 9.0, 8.0], 0, true),
    ];
    let both = ReplayPicture { co_runner_from: Some(1), ..replay(&ids, &frames, &[1]) };
    // Two that ran, then the best on one core, which did not.
    let cpu = Panel::new(BackendClass::Cpu, &both);
    assert_eq!((&cpu.shown[..], cpu.others), (&[0, 2, 1][..], false));
    assert_eq!(cpu.rows(&both), ["brute@cpu1", "grid-sap@cpu2", "grid-sap@cpu1", "explored", "switches"]);
    // The pair of GPUs was not timed at a frame, and nothing ran on a GPU.
    let gpus = Panel::new(BackendClass::Gpu, &both);
    assert_eq!((&gpus.shown[..], gpus.others, gpus.row(0), gpus.row(3)), (&[3][..], true, 0, 1));
    assert_eq!(gpus.rows(&both), ["another", "sap@gpu0", "explored", "switches"]);
    let svg = drawn(&both);
    let needed = [
        "brute@cpu1: ran in 2 frames",
        "grid-sap@cpu2: ran in 1 frame",
        "grid-sap@cpu1: never ran",
        "sap@gpu0: never ran",
        "GPUs (slab)",
        "CPU (slab)",
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
    let svg = drawn(&replay(&["brute@cpu1"], &[(10, 1.0, &[1.0], 0, false)], &[]));
    assert!(svg.contains("no GPU algorithm ran here") && !svg.contains("another"), "{svg}");
}

#[test]
fn many_frames_are_drawn_as_few_points() {
    let values: Vec<f64> = (0..10_000).map(|k| if k % 9 == 0 { f64::INFINITY } else { f64::from(k) }).collect();
    let points = curve(&values);
    assert!(points.len() <= POINTS && points.iter().all(|p| p.1.is_finite()));
    assert!(points.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 < w[1].1));
    assert_eq!(curve(&[2.0, 3.0]), [(0, 2.0), (1, 3.0)]);
}
