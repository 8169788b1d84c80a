//! The bodies by slot, as the caller has set them.

use super::body::Body;
use super::handle::Handle;
use crate::cpu::reserve;
use crate::{Aabb, Error, check_count};

/// The place of a body.
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

/// Changes of a body since the last update, one bit each.
const SET: u8 = 1;
pub(super) const SET_BODY: u8 = 2;
pub(super) const REMOVED: u8 = 4;

/// If more than one slot in this many has changed, all are looked at.
const MANY_CHANGED: usize = 8;

#[derive(Debug, Clone, Copy)]
struct Slot {
    generation: u32,
    at: At,
    done: u8,
}

/// See the module.
#[derive(Debug, Clone, Default)]
pub(super) struct Slots {
    slots: Vec<Slot>,
    /// Boxes by slot. Those of free slots are unspecified.
    pub(super) boxes: Vec<Aabb>,
    bodies: Vec<Body>,
    /// Slots without a body. The last one is used first.
    pub(super) free: Vec<u32>,
    /// Slots of removed bodies whose pairs have not ended yet.
    leaving: Vec<u32>,
    /// Slots to which something was done since the last update, each once.
    changed: Vec<u32>,
    /// The boxes that the resting bodies which were set since had at the last update.
    replaced: Vec<(u32, Aabb)>,
    /// Number of bodies.
    pub(super) len: usize,
}

impl Slots {
    pub(super) fn reserve(&mut self, more: usize) -> Result<(), Error> {
        let room = more.saturating_sub(self.free.len());
        let most = self.boxes.len().saturating_add(room);
        check_count(most)?;
        reserve(&mut self.slots, room, "bodies")?;
        reserve(&mut self.boxes, room, "bodies")?;
        reserve(&mut self.bodies, room, "bodies")?;
        reserve(&mut self.changed, more, "bodies")
    }

    /// Returns the slot of a handle.
    #[inline]
    pub(super) fn find(&self, handle: Handle) -> Result<u32, Error> {
        let known = self.slots.get(handle.slot() as usize);
        let known = known.is_some_and(|slot| slot.generation == handle.generation() && slot.is_taken());
        if known { Ok(handle.slot()) } else { Err(Error::StaleHandle { handle }) }
    }

    #[inline]
    pub(super) fn handle(&self, slot: u32) -> Handle {
        Handle::new(slot, self.slots[slot as usize].generation)
    }

    pub(super) fn body(&self, slot: u32) -> &Body {
        &self.bodies[slot as usize]
    }

    #[inline]
    pub(super) fn at(&self, slot: u32) -> At {
        self.slots[slot as usize].at
    }

    pub(super) fn set_at(&mut self, slot: u32, at: At) {
        self.slots[slot as usize].at = at;
    }

    /// Returns whether there is a body in a slot.
    pub(super) fn is_taken(&self, slot: u32) -> bool {
        self.slots[slot as usize].is_taken()
    }

    pub(super) fn is_changed(&self, slot: u32) -> bool {
        self.slots[slot as usize].done != 0
    }

    /// Inserts a body whose box is valid. There must be room.
    pub(super) fn insert(&mut self, aabb: Aabb, body: Body) -> Handle {
        let slot = self.free.pop().unwrap_or_else(|| self.push(1));
        self.occupy(slot, aabb, body);
        self.handle(slot)
    }

    /// Adds a slot without a body.
    pub(super) fn push(&mut self, generation: u32) -> u32 {
        self.slots.push(Slot { generation, at: At::Free, done: 0 });
        self.boxes.push(Aabb::default());
        self.bodies.push(Body::default());
        (self.boxes.len() - 1) as u32
    }

    /// Puts a new body into a slot without one.
    pub(super) fn occupy(&mut self, slot: u32, aabb: Aabb, body: Body) {
        self.slots[slot as usize].at = At::New;
        self.boxes[slot as usize] = aabb;
        self.len += 1;
        self.set_body(slot, body);
    }

    // In the C library, which calls it from two loops, the compiler left it a call: 13 instructions a box.
    #[inline(always)]
    pub(super) fn set(&mut self, slot: u32, aabb: Aabb) {
        let known = std::mem::replace(&mut self.boxes[slot as usize], aabb);
        let of = &self.slots[slot as usize];
        if of.at == At::Resting && of.done & SET == 0 {
            self.replaced.push((slot, known));
        }
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
        let done = &mut self.slots[slot as usize].done;
        if *done == 0 {
            self.changed.push(slot);
        }
        *done |= what;
    }

    /// Takes the slots to which something was done. [`take_done`](Self::take_done) of each, then
    /// [`give_back`](Self::give_back) follow.
    pub(super) fn take_changes(&mut self) -> Vec<u32> {
        self.replaced.clear();
        let mut changed = std::mem::take(&mut self.changed);
        if changed.len() > self.slots.len() / MANY_CHANGED {
            // Memory is read in order then, in whatever order the caller went.
            let slots = (0..).zip(&self.slots);
            changed.clear();
            changed.extend(slots.filter(|(_, of)| of.done != 0).map(|(slot, _)| slot));
        }
        changed
    }

    /// Returns what was done to a body. That a body was removed stays known until [`free`](Self::free).
    #[inline]
    pub(super) fn take_done(&mut self, slot: u32) -> u8 {
        let of = &mut self.slots[slot as usize];
        let done = of.done;
        of.done &= REMOVED;
        if of.done != 0 {
            self.leaving.push(slot);
        }
        done
    }

    /// Gives the list back, for its memory.
    pub(super) fn give_back(&mut self, mut changes: Vec<u32>) {
        changes.clear();
        self.changed = changes;
    }

    /// Frees the slots of removed bodies. The lowest is used again first, whatever else was done to the bodies.
    pub(super) fn free(&mut self) {
        self.leaving.sort_unstable_by(|a, b| b.cmp(a));
        // After an update that failed they are taken again.
        self.leaving.dedup();
        for slot in self.leaving.drain(..) {
            let of = &mut self.slots[slot as usize];
            // 0 is no generation.
            *of = Slot { generation: of.generation.checked_add(1).unwrap_or(1), at: At::Free, done: 0 };
            self.free.push(slot);
        }
    }

    /// Exchanges the boxes of resting bodies with those at the last update, and back at the next call.
    pub(super) fn exchange_replaced(&mut self) {
        self.replaced.iter_mut().for_each(|(slot, aabb)| std::mem::swap(aabb, &mut self.boxes[*slot as usize]));
    }

    /// Returns the slots of resting bodies, ascending.
    pub(super) fn resting(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.slots).filter(|(_, of)| of.at == At::Resting).map(|(slot, _)| slot)
    }

    /// Returns the handles of all bodies, by slot.
    pub(super) fn handles(&self) -> impl Iterator<Item = Handle> {
        let taken = |(_, of): &(u32, &Slot)| of.is_taken();
        (0..).zip(&self.slots).filter(taken).map(|(slot, of)| Handle::new(slot, of.generation))
    }
}

impl Slot {
    /// Returns whether there is a body in the slot.
    #[inline]
    fn is_taken(&self) -> bool {
        self.at != At::Free && self.done & REMOVED == 0
    }
}
