//! How long a sample takes.

use crate::sweep::WARM_UP;
use sapwise::{AlgorithmId, BackendClass, Registry};
use std::time::Duration;

/// Frames are timed for this long, so that a median of short ones stands on thousands, from more than one tick of the scheduler.
pub const TIMED: Duration = Duration::from_millis(15);

/// Frames that are timed at least, however long they take.
pub const FEWEST_FRAMES: usize = 3;

/// Time to make a scene and to advance it by a frame, for each object: what `uniform` takes on the first machine, rounded up.
const START_NS: f64 = 60.0;
const ADVANCE_NS: f64 = 15.0;

/// Time of a sample beside scene and frames: orders and answers.
const FIXED_NS: f64 = 0.5e6;

/// The first frame allocates buffers and wakes threads.
const FIRST_FRAME: f64 = 3.0;

/// What a sample needs beside the frames that are timed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Objects of its scene.
    pub objects: u32,
    /// Whether the algorithm is incremental.
    pub is_incremental: bool,
}

impl Effort {
    /// How long a sample will take where a frame takes `ns`.
    pub fn seconds(self, ns: f64) -> f64 {
        let objects = f64::from(self.objects);
        let frame = ns + objects * ADVANCE_NS;
        let before = FIRST_FRAME + if self.is_incremental { WARM_UP as f64 } else { 0.0 };
        let timed = (FEWEST_FRAMES as f64 * frame).max(TIMED.as_nanos() as f64);
        (FIXED_NS + objects * START_NS + before * frame + timed) / 1e9
    }
}

/// The incremental methods on the CPU.
#[derive(Debug)]
pub struct IncrementalMethods(Vec<String>);

impl IncrementalMethods {
    /// Those of this library.
    #[must_use]
    pub fn find() -> Self {
        // A registry of one core makes its algorithms without threads.
        let registry = Registry::with_cores(1);
        let is_incremental = |id: &AlgorithmId| registry.create(id).is_ok_and(|mut a| a.is_incremental());
        Self(
            registry
                .entries()
                .iter()
                .map(|e| &e.id)
                .filter(|id| is_incremental(id))
                .map(|id| id.method().to_owned())
                .collect(),
        )
    }

    /// Whether an algorithm is one of them.
    #[must_use]
    pub fn contain(&self, algorithm: &AlgorithmId) -> bool {
        algorithm.backend().class() == BackendClass::Cpu && self.0.iter().any(|m| m == algorithm.method())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_of_an_incremental_algorithm_takes_the_frames_of_its_warm_up_longer() {
        let effort = |is_incremental| Effort { objects: 100_000, is_incremental };
        let [without, with] = [false, true].map(|k| effort(k).seconds(1e6));
        assert!((with - without - WARM_UP as f64 * 2.5e-3).abs() < 1e-9, "{with} {without}");
        let methods = IncrementalMethods::find();
        let of = |id: &str| methods.contain(&id.parse().unwrap());
        assert!(of("pair-cache@cpu1") && of("pair-cache@cpu8") && !of("grid-sap@cpu1") && !of("pair-cache@gpu0"));
    }
}
