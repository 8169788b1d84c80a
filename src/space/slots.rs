//! The bodies by slot, as the caller has set them.

use super::body::Body;
use super::handle::Handle;
use crate::aabb::Aabb;
use crate::error::Error;

/// Where a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum At {
    /// There is no body in this slot.
    Free,
    /// It was inserted since the last update.
    New,
    /// Among the active bodies, at this position.
    Active(u32),
    /// Among the resting bodies.
    Resting,
}

/// What was done to a body since the last update: one bit each.
pub(super) const SET: u8 = 1;
pub(super) const SET_BODY: u8 = 2;
const INSERTED: u8 = 4;
pub(super) const REMOVED: u8 = 8;

/// See the module. Each list but the last two is by slot.
#[derive(Debug, Clone, Default)]
pub(super) struct Slots {
    generations: Vec<u32>,
    at: Vec<At>,
    done: Vec<u8>,
    boxes: Vec<Aabb>,
    bodies: Vec<Body>,
    /// Slots without a body.
    free: Vec<u32>,
    /// Slots to which something was done since the last update, each once.
    changed: Vec<u32>,
    /// Number of bodies.
    len: usize,
}

impl Slots {
    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn reserve(&mut self, more: usize) -> Result<(), Error> {
        let room = more.saturating_sub(self.free.len());
        let most = self.boxes.len() + room;
        if u32::try_from(most).is_err() {
            return Err(Error::TooManyObjects { objects: most });
        }
        let refused = |_| Error::OutOfMemory { what: "bodies", elements: most };
        self.generations.try_reserve(room).map_err(refused)?;
        self.at.try_reserve(room).map_err(refused)?;
        self.done.try_reserve(room).map_err(refused)?;
        self.boxes.try_reserve(room).map_err(refused)?;
        self.bodies.try_reserve(room).map_err(refused)?;
        self.changed.try_reserve(more).map_err(refused)
    }

    /// Returns the slot of a handle.
    #[inline]
    pub(super) fn find(&self, handle: Handle) -> Result<u32, Error> {
        let slot = handle.slot();
        let known = self.generations.get(slot as usize) == Some(&handle.generation()) && self.is_here(slot);
        if known { Ok(slot) } else { Err(Error::StaleHandle { handle }) }
    }

    /// Returns whether there is a body in a slot.
    #[inline]
    fn is_here(&self, slot: u32) -> bool {
        self.at(slot) != At::Free && self.done(slot) & REMOVED == 0
    }

    #[inline]
    pub(super) fn handle(&self, slot: u32) -> Handle {
        Handle::new(slot, self.generations[slot as usize])
    }

    /// Returns all boxes by slot. Those of free slots are unspecified.
    pub(super) fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    pub(super) fn body(&self, slot: u32) -> &Body {
        &self.bodies[slot as usize]
    }

    #[inline]
    pub(super) fn at(&self, slot: u32) -> At {
        self.at[slot as usize]
    }

    pub(super) fn set_at(&mut self, slot: u32, at: At) {
        self.at[slot as usize] = at;
    }

    /// Returns what was done to a body since the last update.
    #[inline]
    pub(super) fn done(&self, slot: u32) -> u8 {
        self.done[slot as usize]
    }

    /// Inserts a body whose box is valid. There must be room.
    pub(super) fn insert(&mut self, aabb: Aabb, body: Body) -> Handle {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.generations.push(1);
            self.at.push(At::Free);
            self.done.push(0);
            self.boxes.push(aabb);
            self.bodies.push(body);
            (self.boxes.len() - 1) as u32
        });
        let at = slot as usize;
        (self.at[at], self.boxes[at], self.bodies[at]) = (At::New, aabb, body);
        self.len += 1;
        self.note(slot, INSERTED);
        self.handle(slot)
    }

    #[inline]
    pub(super) fn set(&mut self, slot: u32, aabb: Aabb) {
        self.boxes[slot as usize] = aabb;
        self.note(slot, SET);
    }

    pub(super) fn set_body(&mut self, slot: u32, body: Body) {
        self.bodies[slot as usize] = body;
        self.note(slot, SET_BODY);
    }

    pub(super) fn remove(&mut self, slot: u32) {
        self.len -= 1;
        self.note(slot, REMOVED);
    }

    #[inline]
    fn note(&mut self, slot: u32, what: u8) {
        let done = &mut self.done[slot as usize];
        if *done == 0 {
            self.changed.push(slot);
        }
        *done |= what;
    }

    /// Takes the list of changes, until [`settle`](Self::settle) or [`give_back`](Self::give_back).
    pub(super) fn take_changes(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.changed)
    }

    /// Keeps the changes for the next update.
    pub(super) fn give_back(&mut self, changes: Vec<u32>) {
        self.changed = changes;
    }

    /// Forgets the changes, and frees the slots of removed bodies.
    pub(super) fn settle(&mut self, mut changes: Vec<u32>) {
        for slot in changes.drain(..) {
            let at = slot as usize;
            if std::mem::take(&mut self.done[at]) & REMOVED != 0 {
                self.at[at] = At::Free;
                // 0 is no generation.
                self.generations[at] = self.generations[at].checked_add(1).unwrap_or(1);
                self.free.push(slot);
            }
        }
        self.changed = changes;
    }

    /// Returns the handles of all bodies, by slot.
    pub(super) fn handles(&self) -> impl Iterator<Item = Handle> {
        (0..self.boxes.len() as u32).filter(|&slot| self.is_here(slot)).map(|slot| self.handle(slot))
    }
}
