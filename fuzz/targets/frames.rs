//! Any boxes, filters, limits and orders from frame to frame: every method, `Adaptive` and
//! `Changes` against the definitions.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sapwise::Changes;
use sapwise_fuzz::Source;
use sapwise_fuzz::checked::Checked;
use sapwise_fuzz::oracle::of_ids;
use sapwise_fuzz::scene::Scene;
use std::collections::BTreeSet;

/// Most frames, and most pairs of boxes that the oracle tests in all of them.
const MOST: (usize, usize) = (12, 3_000_000);

fuzz_target!(|bytes: &[u8]| {
    let mut source = Source::new(bytes);
    let mut checked = Checked::of(&mut source);
    let mut scene = Scene::default();
    let mut ids = source.random();
    let (mut changes, mut before) = (Changes::new(), BTreeSet::new());
    let (mut frames, mut tests) = (0, 0);
    while !source.is_empty() && frames < MOST.0 && tests < MOST.1 {
        if source.byte() % 4 < 2 {
            scene.edit(&mut source);
        }
        let runs = source.byte();
        for _ in 0..if runs < 128 { 1 } else { runs % 4 } {
            frames += 1;
            tests += scene.boxes().len() * scene.boxes().len() / 2;
            let Some(pairs) = checked.frame(&mut scene) else { continue };
            let named: Vec<u8> = scene.boxes().iter().map(|_| ids.below(200) as u8).collect();
            changes.update(&pairs, &named).unwrap();
            let now = of_ids(pairs.as_slice(), &named);
            assert!(changes.begun().iter().eq(now.difference(&before)), "begun");
            assert!(changes.ended().iter().eq(before.difference(&now)), "ended");
            before = now;
        }
    }
});
