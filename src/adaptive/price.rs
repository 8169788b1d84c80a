//! What frames cost in which an algorithm has nothing to build upon: its first one, and those in which it makes anew what it keeps.

/// Share of a frame that the first one costs beside: memory that is no longer in a cache, threads that sleep. Learned from then on.
const COLD: f64 = 0.15;
/// A frame made anew by an algorithm that keeps work, over a frame of the other way that its cost curve knows, or over a frame of its own
/// where there is no other way. `pair-cache` over `grid-sap` on one thread: 1.0 to 2.7 at 100 to 30 000 objects of four scenarios.
const FROM_NOTHING: f64 = 2.0;

/// Frames of absence after which what an algorithm kept is worth nothing any more.
const FORGOTTEN: u64 = 3;

/// A frame made anew may be disturbed: it moves the price by this share, and by no more than this factor of itself.
const SHARE: f64 = 0.25;
const MOST: f64 = 4.0;

/// Share of the frames that are made anew, before any was seen, and share of each frame in it. Cost curves come from medians, which leave
/// those frames out.
const ANEW: f64 = 0.02;
const ANEW_SHARE: f64 = 1.0 / 32.0;
/// Frames after which half of what was seen of that share is forgotten, where nobody looks: what grew may shrink.
const ANEW_FRAMES: f64 = 60.0;
/// Only what is at least so much dearer than a frame that builds on the one before can be told from it.
const TOLD_APART: f64 = 2.0;

/// The prices of all candidates.
#[derive(Debug, Clone)]
pub(super) struct Prices {
    prices: Vec<Price>,
    places: Vec<Place>,
}

#[derive(Debug, Clone)]
struct Price {
    /// Where it finds what the frame before left: a position in `places`. `None` where every frame is made from scratch.
    kept: Option<usize>,
    /// A frame with nothing to build upon over one of the other way.
    anew: f64,
}

/// What is kept from frame to frame, by one algorithm on any number of threads.
#[derive(Debug, Clone)]
struct Place {
    /// The number of the frame that kept it last.
    last: Option<u64>,
    /// Share of the frames that make it anew. It is the scene's, on whatever number of threads.
    anew: f64,
}

impl Place {
    fn anew_at(&self, frame: u64) -> f64 {
        let aged = self.last.map_or(0.0, |last| frame.saturating_sub(last + 1) as f64 / ANEW_FRAMES);
        ANEW + (self.anew - ANEW) / (1.0 + aged)
    }
}

/// What a candidate is expected to cost, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    /// A frame that builds on the one before, as most do.
    pub(super) built_ns: f64,
    /// A frame without the help of the frame before, as the other way of its curve has it; the same where there is one way only.
    pub(super) alone_ns: f64,
}

/// What kind of frame it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The first of a candidate, with nothing to build upon.
    First,
    /// All was made anew, though the frame before had left something.
    Anew,
    /// As most are.
    Usual,
}

impl Prices {
    /// `kept` as [`Policy::new`](super::policy::Policy::new) has it.
    pub(super) fn new(kept: &[Option<usize>]) -> Self {
        let price = |&kept: &Option<usize>| Price { kept, anew: if kept.is_some() { FROM_NOTHING } else { 1.0 + COLD } };
        let places = kept.iter().flatten().max().map_or(0, |most| most + 1);
        Self { prices: kept.iter().map(price).collect(), places: vec![Place { last: None, anew: ANEW }; places] }
    }

    /// Other instances keep, in the same places as those of before, nothing yet. False where the places are others.
    pub(super) fn remade(&mut self, kept: &[Option<usize>]) -> bool {
        self.places.iter_mut().for_each(|place| place.last = None);
        self.prices.iter().map(|p| p.kept).eq(kept.iter().copied())
    }

    /// A candidate ran all frames up to this one.
    pub(super) fn went_on(&mut self, candidate: usize, frame: u64) {
        if let Some(place) = self.prices[candidate].kept.map(|k| &mut self.places[k]) {
            place.last = place.last.max(Some(frame));
        }
    }

    /// What a frame of a candidate takes in the mean, those included that are made anew.
    pub(super) fn mean_ns(&self, candidate: usize, frame: u64, expected: Expected) -> f64 {
        let share = self.prices[candidate].kept.map_or(0.0, |place| self.places[place].anew_at(frame));
        expected.built_ns + share * (self.anew_ns(candidate, expected) - expected.built_ns)
    }

    /// What the first frame of a candidate is expected to take, were it to begin now.
    pub(super) fn first_ns(&self, candidate: usize, frame: u64, expected: Expected) -> f64 {
        if self.remembers(candidate, frame) {
            self.mean_ns(candidate, frame, expected) * (1.0 + COLD)
        } else {
            self.anew_ns(candidate, expected)
        }
    }

    /// What a frame of a candidate takes in which it has nothing to build upon.
    pub(super) fn anew_ns(&self, candidate: usize, expected: Expected) -> f64 {
        (self.prices[candidate].anew * expected.alone_ns).max(expected.built_ns)
    }

    /// Takes in that a candidate ran a frame and what that took, after one that another ran if `entered`. `learns`: prices are to be
    /// learned.
    pub(super) fn ran(
        &mut self,
        candidate: usize,
        entered: bool,
        frame: u64,
        ns: f64,
        expected: Expected,
        learns: bool,
    ) -> Kind {
        let first = entered && !self.remembers(candidate, frame);
        let anew_ns = self.anew_ns(candidate, expected);
        let price = &mut self.prices[candidate];
        let mut kind = if first { Kind::First } else { Kind::Usual };
        if let Some(place) = price.kept.map(|k| &mut self.places[k]) {
            place.anew = place.anew_at(frame);
            place.last = Some(frame);
            // Half-way between the two kinds, as ratios go.
            let anew = anew_ns > TOLD_APART * expected.built_ns && ns * ns > anew_ns * expected.built_ns;
            if !first {
                place.anew += if learns { ANEW_SHARE * (f64::from(u8::from(anew)) - place.anew) } else { 0.0 };
                kind = if anew { Kind::Anew } else { kind };
            }
        }
        if kind != Kind::Usual && learns {
            let over = (ns / expected.alone_ns).clamp(1.0, MOST * price.anew);
            price.anew += if over.is_finite() { SHARE * (over - price.anew) } else { 0.0 };
        }
        kind
    }

    fn remembers(&self, candidate: usize, frame: u64) -> bool {
        let last = self.prices[candidate].kept.and_then(|place| self.places[place].last);
        last.is_some_and(|last| frame - last <= FORGOTTEN)
    }
}
