//! What is left for some frames when one costs far more than was expected, and more than the tree would, whose cost
//! follows the numbers of boxes and pairs alone: the cheapest of the other methods runs, most often the tree.

use crate::algorithm::AlgorithmId;

/// The name of a method that is cheap enough wherever the boxes lie. Where a tuning has no cost of one, there is no
/// shelter.
const METHOD: &str = "bvh";

/// A frame is dear that costs this many times what was expected of it, and as many times what the shelter is expected
/// to cost.
const DEAR: f64 = 3.0;

/// Frames for which a method is not run after its dear frame, and by how much and up to what that grows with each
/// further one. Another program on a core makes one frame dear: it costs one frame in the shelter.
const PAUSE: u32 = 1;
const GROWTH: u32 = 4;
const MOST_PAUSE: u32 = 1024;

/// Frames after such a pause, after which a dear one is the first again.
const FORGIVEN: u64 = 64;

/// Which methods are not run for now.
#[derive(Debug, Clone)]
pub(super) struct Shelter {
    /// Of each candidate the number of its method, on whatever processor and number of threads: they share what makes
    /// a frame dear.
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

    /// Takes in that a candidate ran a frame of which `expected_ns` was expected, while a shelter would have taken
    /// `shelter_ns`. Whether the next frame is not to be spent on it.
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
