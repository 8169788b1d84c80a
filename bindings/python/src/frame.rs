//! The frames of a `BroadPhase`.

use crate::engine::flat;
use crate::{Searcher, Start};
use sapwise::{Aabb, Adaptive, BroadPhase, Changes, Error, Filter, Membership, Pairs};
use std::sync::{Arc, RwLock};

/// The ids of the boxes of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Ids {
    /// The positions of the boxes.
    Positions,
    /// The caller's id of each box.
    Given(Vec<i64>),
}

/// The pairs of a frame, and the ids of its boxes.
struct Frame {
    pairs: Pairs,
    ids: Ids,
}

/// The changes between two frames, by positions or by ids.
enum Follower {
    Positions(Changes<u32>),
    Given(Changes<i64>),
}

/// Pairs of numbers, flat as in NumPy.
pub(crate) enum Flat {
    Positions(Vec<u32>),
    Given(Vec<i64>),
}

/// The broad phase, its last two frames, and the changes between them.
pub(crate) struct Frames {
    adaptive: Adaptive,
    frames: [Frame; 2],
    /// The position in `frames` of the last frame that succeeded.
    now: usize,
    /// Number of frames that succeeded, and how many of them the follower has seen. It is updated only when the caller
    /// asks.
    count: u64,
    followed: u64,
    follower: Follower,
    /// The last call failed: nothing has begun or ended.
    failed: bool,
    /// The filter of the lists.
    filter: Option<Arc<Vec<Membership>>>,
}

impl Searcher for Frames {
    const CLASS: &'static str = "BroadPhase";
    const UNUSED: &'static str = "no frame yet";

    fn forked(_: &RwLock<Self>, adaptive: Adaptive, start: &Start) -> Result<Self, String> {
        Ok(Self::new(adaptive, start))
    }

    fn adaptive(&self) -> &Adaptive {
        &self.adaptive
    }
}

impl Frames {
    pub(crate) fn new(adaptive: Adaptive, start: &Start) -> Self {
        let frame = || Frame { pairs: start.pairs(), ids: Ids::Positions };
        Self {
            adaptive,
            frames: [frame(), frame()],
            now: 0,
            count: 0,
            followed: 0,
            follower: Follower::Positions(Changes::new()),
            failed: false,
            filter: None,
        }
    }

    /// Returns whether the previous frame had the other kind of ids.
    pub(crate) fn has_other_ids(&self, ids: &Ids) -> bool {
        self.count > 0 && std::mem::discriminant(ids) != std::mem::discriminant(&self.frames[self.now].ids)
    }

    /// The next frame was refused: nothing has begun or ended.
    pub(crate) fn fail(&mut self) {
        self.failed = true;
    }

    /// Finds the pairs of the next frame.
    pub(crate) fn find(
        &mut self,
        boxes: &[Aabb],
        ids: Ids,
        filter: Option<&Arc<Vec<Membership>>>,
    ) -> Result<Vec<u32>, Error> {
        let same = match (&self.filter, filter) {
            (None, None) => true,
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            _ => false,
        };
        if !same {
            let filter = filter.cloned();
            for frame in &mut self.frames {
                frame.pairs.set_filter(filter.as_ref().map(|f| Filter::new(f.to_vec())));
            }
            self.filter = filter;
        }
        let next = &mut self.frames[1 - self.now];
        // From here on the older frame is lost, also if this one fails.
        self.failed = true;
        self.adaptive.find_pairs(boxes, &mut next.pairs)?;
        next.ids = ids;
        let numbers = flat(&next.pairs, 0)?;
        self.failed = false;
        self.now = 1 - self.now;
        self.count += 1;
        Ok(numbers)
    }

    /// Updates the follower to the last frame.
    fn follow(&mut self) -> Result<(), Error> {
        if self.followed == self.count {
            return Ok(());
        }
        let [now, before] = [&self.frames[self.now], &self.frames[1 - self.now]];
        // Nobody asked after the previous frame.
        let skipped = self.followed + 1 < self.count;
        if self.followed == 0 {
            self.follower = match &now.ids {
                Ids::Positions => Follower::Positions(Changes::new()),
                Ids::Given(_) => Follower::Given(Changes::new()),
            };
        }
        for frame in skipped.then_some(before).into_iter().chain([now]) {
            match (&mut self.follower, &frame.ids) {
                (Follower::Positions(changes), Ids::Positions) => changes.update_positions(&frame.pairs)?,
                (Follower::Given(changes), Ids::Given(ids)) => changes.update(&frame.pairs, ids)?,
                // `find` of the class refuses such frames.
                _ => unreachable!("a frame has the kind of ids of the previous one"),
            }
        }
        self.followed = self.count;
        Ok(())
    }

    /// Returns the pairs that began with the last frame, or those that ended.
    pub(crate) fn changed(&mut self, begun: bool) -> Result<Flat, Error> {
        if self.failed || self.count == 0 {
            return Ok(match self.frames[self.now].ids {
                Ids::Positions => Flat::Positions(Vec::new()),
                Ids::Given(_) => Flat::Given(Vec::new()),
            });
        }
        self.follow()?;
        Ok(match &self.follower {
            Follower::Positions(c) => Flat::Positions(numbers(c, begun)),
            Follower::Given(c) => Flat::Given(numbers(c, begun)),
        })
    }
}

fn numbers<Id: Copy + Ord>(changes: &Changes<Id>, begun: bool) -> Vec<Id> {
    let pairs = if begun { changes.begun() } else { changes.ended() };
    pairs.iter().flat_map(|&(a, b)| [a, b]).collect()
}
