//! Any calls on a space, against the list of bodies of the property tests; and damaged snapshots.
#![no_main]

#[path = "../../tests/common/space.rs"]
mod space;

use libfuzzer_sys::fuzz_target;
use sapwise::{Adaptive, AlgorithmId, Error, Registry, Space};
use sapwise_fuzz::json::damaged;
use std::sync::LazyLock;

static REGISTRY: LazyLock<Registry> = LazyLock::new(|| Registry::with_cores(1));
static IDS: LazyLock<Vec<AlgorithmId>> = LazyLock::new(|| REGISTRY.available().into_iter().map(|e| e.id).collect());

fuzz_target!(|bytes: &[u8]| {
    let Some((&first, bytes)) = bytes.split_first() else { return };
    let only = |at: usize| Space::with(Adaptive::only(IDS[at % IDS.len()].clone(), &REGISTRY).unwrap());
    let spaces = [only(first.into()), only(usize::from(first) / IDS.len())];
    space::run(bytes, spaces, |space| {
        let text = serde_json::to_string(space).unwrap();
        let wrong = damaged(text.as_bytes(), text.len() as u32 ^ u32::from(first)).unwrap();
        // What it holds may be wrong, but it runs.
        if let Ok(mut space) = serde_json::from_str::<Space>(&wrong) {
            space.insert(sapwise::Aabb::default(), sapwise::Body::default()).unwrap();
            for _ in 0..12 {
                match space.update() {
                    // The limit may be what was damaged.
                    Ok(_) | Err(Error::TooManyPairs { .. }) => {}
                    Err(error) => panic!("{error}"),
                }
            }
            serde_json::to_string(&space).unwrap();
        }
        serde_json::from_str(&text).unwrap()
    });
});
