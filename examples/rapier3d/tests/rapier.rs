//! Sapwise against rapier's own broad phase, and what keeps the comparison honest.

use sapwise::{Aabb, Registry};
use sapwise_example_rapier3d::{Comparison, Counts, Settings, World};
use sapwise_scenes::Frames;
use std::process::Command;

/// Compares each of these frames, and returns its boxes.
fn course(settings: Settings, frames: usize) -> (Vec<Counts>, Vec<Vec<Aabb>>) {
    let mut world = World::new(settings);
    let mut comparison = Comparison::new(&Registry::with_cores(2)).unwrap();
    let mut recording = Vec::new();
    let frame = |_| {
        world.prepare_step();
        assert!(world.bodies() <= settings.bodies);
        comparison.before_step(world.physics()).unwrap();
        recording.push(comparison.boxes(world.physics()));
        world.step();
        comparison.after_step(world.physics()).unwrap_or_else(|mismatch| panic!("{mismatch}"))
    };
    ((0..frames).map(frame).collect(), recording)
}

/// Returns the number of boxes that overlap or touch, whether they may meet or not.
fn overlapping(boxes: &[Aabb]) -> usize {
    boxes.iter().enumerate().map(|(j, b)| boxes[..j].iter().filter(|a| a.overlaps(b)).count()).sum()
}

#[test]
fn both_have_the_same_pairs_in_every_frame_while_bodies_break_and_are_cleared() {
    let (counts, recording) = course(Settings { bodies: 400, seed: 1 }, 420);
    let most = counts.iter().map(|c| c.boxes).max().unwrap();
    let last = counts[299].boxes;
    // From the whole cubes, eight boxes each, to hundreds of pieces, and back to few.
    assert_eq!(counts[0].boxes, 85);
    assert!(most > 350 && last < 40, "{most} boxes, then {last}");
    // A comparison of few pairs would prove little, and so would one in which margins or rules play no part.
    let (frame, fullest) = counts.iter().enumerate().max_by_key(|(_, c)| c.own).unwrap();
    assert!(fullest.own > 500 && fullest.rapier > fullest.own, "{fullest:?}");
    // Debris, and the floor with the walls.
    let all: Vec<usize> = recording.iter().map(|boxes| overlapping(boxes)).collect();
    assert!(all[frame] > fullest.found + 50, "{} pairs, {fullest:?}", all[frame]);
    assert!(all[0] >= 272 && counts[0].own == 0, "{} pairs, {:?}", all[0], counts[0]);
    for pair in counts.windows(2) {
        assert_eq!(pair[0].found + pair[1].begun, pair[1].found + pair[1].ended, "{pair:?}");
    }
    assert!(counts.iter().any(|c| c.ended > 100));
}

#[test]
fn pairs_of_bodies_that_sleep_are_the_same_too() {
    let mut world = World::new(Settings { bodies: 10, seed: 3 });
    let mut comparison = Comparison::new(&Registry::with_cores(1)).unwrap();
    let mut asleep = 0;
    world.prepare_step();
    for _ in 0..900 {
        // Nothing breaks and nothing is cleared away: the program does nothing between the steps.
        comparison.before_step(world.physics()).unwrap();
        world.step();
        comparison.after_step(world.physics()).unwrap_or_else(|mismatch| panic!("{mismatch}"));
        asleep = world.physics().bodies.iter().filter(|(_, b)| b.is_dynamic() && b.is_sleeping()).count();
    }
    assert_eq!(asleep, 10);
}

#[test]
fn a_seed_gives_the_same_boxes_again_and_another_one_others() {
    let record = |seed| course(Settings { bodies: 60, seed }, 120).1;
    assert_eq!(record(5), record(5));
    assert_ne!(record(5), record(6));
}

#[test]
fn the_command_records_what_it_compares() {
    let (_, recording) = course(Settings { bodies: 30, seed: 7 }, 90);
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("recorded.npy");
    let run = |path: &str| {
        let words = ["--frames", "90", "--bodies", "30", "--seed", "7", "--record", path];
        Command::new(env!("CARGO_BIN_EXE_sapwise-example-rapier3d")).args(words).output().unwrap()
    };
    let done = run(file.to_str().unwrap());
    assert!(done.status.success(), "{done:?}");
    let told = String::from_utf8(done.stdout).unwrap();
    assert!(told.lines().last().unwrap().starts_with("90 frames of "), "{told}");
    assert!(Frames::read(&file).unwrap().iter().eq(recording.iter().map(Vec::as_slice)), "another recording");
    let failed = run("missing/folder/s.npy");
    let error = String::from_utf8(failed.stderr).unwrap();
    assert!(failed.status.code() == Some(1) && error.contains("can't write missing/folder/s.npy"), "{error}");
}
