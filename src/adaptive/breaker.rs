//! The circuit breaker: suspends a method after a frame that cost far more than expected, and more than a tree would.

/// A frame trips the breaker if it takes this many times the expected cost, and this many times the expected cost of
/// the tree, whose cost depends on the numbers of boxes and pairs alone.
const TRIPS: f64 = 3.0;

/// Frames of the first suspension, the factor for each further one, and the most. One co-runner's time slice costs
/// one frame of the tree; a scene that makes a method quadratic suspends it for good.
const FIRST: u64 = 1;
const GROWTH: u64 = 4;
const MOST: u64 = 1024;

/// Frames after a suspension without another one, after which the next is a first one again.
const FORGIVEN: u64 = 64;

/// The suspension of one method, on any processor and number of threads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Breaker {
    /// First frame in which the method may run again.
    pub(super) until: u64,
    next: u64,
}

impl Breaker {
    pub(super) fn new() -> Self {
        Self { until: 0, next: FIRST }
    }

    /// Takes in a frame of the method, numbered `frame`. Returns whether that suspends it.
    pub(super) fn trips(&mut self, frame: u64, ns: f64, expected_ns: f64, tree_ns: f64) -> bool {
        let trips = ns > TRIPS * expected_ns.max(tree_ns);
        if trips {
            if frame >= self.until + FORGIVEN {
                self.next = FIRST;
            }
            self.until = frame + 1 + self.next;
            self.next = (self.next * GROWTH).min(MOST);
        }
        trips
    }
}
