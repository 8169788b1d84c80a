//! Bodies with handles: those that move, those that rest, and the pairs of both.
//!
//! Bodies that were set lately are *active*: an [`Adaptive`] finds their pairs in every update. If there are many more
//! bodies that were not set for some updates, these *rest*: they stand in a tree, and the pairs among them stay until
//! one of the two wakes. Each active body keeps its resting neighbours while it stays within its fat AABB. So resting
//! bodies cost nothing.

mod active;
mod body;
mod handle;
mod links;
mod near;
mod resting;
mod slots;
#[cfg(feature = "serde")]
mod snapshot;
#[cfg(test)]
mod tests;
mod update;
mod view;

use crate::cpu::Tree;
use crate::pairs::Sorter;
use crate::{Aabb, Adaptive, Error, Registry, Tuning};
use active::Active;
use links::Links;
use near::Neighbours;
use resting::Resting;
use slots::Slots;
use std::sync::OnceLock;

pub use body::Body;
pub use handle::Handle;
pub use view::View;

/// Most updates that a body stays active without being set. Waking it costs about as much as that many updates of an
/// active one.
const IDLE: u64 = 8;

/// Bodies begin to rest when those that could are more than this many times the others. All wake when the resting ones
/// are fewer than half this many times the others: then one search for all is cheaper, also if they are all fixed.
const MANY: usize = 8;

/// Fewest bodies that rest.
const FEWEST: usize = 64;

/// Bodies with handles, and the pairs of those that overlap.
///
/// ```
/// use sapwise::{Aabb, Body, Space};
///
/// let mut space = Space::new();
/// let wall = space.insert(Aabb::cube([0.0; 3], 1.0), Body::fixed())?;
/// let player = space.insert(Aabb::cube([5.0, 0.0, 0.0], 1.0), Body::default())?;
/// space.update()?;
/// assert!(space.pairs().is_empty());
///
/// space.set(player, Aabb::cube([1.5, 0.0, 0.0], 1.0))?;
/// space.update()?;
/// assert_eq!(space.begun(), [(wall, player)]);
///
/// space.remove(wall)?;
/// space.update()?;
/// assert_eq!(space.ended(), [(wall, player)]);
/// # Ok::<(), sapwise::Error>(())
/// ```
///
/// Pairs and queries follow a call from the next [`update`](Self::update) on; a removed body is gone from queries,
/// [`contains`](Self::contains) and [`len`](Self::len) at once. A call that fails changes no body.
///
/// [`pairs`](Self::pairs), [`begun`](Self::begun) and [`ended`](Self::ended) depend on the calls alone, not on the
/// algorithm, the number of threads or the time: the same calls give the same lists in the same order.
#[derive(Debug)]
pub struct Space {
    search: Adaptive,
    slots: Slots,
    active: Active,
    resting: Resting,
    neighbours: Neighbours,
    /// The tree of the active bodies, built by the first query after an update.
    tree: OnceLock<Tree>,
    /// The pairs of resting bodies, which are the first in `pairs`.
    links: Links,
    /// Number of updates.
    update: u64,
    /// Whether bodies may rest.
    rests: bool,
    /// The pairs of active bodies with all others, by slot, the lower one first: those of this update and of the
    /// previous one, ascending.
    keys: Vec<u64>,
    before: Vec<u64>,
    sorter: Sorter,
    /// All pairs: first those of two resting bodies.
    pairs: Vec<(Handle, Handle)>,
    begun: Vec<(Handle, Handle)>,
    ended: Vec<(Handle, Handle)>,
}

