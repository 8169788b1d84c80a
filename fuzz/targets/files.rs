//! Any text as a file of Sapwise, and what follows: tuning runs, models predict, reports are measured tuning, and
//! what is read is read again as it was written.
#![no_main]

use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use sapwise::{Adaptive, BroadPhase, Error, Registry, Tuning};
use sapwise_fuzz::checked::{check, hardware};
use sapwise_fuzz::oracle::Answer;
use sapwise_fuzz::scene::Scene;
use sapwise_fuzz::{Source, json::damaged};
use sapwise_lab::fit::measured_tuning;
use sapwise_lab::report;
use sapwise_tune::{Hardware, Model, json};
use std::sync::LazyLock;

static REGISTRY: LazyLock<Registry> = LazyLock::new(|| Registry::with_cores(2));
static HARDWARE: LazyLock<Hardware> = LazyLock::new(hardware);
static BUILT_IN: LazyLock<Model> = LazyLock::new(|| Model::built_in().unwrap());

/// Scenes of no, few and some boxes, with their answers.
static SCENES: LazyLock<Vec<(Scene, Answer)>> = LazyLock::new(|| {
    let boxes: [&[u8]; 3] = [&[], &[0, 9, 0, 0, 0, 8, 4, 0, 0, 8, 90, 0, 0, 1], &[1, 1, 1, 200, 24, 24, 24]];
    let scene = |bytes: &&[u8]| {
        let mut scene = Scene::default();
        scene.edit(&mut Source::new(bytes));
        let answer = scene.answer();
        (scene, answer)
    };
    boxes.iter().map(scene).collect()
});

fuzz_target!(|text: &str| {
    if let Ok(tuning) = json::tuning(text) {
        write_and_run(tuning);
    }
    if let Ok(model) = json::model(text) {
        let written = json::Format::MODEL.write(&model).unwrap();
        assert_eq!(json::model(&written).unwrap(), model);
        predict(&model, &HARDWARE);
    }
    if let Ok(read) = report::read(text) {
        let report = read.value;
        let written = report::write(&report).unwrap();
        assert_eq!(report::read(&written).unwrap().value, report);
        predict(&BUILT_IN, &report.hardware);
        for base in [None, Some(&*BUILT_IN)] {
            if let Ok(tuning) = measured_tuning(&report, "uniform", base) {
                write_and_run(tuning);
            }
        }
    }
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    match damaged(&data[..size], seed).filter(|text| text.len() <= max_size && seed % 4 != 0) {
        Some(text) => {
            data[..text.len()].copy_from_slice(text.as_bytes());
            text.len()
        }
        None => fuzzer_mutate(data, size, max_size),
    }
});

/// Asserts that what a model predicts of a measured machine is sound.
fn predict(model: &Model, hardware: &Hardware) {
    if let Ok(prediction) = model.predict(hardware, &REGISTRY.available()) {
        write_and_run(prediction.tuning("uniform", &[]));
    }
}

/// Asserts that the library reads what it writes.
fn assert_reads_back(tuning: &Tuning) {
    let written = json::write_tuning(tuning).unwrap();
    assert_eq!(json::tuning(&written).unwrap(), *tuning);
}

fn write_and_run(tuning: Tuning) {
    assert_reads_back(&tuning);
    run(tuning);
}

/// Runs frames by the tuning. Asserts that their pairs are right, and that what they teach is sound.
fn run(tuning: Tuning) {
    let Ok(mut adaptive) = Adaptive::new(tuning, &REGISTRY) else { return };
    for (scene, right) in SCENES.iter().chain(&*SCENES) {
        let mut room = scene.room();
        match adaptive.find_pairs(scene.boxes(), &mut room) {
            Err(Error::Unavailable { .. }) => return,
            found => check("adaptive", right, found, &room),
        }
        adaptive.last_decision().unwrap().to_string();
    }
    assert_reads_back(&adaptive.learned());
}
