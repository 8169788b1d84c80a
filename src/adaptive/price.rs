//! What it costs to begin with an algorithm that did not run the frame before.

/// Share of a frame that the first one costs beside: memory that is no longer in a cache, threads that sleep. Learned from then on.
const COLD: f64 = 0.15;
/// First frame of an algorithm that keeps work and has none to begin with, over a frame of the other way that its cost curve knows, or over
/// a frame of its own where there is no other way. `verlet` over `strips` on one thread: 1.0 to 2.7 at 100 to 30 000 objects of four
/// scenarios.
const FROM_NOTHING: f64 = 2.0;

/// Frames of absence after which what an algorithm kept is worth nothing any more.
const FORGOTTEN: u64 = 3;

/// A first frame may be disturbed: it moves the price by this share, and by no more than this factor of itself.
const SHARE: f64 = 0.25;
const MOST: f64 = 4.0;

/// The prices of all candidates.
#[derive(Debug, Clone)]
pub(super) struct Prices {
    prices: Vec<Price>,
    /// For each place where something is kept, the number of the frame that kept it last.
    last: Vec<Option<u64>>,
}

#[derive(Debug, Clone)]
struct Price {
    /// Where it finds what the frame before left: a position in `last`. `None` where every frame is made from scratch.
    kept: Option<usize>,
    /// The first frame over a frame of the other way.
    first: f64,
}

/// What a candidate is expected to cost, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    /// A usual frame.
    pub(super) usual_ns: f64,
    /// A frame without the help of the frame before, as the other way of its curve has it; the same where there is one way only.
    pub(super) alone_ns: f64,
}

impl Prices {
    /// `kept` as [`Policy::new`](super::policy::Policy::new) has it.
    pub(super) fn new(kept: &[Option<usize>]) -> Self {
        let price = |&kept: &Option<usize>| Price { kept, first: if kept.is_some() { FROM_NOTHING } else { 1.0 + COLD } };
        let places = kept.iter().flatten().max().map_or(0, |most| most + 1);
        Self { prices: kept.iter().map(price).collect(), last: vec![None; places] }
    }

    /// What the first frame of a candidate is expected to take, were it to begin now, in nanoseconds.
    pub(super) fn first_ns(&self, candidate: usize, frame: u64, expected: Expected) -> f64 {
        if self.remembers(candidate, frame) { expected.usual_ns * (1.0 + COLD) } else { self.anew_ns(candidate, expected) }
    }

    /// What a frame of a candidate takes in which it has nothing to build upon, in nanoseconds.
    pub(super) fn anew_ns(&self, candidate: usize, expected: Expected) -> f64 {
        (self.prices[candidate].first * expected.alone_ns).max(expected.usual_ns)
    }

    /// Takes in that a candidate ran a frame and what that took, after one that another ran if `entered`. `learns`: prices are to be
    /// learned. Gives whether the frame is one of its usual ones.
    pub(super) fn ran(
        &mut self,
        candidate: usize,
        entered: bool,
        frame: u64,
        ns: f64,
        expected: Expected,
        learns: bool,
    ) -> bool {
        let remembers = self.remembers(candidate, frame);
        let price = &mut self.prices[candidate];
        if let Some(place) = price.kept {
            self.last[place] = Some(frame);
        }
        if entered && !remembers && learns {
            let over = (ns / expected.alone_ns).clamp(1.0, MOST * price.first);
            price.first += if over.is_finite() { SHARE * (over - price.first) } else { 0.0 };
        }
        !entered || remembers
    }

    fn remembers(&self, candidate: usize, frame: u64) -> bool {
        let last = self.prices[candidate].kept.and_then(|place| self.last[place]);
        last.is_some_and(|last| frame - last <= FORGOTTEN)
    }
}
