//! What is kept is measured again once it is old, was disturbed or is contradicted.

use super::{boxes, frame, frames_until_it_came, learn, options, origin, start};
use sapwise::{Origin, Source};
use std::fs;
use std::path::Path;
use std::time::Duration;

/// Makes another text of what a cache file says of its measurement.
pub(crate) fn edit_measured(file: &Path, edit: impl Fn(&mut serde_json::Value)) {
    let mut cached: serde_json::Value = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    edit(&mut cached["measured"]);
    fs::write(file, serde_json::to_string(&cached).unwrap()).unwrap();
}

#[test]
fn what_is_old_disturbed_or_contradicted_is_measured_again_and_serves_until_then() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = start(&options(folder.path()));
    learn(&mut first, &boxes(400));
    first.save().unwrap();
    let (file, learned) = (first.setup().file.clone().unwrap(), first.learned());
    let kept = fs::read_to_string(&file).unwrap();
    let days = |measured: &mut serde_json::Value, days: f64| {
        measured["at_unix_s"] = (measured["at_unix_s"].as_u64().unwrap() - (days * 86_400.0) as u64).into();
    };
    type Edit<'a> = Box<dyn Fn(&mut serde_json::Value) + 'a>;
    let edits: [(Edit<'_>, &str); 3] = [
        (Box::new(|m| days(m, 31.0)), "over 30 days old"),
        (
            Box::new(|m| {
                days(m, 1.0);
                m["disturbed"] = serde_json::json!(["a game"]);
            }),
            "disturbed: a game",
        ),
        (
            Box::new(|m| {
                days(m, 1.0);
                (m["disturbed"], m["frames_over_predicted"]) = (serde_json::json!([]), 3.0.into());
            }),
            "3.00 times as long",
        ),
    ];
    for (edit, why) in edits {
        fs::write(&file, &kept).unwrap();
        edit_measured(&file, |m| {
            m["attempt"] = 1.into();
            edit(m);
        });
        // So much time that it can't be done: what was kept runs the frames.
        let long = options(folder.path()).background(true).probe_limit(Duration::from_secs(1000));
        let mut meanwhile = start(&long);
        frames_until_it_came(&mut meanwhile);
        assert_eq!((origin(&meanwhile), meanwhile.tuning()), (Origin::Cached, &learned), "{:?}", meanwhile.setup());
        drop(meanwhile);
        let again = start(&options(folder.path()));
        let setup = again.setup();
        assert_eq!((setup.origin, again.tuning().source), (Origin::Probed, Source::Predicted));
        assert!(setup.remarks.len() == 1 && setup.remarks[0].contains(why), "{setup:?}");
        let measured = setup.measured.as_ref().unwrap();
        assert_eq!((measured.frames_over_predicted, measured.attempt), (1.0, if why.contains("days") { 1 } else { 2 }));
        assert_eq!(origin(&start(&options(folder.path()))), Origin::Cached);
    }
}

/// While what was kept decides the measurement goes on, and its end is taken over too.
#[test]
fn what_was_kept_gives_way_to_what_was_measured_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = start(&options(folder.path())).setup().file.clone().unwrap();
    edit_measured(&file, |m| m["at_unix_s"] = 1.into());
    let mut adaptive = start(&options(folder.path()).background(true));
    while origin(&adaptive) != Origin::Probed {
        assert!([Origin::Awaited, Origin::Cached].contains(&origin(&adaptive)), "{:?}", adaptive.setup());
        frame(&mut adaptive, &boxes(300));
    }
    learn(&mut adaptive, &boxes(300));
    assert!(adaptive.save().unwrap());
    assert_eq!(origin(&start(&options(folder.path()))), Origin::Cached);
}
