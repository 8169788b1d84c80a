//! Frames that follow each other: what a `BroadPhase` keeps from one to the next.

use crate::one_shot::flat;
use crate::start::Start;
use sapwise::{Aabb, Adaptive, BroadPhase, Changes, Error, Filter, Membership, Pairs};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What names the boxes of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Ids {
    /// Their positions.
    Positions,
    /// Ids of the caller's, one for each box.
    Given(Vec<i64>),
}

/// The pairs of a frame and what names their members.
struct Frame {
    pairs: Pairs,
    ids: Ids,
}

/// What changed between two frames, by positions or by ids.
enum Follower {
    Positions(Changes<u32>),
    Given(Changes<i64>),
}

/// Numbers in pairs, as flat as NumPy has them.
pub(crate) enum Flat {
    Positions(Vec<u32>),
    Given(Vec<i64>),
}

/// The broad phase, its last two frames and what changed between them.
pub(crate) struct Frames {
    pub(crate) adaptive: Adaptive,
    frames: [Frame; 2],
    /// The one of the last frame that succeeded.
    now: usize,
    /// How many frames have succeeded, and up to which of them changes were followed. They are only where somebody asks for them.
    count: u64,
    followed: u64,
    follower: Follower,
    /// The last call failed: nothing has begun or ended.
    failed: bool,
    /// The filter that the lists have.
    filter: Option<Arc<Vec<Membership>>>,
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

    /// Whether the frame before named its boxes in another way.
    pub(crate) fn is_named_otherwise(&self, ids: &Ids) -> bool {
        self.count > 0 && std::mem::discriminant(ids) != std::mem::discriminant(&self.frames[self.now].ids)
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
        // What is older than the frame before is gone from here on, whatever comes of it.
        self.failed = true;
        self.adaptive.find_pairs(boxes, &mut next.pairs)?;
        next.ids = ids;
        let numbers = flat(&next.pairs, 0)?;
        self.failed = false;
        self.now = 1 - self.now;
        self.count += 1;
        Ok(numbers)
    }

    /// Brings the follower to the last frame.
    fn follow(&mut self) -> Result<(), Error> {
        if self.followed == self.count {
            return Ok(());
        }
        let [now, before] = [&self.frames[self.now], &self.frames[1 - self.now]];
        // Nobody has asked after the frame before.
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
                // Refused where the frame was given.
                _ => unreachable!("a frame is named as the one before"),
            }
        }
        self.followed = self.count;
        Ok(())
    }

    /// The pairs that began with the last frame, or those that ended.
    pub(crate) fn changed(&mut self, begun: bool) -> Result<Flat, Error> {
        if self.failed || self.count == 0 {
            return Ok(match self.frames[self.now].ids {
                Ids::Positions => Flat::Positions(Vec::new()),
                Ids::Given(_) => Flat::Given(Vec::new()),
            });
        }
        self.follow()?;
        let numbers = |pairs: &[(u32, u32)]| pairs.iter().flat_map(|&(a, b)| [a, b]).collect();
        let ids = |pairs: &[(i64, i64)]| pairs.iter().flat_map(|&(a, b)| [a, b]).collect();
        Ok(match &self.follower {
            Follower::Positions(c) => Flat::Positions(numbers(if begun { c.begun() } else { c.ended() })),
            Follower::Given(c) => Flat::Given(ids(if begun { c.begun() } else { c.ended() })),
        })
    }
}

/// Frames behind a lock, which is taken without the interpreter's lock only.
pub(crate) type Shared = Arc<Mutex<Frames>>;

/// Locked by who holds the interpreter's lock, and for an instant: no fork finds it locked.
pub(crate) struct State {
    /// The process that made the frames: the threads of another one are not here.
    pub(crate) pid: u32,
    /// `None` once it is closed.
    pub(crate) frames: Option<Shared>,
    pub(crate) filter: Option<Arc<Vec<Membership>>>,
}

impl Drop for State {
    fn drop(&mut self) {
        if self.pid != std::process::id() {
            // To drop them would wait for threads that are not here.
            std::mem::forget(self.frames.take());
        }
    }
}

/// The frames, once no other call has them.
pub(crate) fn locked(frames: &Shared) -> MutexGuard<'_, Frames> {
    frames.lock().unwrap_or_else(PoisonError::into_inner)
}
