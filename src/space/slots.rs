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

#[derive(Debug, Clone, Copy)]
struct Slot {
    generation: u32,
    at: At,
    /// The slot is in the list of changes.
    changed: bool,
    /// The body was removed since the last update.
    removed: bool,
}

/// See the module.
#[derive(Debug, Clone, Default)]
pub(super) struct Slots {
    slots: Vec<Slot>,
    boxes: Vec<Aabb>,
    bodies: Vec<Body>,
    /// Slots without a body.
    free: Vec<u32>,
    /// Slots that were inserted, set or removed since the last update, each once.
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
        let most = self.slots.len() + room;
        if u32::try_from(most).is_err() {
            return Err(Error::TooManyObjects { objects: most });
        }
        let refused = |_| Error::OutOfMemory { what: "bodies", elements: most };
        self.slots.try_reserve(room).map_err(refused)?;
        self.boxes.try_reserve(room).map_err(refused)?;
        self.bodies.try_reserve(room).map_err(refused)?;
        self.changed.try_reserve(more).map_err(refused)
    }

    /// Returns the slot of a handle.
    pub(super) fn find(&self, handle: Handle) -> Result<u32, Error> {
        let right = |s: &&Slot| s.generation == handle.generation() && s.at != At::Free && !s.removed;
        let slot = self.slots.get(handle.slot() as usize).filter(right);
        slot.map(|_| handle.slot()).ok_or(Error::StaleHandle { handle })
    }

    pub(super) fn handle(&self, slot: u32) -> Handle {
        Handle::new(slot, self.slots[slot as usize].generation)
    }

    /// Returns all boxes by slot. Those of free slots are unspecified.
    pub(super) fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    pub(super) fn body(&self, slot: u32) -> &Body {
        &self.bodies[slot as usize]
    }

    pub(super) fn at(&self, slot: u32) -> At {
        self.slots[slot as usize].at
    }

    pub(super) fn set_at(&mut self, slot: u32, at: At) {
        self.slots[slot as usize].at = at;
    }

    pub(super) fn is_removed(&self, slot: u32) -> bool {
        self.slots[slot as usize].removed
    }

    pub(super) fn is_changed(&self, slot: u32) -> bool {
        self.slots[slot as usize].changed
    }

    /// Inserts a body whose box is valid. There must be room.
    pub(super) fn insert(&mut self, aabb: Aabb, body: Body) -> Handle {
        let new = Slot { generation: 1, at: At::New, changed: false, removed: false };
        let slot = self.free.pop().unwrap_or_else(|| {
            self.slots.push(Slot { at: At::Free, ..new });
            self.boxes.push(aabb);
            self.bodies.push(body);
            (self.slots.len() - 1) as u32
        });
        let at = slot as usize;
        self.slots[at] = Slot { generation: self.slots[at].generation, ..new };
        (self.boxes[at], self.bodies[at]) = (aabb, body);
        self.len += 1;
        self.change(slot);
        self.handle(slot)
    }

    pub(super) fn set(&mut self, slot: u32, aabb: Aabb) {
        self.boxes[slot as usize] = aabb;
        self.change(slot);
    }

    pub(super) fn set_body(&mut self, slot: u32, body: Body) {
        self.bodies[slot as usize] = body;
        self.change(slot);
    }

    pub(super) fn remove(&mut self, slot: u32) {
        self.slots[slot as usize].removed = true;
        self.len -= 1;
        self.change(slot);
    }

    fn change(&mut self, slot: u32) {
        let of = &mut self.slots[slot as usize];
        if !of.changed {
            of.changed = true;
            self.changed.push(slot);
        }
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
            let of = &mut self.slots[slot as usize];
            of.changed = false;
            if std::mem::take(&mut of.removed) {
                of.at = At::Free;
                // 0 is no generation.
                of.generation = of.generation.checked_add(1).unwrap_or(1);
                self.free.push(slot);
            }
        }
        self.changed = changes;
    }

    /// Returns the handles of all bodies, by slot.
    pub(super) fn handles(&self) -> impl Iterator<Item = Handle> {
        let here = |(_, s): &(u32, &Slot)| s.at != At::Free && !s.removed;
        (0..).zip(&self.slots).filter(here).map(|(slot, s)| Handle::new(slot, s.generation))
    }
}
