//! Any bytes as a recorded stream of boxes: all methods find the same pairs, and a valid stream reads back as it was
//! written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sapwise::{BroadPhase, Error, Pairs, Registry};
use sapwise_scenes::{FrameWriter, Frames};
use std::sync::LazyLock;

static REGISTRY: LazyLock<Registry> = LazyLock::new(|| Registry::with_cores(1));

fuzz_target!(|bytes: &[u8]| {
    let Ok(frames) = Frames::parse(bytes, bytes.len() as u64) else { return };
    let mut ids = REGISTRY.available().into_iter().map(|e| e.id);
    let mut first = REGISTRY.create(&ids.next().unwrap()).unwrap();
    let mut others: Vec<Box<dyn BroadPhase>> = ids.map(|id| REGISTRY.create(&id).unwrap()).collect();
    let sound = frames.check();
    let (mut expected, mut found) = (Pairs::new(), Pairs::new());
    let mut invalid = None;
    for (at, boxes) in frames.iter().enumerate().take(20) {
        let right = first.find_pairs(boxes, &mut expected);
        for other in &mut others {
            assert_eq!(other.find_pairs(boxes, &mut found), right);
            assert!(right.is_err() || found.fingerprint() == expected.fingerprint());
        }
        if let (Err(Error::InvalidBox { .. }), None) = (&right, invalid) {
            invalid = Some(at);
        }
    }
    match (sound, invalid) {
        (Err(told), Some(at)) => assert_eq!(told.frame, at),
        (Err(told), None) => assert!(told.frame >= 20),
        (Ok(()), found) => {
            assert_eq!(found, None);
            let mut writer = FrameWriter::new(Vec::new(), frames.len(), frames.objects()).unwrap();
            frames.iter().for_each(|boxes| writer.write(boxes).unwrap());
            let written = writer.finish().unwrap();
            assert_eq!(Frames::parse(&written[..], written.len() as u64).unwrap(), frames);
        }
    }
});