/// A clone goes on as the original would: the same calls give the same lists. It searches with a
/// [clone](Adaptive#impl-Clone-for-Adaptive) of what searches in the original, on the same helper threads.
///
/// `clone_from` takes over bodies, pairs and limit, and leaves alone what searches: it makes no algorithm and forgets
/// nothing that was learned. A game that goes back to earlier states saves and restores with it:
///
/// ```
/// use sapwise::{Aabb, Body, Space};
///
/// let mut space = Space::new();
/// let body = space.insert(Aabb::cube([0.0; 3], 1.0), Body::default())?;
/// space.update()?;
/// let mut saved = space.clone();
/// saved.clone_from(&space); // every frame
/// space.remove(body)?;
/// space.update()?;
/// space.clone_from(&saved); // back
/// assert!(space.contains(body));
/// # Ok::<(), sapwise::Error>(())
/// ```
impl Clone for Space {
    fn clone(&self) -> Self {
        let mut clone = Self::with(self.search.clone());
        clone.clone_from(self);
        clone
    }

    fn clone_from(&mut self, other: &Self) {
        self.slots.clone_from(&other.slots);
        self.active.clone_from(&other.active);
        self.links.clone_from(&other.links);
        (self.update, self.rests) = (other.update, other.rests);
        self.before.clone_from(&other.before);
        self.pairs.clone_from(&other.pairs);
        self.begun.clone_from(&other.begun);
        self.ended.clone_from(&other.ended);
        self.neighbours.clear();
        self.tree.take();
        self.resting.begin(&mut self.slots);
    }
}

impl Default for Space {
    fn default() -> Self {
        Self::new()
    }
}

impl Space {
    /// Makes an empty space, with the [usual](Tuning::usual) tuning and a registry of its own. It starts no thread: an
    /// update with many active bodies does.
    pub fn new() -> Self {
        let registry = Registry::new();
        let search = Adaptive::new(Tuning::usual(&registry), &registry);
        Self::with(search.expect("the usual tuning has algorithms on one thread"))
    }

    /// Makes an empty space in which `search` finds the pairs of active bodies.
    pub fn with(search: Adaptive) -> Self {
        Self {
            search,
            slots: Slots::default(),
            active: Active::default(),
            resting: Resting::new(),
            neighbours: Neighbours::default(),
            tree: OnceLock::new(),
            links: Links::default(),
            update: 0,
            rests: false,
            keys: Vec::new(),
            before: Vec::new(),
            sorter: Sorter::default(),
            pairs: Vec::new(),
            begun: Vec::new(),
            ended: Vec::new(),
        }
    }

    /// Returns what finds the pairs of active bodies, for its [decisions](Adaptive::last_decision).
    pub fn search(&self) -> &Adaptive {
        &self.search
    }

    /// Returns what finds the pairs of active bodies, for its settings.
    pub fn search_mut(&mut self) -> &mut Adaptive {
        &mut self.search
    }

    /// Sets the most pairs of active bodies that an update may find, or lifts that limit, as
    /// [`Pairs::set_limit`](crate::Pairs::set_limit) does. Pairs with resting bodies do not count.
    pub fn set_limit(&mut self, limit: Option<usize>) {
        self.active.pairs.set_limit(limit);
    }

    /// Returns the number of bodies.
    pub fn len(&self) -> usize {
        self.slots.len
    }

    /// Returns whether there is no body.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Makes room for `more` bodies.
    ///
    /// # Errors
    /// [`Error::TooManyObjects`] and [`Error::OutOfMemory`].
    pub fn reserve(&mut self, more: usize) -> Result<(), Error> {
        self.slots.reserve(more)
    }

    /// Inserts a body.
    ///
    /// # Errors
    /// [`Error::InvalidBox`] with index 0, [`Error::TooManyObjects`] and [`Error::OutOfMemory`].
    pub fn insert(&mut self, aabb: Aabb, body: Body) -> Result<Handle, Error> {
        Aabb::check(&[aabb], 0)?;
        self.slots.reserve(1)?;
        Ok(self.slots.insert(aabb, body))
    }

    /// Inserts a body like `body` for each box. Returns their handles, in the order of the boxes.
    ///
    /// # Errors
    /// As [`insert`](Self::insert), with the index of the first invalid box. Then none is inserted.
    pub fn insert_all(&mut self, boxes: &[Aabb], body: Body) -> Result<Vec<Handle>, Error> {
        Aabb::check(boxes, 0)?;
        self.slots.reserve(boxes.len())?;
        Ok(boxes.iter().map(|&aabb| self.slots.insert(aabb, body)).collect())
    }

