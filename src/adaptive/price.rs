//! What it costs to begin with an algorithm that did not run the frame before.

/// Share of a frame that the first one costs beside: memory that is no longer in a cache, threads that sleep. Learned from then on.
const COLD: f64 = 0.15;
/// The same of an algorithm that keeps work from frame to frame and has none to begin with.
const FROM_NOTHING: f64 = 1.5;

/// Frames after which an algorithm that keeps work runs as it will run: it finds its margin in them.
const SETTLES: u32 = 3;
/// Frames of absence after which what an algorithm kept is worth nothing any more.
const FORGOTTEN: u64 = 3;

/// A first frame may be disturbed: it moves the price by this share, and by no more than this factor of itself.
const SHARE: f64 = 0.25;
const MOST: f64 = 20.0;

/// A first frame tells the usual cost no better than this (variance of a logarithm).
const FIRST_FRAME_DOUBT: f64 = 0.04;

/// The prices of all candidates, as shares of their usual frames.
#[derive(Debug, Clone)]
pub(super) struct Prices(Vec<Price>);

#[derive(Debug, Clone)]
struct Price {
    keeps_work: bool,
    /// Of the first frame, over the cost of a usual one.
    first: f64,
    /// Frames since it began, and the number of the last frame that it ran.
    since: u32,
    last: Option<u64>,
}

impl Prices {
    pub(super) fn new(keeps_work: &[bool]) -> Self {
        let price = |&keeps_work: &bool| Price {
            keeps_work,
            first: if keeps_work { FROM_NOTHING } else { COLD },
            since: 0,
            last: None,
        };
        Self(keeps_work.iter().map(price).collect())
    }

    /// What the start of a candidate costs beside a usual frame of its own, as a share of that.
    pub(super) fn of(&self, candidate: usize, frame: u64) -> f64 {
        let price = &self.0[candidate];
        if price.keeps_work && price.remembers(frame) { COLD } else { price.first }
    }

    /// Takes in that a candidate ran a frame, and its time over the usual one, where prices are to be learned. Gives by how much that frame is dearer than
    /// a usual one and the doubt of that, `None` where it tells nothing of the usual cost.
    pub(super) fn ran(
        &mut self,
        candidate: usize,
        entered: bool,
        frame: u64,
        over_usual: Option<f64>,
    ) -> Option<(f64, f64)> {
        let price = &mut self.0[candidate];
        let remembers = price.remembers(frame);
        price.last = Some(frame);
        price.since = if entered { 0 } else { price.since.saturating_add(1) };
        if price.keeps_work {
            if entered && !remembers {
                price.learn(over_usual);
            }
            return (price.since >= SETTLES || remembers && entered).then_some((1.0, 0.0));
        }
        if !entered {
            return Some((1.0, 0.0));
        }
        let factor = 1.0 + price.first;
        price.learn(over_usual);
        Some((factor, FIRST_FRAME_DOUBT))
    }
}

impl Price {
    fn remembers(&self, frame: u64) -> bool {
        self.last.is_some_and(|last| frame - last <= FORGOTTEN)
    }

    fn learn(&mut self, over_usual: Option<f64>) {
        if let Some(over_usual) = over_usual.filter(|o| o.is_finite()) {
            self.first += SHARE * ((over_usual - 1.0).clamp(0.0, MOST) - self.first);
        }
    }
}
