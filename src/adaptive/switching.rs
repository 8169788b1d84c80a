//! What a switch costs: a frame in which an algorithm has nothing to build upon, its first one or one in which it makes again what it keeps.

/// Share of a frame that the first one costs beside: memory that is no longer in a cache, threads that sleep. Learned from then on.
const COLD: f64 = 0.15;
/// A frame made again by an incremental algorithm, over a frame of the other way that its cost curve knows, or over a frame of its own
/// where there is no other way. `pair-cache` over `bvh`, its other way: medians 1.6 to 1.9, quartiles 1.4 to 3.0, in four reports of the two
/// hosts of `datasets/` (frames over 2.5 times the median of their timing, where these are less than a fifth of its frames). Rather more: a
/// first frame is colder than these.
const FROM_NOTHING: f64 = 2.0;

/// Frames of absence after which what an algorithm kept is worth nothing any more.
const FORGOTTEN: u64 = 3;

/// A frame made again may be disturbed: it moves the cost by this share, and by no more than this factor of itself.
const SHARE: f64 = 0.25;
const MOST: f64 = 4.0;

/// Share of the frames that are made again, before any was seen, and share of each frame in it. Cost curves come from medians, which leave
/// those frames out.
const REBUILDS: f64 = 0.02;
const REBUILDS_SHARE: f64 = 1.0 / 32.0;
/// Frames after which half of what was seen of that share is forgotten, where nobody looks: what grew may shrink.
const REBUILDS_FRAMES: f64 = 60.0;
/// Only what is at least so much dearer than a frame that builds on the one before can be told from it.
const TOLD_APART: f64 = 2.0;
/// Where more than this share of the frames look like rebuilds, the expected cost is too low and not every frame a rebuild. They count as
/// usual frames then: else nothing would ever be learned on a machine that is slower than it was predicted.
const MOST_REBUILDS: f64 = 0.5;

/// What it costs to switch to each of the candidates.
#[derive(Debug, Clone)]
pub(super) struct SwitchingCosts {
    costs: Vec<SwitchingCost>,
    kept: Vec<KeptWork>,
}

#[derive(Debug, Clone)]
struct SwitchingCost {
    /// Where it finds what the frame before left: a position in `SwitchingCosts::kept`. `None` where every frame is made from scratch.
    kept: Option<usize>,
    /// A frame with nothing to build upon over one of the other way.
    over: f64,
}

/// What is kept from frame to frame, by one algorithm on any number of threads.
#[derive(Debug, Clone)]
struct KeptWork {
    /// The number of the frame that kept it last.
    last: Option<u64>,
    /// Share of the frames that make it again. It is the scene's, on whatever number of threads.
    rebuilds: f64,
}

impl KeptWork {
    fn rebuilds_at(&self, frame: u64) -> f64 {
        let aged = self.last.map_or(0.0, |last| frame.saturating_sub(last + 1) as f64 / REBUILDS_FRAMES);
        REBUILDS + (self.rebuilds - REBUILDS) / (1.0 + aged)
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
    /// All was made again, though the frame before had left something.
    Rebuilt,
    /// As most are.
    Usual,
}

impl SwitchingCosts {
    /// `kept` as [`Policy::new`](super::policy::Policy::new) has it.
    pub(super) fn new(kept: &[Option<usize>]) -> Self {
        let cost =
            |&kept: &Option<usize>| SwitchingCost { kept, over: if kept.is_some() { FROM_NOTHING } else { 1.0 + COLD } };
        let works = kept.iter().flatten().max().map_or(0, |most| most + 1);
        Self { costs: kept.iter().map(cost).collect(), kept: vec![KeptWork { last: None, rebuilds: REBUILDS }; works] }
    }

    /// Other instances keep, shared by the same candidates as before, nothing yet. False where other candidates share it.
    pub(super) fn remade(&mut self, kept: &[Option<usize>]) -> bool {
        self.kept.iter_mut().for_each(|work| work.last = None);
        self.costs.iter().map(|p| p.kept).eq(kept.iter().copied())
    }

    /// Whether a candidate keeps work from frame to frame.
    pub(super) fn keeps(&self, candidate: usize) -> bool {
        self.costs[candidate].kept.is_some()
    }

    /// Whether a candidate finds what another one keeps.
    pub(super) fn share(&self, candidate: usize, other: usize) -> bool {
        self.keeps(candidate) && self.costs[candidate].kept == self.costs[other].kept
    }

    /// A candidate ran all frames up to this one.
    pub(super) fn went_on(&mut self, candidate: usize, frame: u64) {
        if let Some(work) = self.costs[candidate].kept.map(|k| &mut self.kept[k]) {
            work.last = work.last.max(Some(frame));
        }
    }

    /// What a frame of a candidate takes in the mean, those included that are made again.
    pub(super) fn mean_ns(&self, candidate: usize, frame: u64, expected: Expected) -> f64 {
        let share = self.costs[candidate].kept.map_or(0.0, |work| self.kept[work].rebuilds_at(frame));
        expected.built_ns + share * (self.rebuild_ns(candidate, expected) - expected.built_ns)
    }

    /// What the first frame of a candidate is expected to take, were it to begin now.
    pub(super) fn first_ns(&self, candidate: usize, frame: u64, expected: Expected) -> f64 {
        if self.remembers(candidate, frame) {
            self.mean_ns(candidate, frame, expected) * (1.0 + COLD)
        } else {
            self.rebuild_ns(candidate, expected)
        }
    }

    /// What a frame of a candidate takes in which it has nothing to build upon.
    pub(super) fn rebuild_ns(&self, candidate: usize, expected: Expected) -> f64 {
        (self.costs[candidate].over * expected.alone_ns).max(expected.built_ns)
    }

    /// Takes in that a candidate ran a frame and what that took, after one that another ran if `entered`. `learns`: costs are to be
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
        let rebuild_ns = self.rebuild_ns(candidate, expected);
        let cost = &mut self.costs[candidate];
        let mut kind = if first { Kind::First } else { Kind::Usual };
        if let Some(work) = cost.kept.map(|k| &mut self.kept[k]) {
            work.rebuilds = work.rebuilds_at(frame);
            work.last = Some(frame);
            // Half-way between the two kinds, as ratios go.
            let apart = rebuild_ns > TOLD_APART * expected.built_ns && work.rebuilds < MOST_REBUILDS;
            let rebuilt = apart && ns * ns > rebuild_ns * expected.built_ns;
            if !first {
                work.rebuilds += if learns { REBUILDS_SHARE * (f64::from(u8::from(rebuilt)) - work.rebuilds) } else { 0.0 };
                kind = if rebuilt { Kind::Rebuilt } else { kind };
            }
        }
        if kind != Kind::Usual && learns {
            let seen = (ns / expected.alone_ns).clamp(1.0, MOST * cost.over);
            cost.over += if seen.is_finite() { SHARE * (seen - cost.over) } else { 0.0 };
        }
        kind
    }

    fn remembers(&self, candidate: usize, frame: u64) -> bool {
        let last = self.costs[candidate].kept.and_then(|work| self.kept[work].last);
        last.is_some_and(|last| frame - last <= FORGOTTEN)
    }
}