    /// Sets the box of a body.
    ///
    /// # Errors
    /// [`Error::StaleHandle`], and [`Error::InvalidBody`].
    pub fn set(&mut self, handle: Handle, aabb: Aabb) -> Result<(), Error> {
        let slot = self.check(handle, &aabb)?;
        self.slots.set(slot, aabb);
        Ok(())
    }

    /// Returns the slot of a body that gets a new box.
    fn check(&self, handle: Handle, aabb: &Aabb) -> Result<u32, Error> {
        let slot = self.slots.find(handle)?;
        aabb.defect().map_or(Ok(slot), |defect| Err(Error::InvalidBody { handle, defect }))
    }

    /// Sets the box of each of these bodies.
    ///
    /// # Errors
    /// As [`set`](Self::set), for the first handle or box that is wrong. Then no box is set.
    ///
    /// # Panics
    /// If there are not as many boxes as handles.
    #[inline(never)]
    pub fn set_all(&mut self, handles: &[Handle], boxes: &[Aabb]) -> Result<(), Error> {
        assert_eq!(handles.len(), boxes.len(), "one box for each handle");
        handles.iter().zip(boxes).try_for_each(|(&handle, aabb)| self.check(handle, aabb).map(drop))?;
        handles.iter().zip(boxes).for_each(|(handle, &aabb)| self.slots.set(handle.slot(), aabb));
        Ok(())
    }

    /// Sets what a body may meet. Pairs begin and end by that too.
    ///
    /// # Errors
    /// [`Error::StaleHandle`].
    pub fn set_body(&mut self, handle: Handle, body: Body) -> Result<(), Error> {
        let slot = self.slots.find(handle)?;
        self.slots.set_body(slot, body);
        Ok(())
    }

    /// Removes a body. Its pairs end at the next update.
    ///
    /// # Errors
    /// [`Error::StaleHandle`].
    pub fn remove(&mut self, handle: Handle) -> Result<(), Error> {
        let slot = self.slots.find(handle)?;
        self.slots.remove(slot);
        Ok(())
    }

    /// Removes these bodies. A handle may be given twice.
    ///
    /// # Errors
    /// [`Error::StaleHandle`] for the first stale one. Then none is removed.
    pub fn remove_all(&mut self, handles: &[Handle]) -> Result<(), Error> {
        handles.iter().try_for_each(|&handle| self.slots.find(handle).map(drop))?;
        for &handle in handles {
            // A handle given twice is stale the second time.
            if let Ok(slot) = self.slots.find(handle) {
                self.slots.remove(slot);
            }
        }
        Ok(())
    }

    /// Returns whether there is a body with this handle.
    pub fn contains(&self, handle: Handle) -> bool {
        self.slots.find(handle).is_ok()
    }

    /// Returns the box and the body of a handle, as set last; `None` if it is stale.
    pub fn get(&self, handle: Handle) -> Option<(&Aabb, &Body)> {
        let slot = self.slots.find(handle).ok()?;
        Some((&self.slots.boxes[slot as usize], self.slots.body(slot)))
    }

    /// Iterates over the handles of all bodies, ascending.
    pub fn handles(&self) -> impl Iterator<Item = Handle> {
        self.slots.handles()
    }

    /// Returns the pairs of bodies that overlap and may meet, each once, the lower handle first. Touching bodies
    /// overlap.
    ///
    /// The order depends on the calls that were made. For an order that depends on the pairs alone, sort them.
    pub fn pairs(&self) -> &[(Handle, Handle)] {
        &self.pairs
    }

    /// Returns the pairs that the previous update did not have, ascending.
    pub fn begun(&self) -> &[(Handle, Handle)] {
        &self.begun
    }

    /// Returns the pairs that only the previous update had, ascending. Those of removed bodies are among them.
    pub fn ended(&self) -> &[(Handle, Handle)] {
        &self.ended
    }
}
