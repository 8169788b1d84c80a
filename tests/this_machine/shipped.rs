//! Tunings that come with a program, one for each kind of machine.

use super::{boxes, frame, learn, names, options, origin, start};
use sapwise::measure::machine;
use sapwise::{Adaptive, Origin, SimdLevel, Tuning, json, usable_cores};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Puts a tuning of this machine there, and tells in which file.
fn ship(folder: &Path) -> (PathBuf, Tuning) {
    let mut machine = machine();
    machine.simd = SimdLevel::in_use().to_string();
    let tuning = start(&options(&folder.join("other"))).tuning().clone();
    let file = folder.join(machine.tuning_file(usable_cores(), &[]));
    fs::write(&file, json::write_tuning(&tuning).unwrap()).unwrap();
    (file, tuning)
}

fn first_remark(adaptive: &Adaptive) -> &str {
    adaptive.setup().remarks.first().map_or("", String::as_str)
}

#[test]
fn a_kind_of_machine_that_is_known_is_not_measured_and_learns() {
    let (shipped, cache) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (_, tuning) = ship(shipped.path());
    let options = options(cache.path()).tunings(shipped.path());
    let mut first = start(&options);
    assert_eq!((origin(&first), first_remark(&first)), (Origin::Shipped, ""));
    assert!(*first.tuning() == tuning);
    frame(&mut first, &boxes(300));
    assert!(names(cache.path()).is_empty());
    learn(&mut first, &boxes(400));
    first.save().unwrap();
    let learned = first.learned();
    let second = start(&options);
    assert_eq!(origin(&second), Origin::Cached);
    assert!(*second.tuning() == learned);
    // What was kept is old: what was shipped is newer than a measurement of seconds is good.
    edit_kept(&second, |measured| (measured["at_unix_s"], measured["frames_over_predicted"]) = (1.into(), 1.0.into()));
    let third = start(&options);
    assert_eq!((origin(&third), first_remark(&third)), (Origin::Shipped, ""));
    assert!(*third.tuning() == tuning);
}

#[test]
fn a_tuning_that_frames_have_contradicted_gives_way_to_a_measurement() {
    let (shipped, cache) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    ship(shipped.path());
    let options = options(cache.path()).tunings(shipped.path());
    let mut first = start(&options);
    learn(&mut first, &boxes(400));
    first.save().unwrap();
    edit_kept(&first, |measured| {
        measured["at_unix_s"] = (measured["at_unix_s"].as_u64().unwrap() - 86_400).into();
        (measured["attempt"], measured["frames_over_predicted"]) = (1.into(), 3.0.into());
    });
    let second = start(&options);
    assert_eq!(origin(&second), Origin::Probed, "{:?}", second.setup());
    assert!(first_remark(&second).contains("3.00 times as long"), "{:?}", second.setup());
}

#[test]
fn what_cannot_be_used_is_told_and_a_machine_of_another_kind_is_measured() {
    let (shipped, cache) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (file, tuning) = ship(shipped.path());
    let options = options(cache.path()).tunings(shipped.path());
    let mut of_other_build = tuning;
    of_other_build.costs[0].revision += 1;
    for text in [String::new(), "{}".to_owned(), json::write_tuning(&of_other_build).unwrap()] {
        fs::write(&file, text).unwrap();
        let mut adaptive = start(&options);
        assert_eq!(origin(&adaptive), Origin::Probed);
        let remark = first_remark(&adaptive);
        assert!(remark.contains("is ignored") && remark.contains(file.to_str().unwrap()), "{remark}");
        frame(&mut adaptive, &boxes(200));
        for name in names(cache.path()) {
            fs::remove_file(cache.path().join(name)).unwrap();
        }
    }
    fs::remove_file(&file).unwrap();
    fs::create_dir(&file).unwrap();
    assert!(first_remark(&start(&options)).contains("it is no file"));
    let missing = options.tunings(shipped.path().join("missing"));
    let adaptive = start(&missing.probe_limit(Duration::ZERO));
    assert_eq!((origin(&adaptive), first_remark(&adaptive)), (Origin::Cached, ""));
}

/// Makes another text of what the file in the cache says of its measurement.
fn edit_kept(adaptive: &Adaptive, edit: impl Fn(&mut serde_json::Value)) {
    super::age::edit_measured(adaptive.setup().file.as_ref().unwrap(), edit);
}
