//! Sapwise against rapier's own broad phase, and what keeps the comparison honest.

use rapier3d::prelude::*;
use sapwise::{Aabb, Registry};
use sapwise_example_rapier3d::{Comparison, Counts, Mismatch, Recording, Settings, World};
use std::process::{Command, Output};

/// Compares each of these frames.
fn course(settings: Settings, frames: usize) -> (Vec<Counts>, Recording) {
    let mut world = World::new(settings);
    let mut comparison = Comparison::new(&Registry::with_cores(2)).unwrap();
    let mut recording = Recording::default();
    let frame = |_| {
        world.prepare_step();
        assert!(world.bodies() <= settings.bodies);
        comparison.before_step(world.physics()).unwrap();
        recording.push(&comparison.boxes(world.physics()));
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
    for seed in [1, 2] {
        let (counts, recording) = course(Settings { bodies: 400, seed }, 420);
        let most = counts.iter().map(|c| c.boxes).max().unwrap();
        let last = counts[299].boxes;
        // From the whole cubes, eight boxes each, to hundreds of pieces, and back to few.
        assert_eq!(counts[0].boxes, 85, "seed {seed}");
        assert!(most > 350 && last < 40, "seed {seed}: {most} boxes, then {last}");
        // A comparison of few pairs would prove little, and so would one in which margins or rules play no part.
        let (frame, fullest) = counts.iter().enumerate().max_by_key(|(_, c)| c.own).unwrap();
        assert!(fullest.own > 500 && fullest.rapier > fullest.own, "seed {seed}: {fullest:?}");
        // Debris, and the floor with the walls.
        let all: Vec<usize> = recording.frames().map(overlapping).collect();
        assert!(all[frame] > fullest.found + 50, "seed {seed}: {} pairs, {fullest:?}", all[frame]);
        assert!(all[0] >= 272 && counts[0].own == 0, "seed {seed}: {} pairs, {:?}", all[0], counts[0]);
        for pair in counts.windows(2) {
            assert_eq!(pair[0].found + pair[1].begun, pair[1].found + pair[1].ended, "seed {seed}: {pair:?}");
        }
        assert!(counts.iter().any(|c| c.ended > 100), "seed {seed}");
    }
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
fn a_body_that_moves_behind_the_back_of_the_comparison_is_a_mismatch() {
    let mut world = PhysicsWorld::new();
    let cube = || ColliderBuilder::cuboid(0.5, 0.5, 0.5);
    let at = |x| RigidBodyBuilder::dynamic().translation(Vector::new(x, 0.0, 0.0));
    let (_, near_cube) = world.insert(at(0.0), cube());
    let (far, far_cube) = world.insert(at(5.0), cube());
    let mut comparison = Comparison::new(&Registry::with_cores(1)).unwrap();
    comparison.before_step(&world).unwrap();
    world.step();
    comparison.after_step(&world).unwrap();
    comparison.before_step(&world).unwrap();
    world.bodies[far].set_translation(Vector::new(0.9, 0.0, 0.0), true);
    world.step();
    let mismatch = comparison.after_step(&world).unwrap_err();
    assert!(matches!(mismatch, Mismatch { step: 1, only_ours: false, fat: true, .. }), "{mismatch:?}");
    assert_eq!(mismatch.pair, [near_cube, far_cube]);
    let told = mismatch.to_string();
    assert!(
        told.starts_with("step 1, fat AABBs: rapier has the pair of colliders 0 and 1, Sapwise lacks it"),
        "{told}"
    );
}

#[test]
fn a_seed_gives_the_same_boxes_again_and_another_one_others() {
    let record = |seed| course(Settings { bodies: 60, seed }, 120).1;
    assert_eq!(record(5), record(5));
    assert_ne!(record(5), record(6));
}

#[test]
fn a_recording_is_an_array_whose_shorter_frames_end_in_nan() {
    let mut recording = Recording::default();
    let boxes = [Aabb::new([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]), Aabb::cube([0.5; 3], 0.5)];
    recording.push(&boxes);
    recording.push(&boxes[..1]);
    recording.push(&[]);
    let mut file = Vec::new();
    recording.write_npy(&mut file).unwrap();
    let data = file.len() - 3 * 2 * 6 * 4;
    assert_eq!(data % 64, 0);
    assert_eq!(&file[..8], b"\x93NUMPY\x01\x00");
    assert_eq!(usize::from(u16::from_le_bytes([file[8], file[9]])), data - 10);
    let text = str::from_utf8(&file[10..data]).unwrap();
    assert!(text.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 2, 6), }") && text.ends_with('\n'));
    let (elements, _) = file[data..].as_chunks::<4>();
    let values: Vec<f32> = elements.iter().map(|v| f32::from_le_bytes(*v)).collect();
    assert_eq!(values[..12], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    assert_eq!(values[12..18], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert!(values[18..].iter().all(|v| v.is_nan()));
}

fn command(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sapwise-example-rapier3d")).args(arguments).output().unwrap()
}

#[test]
fn the_command_records_what_it_compares_and_refuses_what_it_does_not_know() {
    let (_, recording) = course(Settings { bodies: 30, seed: 7 }, 90);
    let mut expected = Vec::new();
    recording.write_npy(&mut expected).unwrap();
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("recorded.npy");
    let path = file.to_str().unwrap();
    let done = command(&["--frames", "90", "--bodies", "30", "--seed", "7", "--quiet", "--record", path]);
    assert!(done.status.success(), "{done:?}");
    let told = String::from_utf8(done.stdout).unwrap();
    assert!(told.starts_with("90 frames of ") && told.lines().count() == 1, "{told}");
    assert!(std::fs::read(&file).unwrap() == expected, "another recording than the library's");

    for (arguments, told) in [
        (&["--frame"][..], "no option --frame"),
        (&["--frames"], "--frames needs a value"),
        (&["--seed", "x"], "\"x\" is no number"),
        (&["--frames", "0"], "no frame to run"),
    ] {
        let refused = command(arguments);
        let error = String::from_utf8(refused.stderr).unwrap();
        assert!(refused.status.code() == Some(2) && error.contains(told), "{arguments:?}: {error}");
    }
    let failed = command(&["--frames", "1", "--record", "missing/folder/s.npy"]);
    let error = String::from_utf8(failed.stderr).unwrap();
    assert!(failed.status.code() == Some(1) && error.contains("can't write missing/folder/s.npy"), "{error}");
}
