//! What is left for some frames when one costs far more than was expected, and more than the tree would, whose cost follows the numbers of boxes and pairs
//! alone: the cheapest of the other methods runs, most often the tree.

use crate::algorithm::AlgorithmId;

/// The name of a method that is cheap enough wherever the boxes lie. Where a tuning has no cost of one, there is no shelter.
const METHOD: &str = "bvh";

/// A frame is dear that costs this many times what was expected of it, and as many times what the shelter is expected to cost.
const DEAR: f64 = 3.0;

/// Frames for which a method is not run after its dear frame, and by how much and up to what that grows with each further one. Another
/// program on a core makes one frame dear: it costs one frame in the shelter.
const PAUSE: u32 = 1;
const GROWTH: u32 = 4;
const MOST_PAUSE: u32 = 1024;

/// Frames after such a pause, after which a dear one is the first again.
const FORGIVEN: u64 = 64;

/// Which methods are not run for now.
#[derive(Debug, Clone)]
pub(super) struct Shelter {
    /// Of each candidate the number of its method, on whatever processor and number of threads: they share what makes a frame dear.
    methods: Vec<usize>,
    /// Of each candidate whether it is a shelter.
    shelters: Vec<bool>,
    pauses: Vec<Pause>,
}

/// Of one method.
#[derive(Debug, Clone, Copy)]
struct Pause {
    /// The first frame in which it may run again.
    until: u64,
    /// How long the next pause is.
    next: u32,
}

impl Shelter {
    pub(super) fn new<'a>(ids: impl Iterator<Item = &'a AlgorithmId>) -> Self {
        let mut names: Vec<&str> = Vec::new();
        let (mut methods, mut shelters) = (Vec::new(), Vec::new());
        for id in ids {
            let known = names.iter().position(|name| *name == id.method());
            methods.push(known.unwrap_or(names.len()));
            if known.is_none() {
                names.push(id.method());
            }
            shelters.push(id.method() == METHOD);
        }
        Self { methods, shelters, pauses: vec![Pause { until: 0, next: PAUSE }; names.len()] }
    }

    pub(super) fn is_shelter(&self, candidate: usize) -> bool {
        self.shelters[candidate]
    }

    /// Whether a candidate is not to run in this frame.
    pub(super) fn avoids(&self, candidate: usize, frame: u64) -> bool {
        self.lasts(candidate, frame) > 0
    }

    /// Frames from this one until a candidate may run again.
    pub(super) fn lasts(&self, candidate: usize, frame: u64) -> u64 {
        self.pauses[self.methods[candidate]].until.saturating_sub(frame)
    }

    /// Takes in that a candidate ran a frame of which `expected_ns` was expected, while a shelter would have taken `shelter_ns`. Whether the
    /// next frame is not to be spent on it.
    pub(super) fn ran(&mut self, candidate: usize, frame: u64, ns: f64, expected_ns: f64, shelter_ns: f64) -> bool {
        let pause = &mut self.pauses[self.methods[candidate]];
        let dear = !self.shelters[candidate] && ns > DEAR * expected_ns.max(shelter_ns);
        if dear {
            // Counted by the number of the frame: those without a decision are not told one by one.
            if frame >= pause.until + FORGIVEN {
                pause.next = PAUSE;
            }
            pause.until = frame + 1 + u64::from(pause.next);
            pause.next = (pause.next * GROWTH).min(MOST_PAUSE);
        }
        dear
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shelter() -> Shelter {
        let ids: Vec<AlgorithmId> =
            ["grid-sap@cpu1", "grid-sap@cpu2", "bvh@cpu1", "sap@cpu1"].map(|id| id.parse().unwrap()).into();
        Shelter::new(ids.iter())
    }

    #[test]
    fn a_method_that_is_always_dear_runs_ever_more_seldom_and_the_shelter_is_never_avoided() {
        let mut shelter = shelter();
        let mut ran = Vec::new();
        for frame in 0..10_000 {
            if !shelter.avoids(1, frame) {
                assert!(shelter.ran(0, frame, 100.0, 10.0, 20.0) && shelter.avoids(0, frame + 1));
                ran.push(frame);
            }
            assert!(
                !shelter.ran(2, frame, 1000.0, 10.0, 10.0) && !shelter.avoids(2, frame) && !shelter.avoids(3, frame)
            );
        }
        assert_eq!(ran[..5], [0, 2, 7, 24, 89]);
        assert!(ran.len() < 20, "{ran:?}");
    }

    #[test]
    fn one_disturbed_frame_costs_one_frame_in_the_shelter_however_often_that_comes() {
        let mut shelter = shelter();
        let mut avoided = 0;
        for frame in 0..1000 {
            if shelter.avoids(0, frame) {
                avoided += 1;
            } else {
                // Most frames go on without a decision, and are not told.
                if frame % 100 == 7 || frame % 30 == 0 {
                    shelter.ran(0, frame, if frame % 100 == 7 { 1.0e9 } else { 10.0 }, 10.0, 20.0);
                }
            }
        }
        assert_eq!(avoided, 10);
        // What is no dearer than a few frames of the shelter is left to the learner.
        assert!(!shelter.ran(0, 1001, 59.0, 10.0, 20.0));
    }
}
