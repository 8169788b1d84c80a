//! The frames of a `BroadPhase`.

use crate::engine::flat;
use crate::{Searcher, Start};
use sapwise::{Aabb, Adaptive, BroadPhase, Changes, Error, Filter, Membership, Pairs};
use std::sync::{Arc, RwLock};

/// The pairs of a frame, and the caller's ids of its boxes.
struct Frame {
    pairs: Pairs,
    ids: Option<Vec<i64>>,
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
    /// Number of frames that succeeded, and how many of them the changes have seen. They are updated only when the
    /// caller asks.
    count: u64,
    followed: u64,
    /// The changes of frames without ids, and of those with ids: only one of the two is in use.
    by_position: Changes<u32>,
    by_id: Changes<i64>,
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
        let frame = || Frame { pairs: start.pairs(), ids: None };
        Self {
            adaptive,
            frames: [frame(), frame()],
            now: 0,
            count: 0,
            followed: 0,
            by_position: Changes::new(),
            by_id: Changes::new(),
            failed: false,
            filter: None,
        }
    }

    /// Returns whether only one of the previous frame and the next one has ids.
    pub(crate) fn has_other_ids(&self, ids: bool) -> bool {
        self.count > 0 && ids != self.frames[self.now].ids.is_some()
    }

    /// The next frame was refused: nothing has begun or ended.
    pub(crate) fn fail(&mut self) {
        self.failed = true;
    }

    /// Finds the pairs of the next frame.
    pub(crate) fn find(
        &mut self,
        boxes: &[Aabb],
        ids: Option<Vec<i64>>,
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

    /// Updates the changes to the last frame.
    fn follow(&mut self) -> Result<(), Error> {
        if self.followed == self.count {
            return Ok(());
        }
        let [now, before] = [&self.frames[self.now], &self.frames[1 - self.now]];
        // Nobody asked after the previous frame.
        let skipped = self.followed + 1 < self.count;
        for frame in skipped.then_some(before).into_iter().chain([now]) {
            match &frame.ids {
                None => self.by_position.update_positions(&frame.pairs)?,
                Some(ids) => self.by_id.update(&frame.pairs, ids)?,
            }
        }
        self.followed = self.count;
        Ok(())
    }

    /// Returns the pairs that began with the last frame, or those that ended.
    pub(crate) fn changed(&mut self, begun: bool) -> Result<Flat, Error> {
        let any = !self.failed && self.count > 0;
        if any {
            self.follow()?;
        }
        Ok(match self.frames[self.now].ids {
            None => Flat::Positions(numbers(&self.by_position, any, begun)),
            Some(_) => Flat::Given(numbers(&self.by_id, any, begun)),
        })
    }
}

fn numbers<Id: Copy + Ord>(changes: &Changes<Id>, any: bool, begun: bool) -> Vec<Id> {
    let pairs = match (any, begun) {
        (false, _) => &[],
        (true, true) => changes.begun(),
        (true, false) => changes.ended(),
    };
    pairs.iter().flat_map(|&(a, b)| [a, b]).collect()
}
