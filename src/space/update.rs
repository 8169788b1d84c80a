//! The steps of an update.

use super::{FEWEST, Handle, IDLE, MANY, Space};
use crate::changes::differences;
use crate::cpu::Workers;
use crate::space::active::Patience;
use crate::space::slots::{At, REMOVED, SET_BODY, Slots};
use crate::{BroadPhase, Error};

/// Makes the key of a pair of slots, the lower one in the upper half.
pub(super) fn key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// Returns the slots of a key.
pub(super) fn slots(key: u64) -> (u32, u32) {
    ((key >> 32) as u32, key as u32)
}

/// Returns the handles of a key.
pub(super) fn handles(of: &Slots, key: u64) -> (Handle, Handle) {
    let (a, b) = slots(key);
    (of.handle(a), of.handle(b))
}

impl Space {
    /// Finds all pairs, and which began and ended since the previous update.
    ///
    /// # Errors
    /// [`Error::TooManyPairs`], [`Error::OutOfMemory`] and [`Error::Unavailable`]. Then no pair has begun or ended, the
    /// pairs of active bodies are missing, and the next update compares with the last one that succeeded.
    pub fn update(&mut self) -> Result<(), Error> {
        self.update += 1;
        self.tree.take();
        self.pairs.truncate(self.links.len());
        self.begun.clear();
        self.ended.clear();
        self.rest();
        let known = self.before.len();
        let changes = self.slots.take_changes();
        self.apply(&changes);
        self.slots.give_back(changes);
        if self.rests && self.active.len() * MANY > 2 * self.resting.len() {
            self.wake_all();
        }
        if self.before.len() > known {
            self.sorter.sort(&Workers::one(), &mut self.before);
        }
        if let Err(error) = self.find().and_then(|()| self.compare()) {
            // Neighbours that came to rest are missing from the lists. Bodies stay active until the pairs of their
            // present boxes are known.
            self.neighbours.clear();
            self.active.stay_until(self.update + 2);
            return Err(error);
        }
        self.slots.free();
        Ok(())
    }

    /// Lets bodies rest that were not set for some updates, if they are many.
    fn rest(&mut self) {
        let Self { active, slots, update, .. } = self;
        let idle = |at: usize| active.patience[at].until <= *update && !slots.is_changed(active.slots[at]);
        let first = (0..active.len()).find(|&at| idle(at));
        let Some(first) = first else { return };
        if !self.rests {
            let idle = (first..active.len()).filter(|&at| idle(at)).count();
            self.rests = idle > FEWEST.max(MANY * (active.len() - idle));
        }
        if !self.rests {
            return;
        }
        let resting: Vec<usize> = (first..active.len()).filter(|&at| idle(at)).collect();
        // The highest first: then what takes the place of one does not rest itself.
        for &at in resting.iter().rev() {
            let slot = self.active.slots[at];
            self.leave_active(at as u32);
            self.slots.set_at(slot, At::Resting);
            self.resting.add(slot);
        }
        // Their pairs with each other move to those that stay.
        let Self { before, slots, links, pairs, .. } = self;
        before.retain(|&key| {
            let (a, b) = self::slots(key);
            let stays = slots.at(a) == At::Resting && slots.at(b) == At::Resting;
            if stays {
                links.add((slots.handle(a), slots.handle(b)), pairs);
            }
            !stays
        });
    }

    /// Does what the caller has asked for since the previous update.
    fn apply(&mut self, changes: &[u32]) {
        // Newcomers take the places of active bodies that leave, so that few boxes change their position.
        let (mut left, mut woken, mut newcomers) = (Vec::new(), Vec::new(), Vec::new());
        for &slot in changes {
            let done = self.slots.take_done(slot);
            let removed = done & REMOVED != 0;
            let at = self.slots.at(slot);
            match at {
                At::Active(at) if !removed => {
                    self.active.set(at as usize, self.slots.boxes[slot as usize], self.update);
                    if done & SET_BODY != 0 {
                        self.active.set_body(at as usize, self.slots.body(slot));
                        self.neighbours.forget(at as usize);
                    }
                    continue;
                }
                At::Active(at) => left.push(at),
                At::Resting => woken.push(slot),
                At::New | At::Free => {}
            }
            // The slot of a removed body stays taken until its pairs have ended.
            self.slots.set_at(slot, At::New);
            if !removed {
                // One that was set may be set again soon.
                let wait = match at {
                    At::New if self.slots.body(slot).rests_at_once() => 0,
                    At::New => IDLE,
                    _ => 1,
                };
                newcomers.push((slot, Patience::after(self.update, wait)));
            }
        }
        // Ascending, so that the order of the pairs that stay does not depend on the order of the changes.
        woken.sort_unstable();
        woken.into_iter().for_each(|slot| self.leave_resting(slot));
        left.sort_unstable();
        let mut places = left.iter().copied();
        newcomers.into_iter().for_each(|(slot, patience)| self.activate(slot, patience, places.next()));
        // The highest first: then what takes the place of one never leaves itself.
        places.rev().for_each(|at| self.leave_active(at));
    }

    /// Adds a body to the active ones, at this place if there is one.
    pub(super) fn activate(&mut self, slot: u32, patience: Patience, place: Option<u32>) {
        let at = place.unwrap_or(self.active.len() as u32);
        self.slots.set_at(slot, At::Active(at));
        let (aabb, body) = (self.slots.boxes[slot as usize], self.slots.body(slot));
        self.active.put(at as usize, slot, aabb, body, patience);
    }

    /// Removes the active body at a place.
    fn leave_active(&mut self, at: u32) {
        if let Some(moved) = self.active.swap_remove(at as usize) {
            self.slots.set_at(moved, At::Active(at));
        }
    }

    /// Takes a body out of the resting ones. Its pairs with these are compared with those of this update.
    fn leave_resting(&mut self, slot: u32) {
        self.resting.remove(slot);
        let Self { links, pairs, before, .. } = self;
        links.remove_all(slot, pairs, |a, b| before.push(key(a, b)));
    }

    /// Lets no body rest any more.
    fn wake_all(&mut self) {
        self.rests = false;
        for slot in 0..self.slots.boxes.len() as u32 {
            if self.slots.at(slot) == At::Resting {
                self.activate(slot, Patience::after(self.update, IDLE), None);
            }
        }
        self.resting.clear();
        self.before.extend(self.links.drain().map(|[a, b]| key(a, b)));
        self.pairs.clear();
        self.neighbours.clear();
    }

    /// Finds the pairs of active bodies.
    fn find(&mut self) -> Result<(), Error> {
        let Self { search, slots, active, resting, neighbours, keys, sorter, .. } = self;
        resting.update(slots)?;
        search.find_pairs(&active.boxes, &mut active.pairs)?;
        keys.clear();
        let of = &active.slots;
        keys.extend(active.pairs.iter().map(|&(a, b)| key(of[a as usize], of[b as usize])));
        if resting.len() > 0 {
            let wants = |at: usize, other| slots.body(of[at]).membership().wants(slots.body(other).membership());
            let found = |at: usize, other| keys.push(key(of[at], other));
            neighbours.each(resting, &slots.boxes, (of, &active.boxes), wants, found);
        }
        sorter.sort(&Workers::one(), keys);
        Ok(())
    }

    /// Compares the pairs with those of the previous update.
    fn compare(&mut self) -> Result<(), Error> {
        let Self { slots, keys, before, pairs, begun, ended, .. } = self;
        let handles = |key| handles(slots, key);
        differences(keys, before, handles, begun, ended)?;
        pairs.extend(keys.iter().copied().map(handles));
        std::mem::swap(keys, before);
        Ok(())
    }
}
