//! The pairs of resting bodies, which stay until one of the two wakes.

use super::handle::Handle;

/// No pair.
const NONE: u32 = u32::MAX;

/// The places of a pair in the lists of its two bodies.
#[derive(Debug, Clone, Copy)]
struct Link {
    slots: [u32; 2],
    previous: [u32; 2],
    next: [u32; 2],
}

/// A doubly linked list of pairs for each body. Pair `k` is also element `k` of a list of the caller's.
#[derive(Debug, Clone, Default)]
pub(super) struct Links {
    links: Vec<Link>,
    /// The first pair of each slot.
    first: Vec<u32>,
}

impl Links {
    pub(super) fn len(&self) -> usize {
        self.links.len()
    }

    /// Adds a pair, behind all others of `list`.
    pub(super) fn add(&mut self, handles: (Handle, Handle), list: &mut Vec<(Handle, Handle)>) {
        let (at, slots) = (self.links.len() as u32, [handles.0.slot(), handles.1.slot()]);
        let most = slots[0].max(slots[1]) as usize;
        if self.first.len() <= most {
            self.first.resize(most + 1, NONE);
        }
        let next = slots.map(|slot| self.first[slot as usize]);
        self.links.push(Link { slots, previous: [NONE; 2], next });
        list.push(handles);
        for (slot, next) in slots.into_iter().zip(next) {
            self.first[slot as usize] = at;
            if next != NONE {
                self.previous_of(next, slot, at);
            }
        }
    }

    /// Removes all pairs of a body, and calls `removed` with the slots of each.
    pub(super) fn remove_all(
        &mut self,
        slot: u32,
        list: &mut Vec<(Handle, Handle)>,
        mut removed: impl FnMut(u32, u32),
    ) {
        while let Some(&at) = self.first.get(slot as usize).filter(|&&at| at != NONE) {
            let [a, b] = self.links[at as usize].slots;
            removed(a, b);
            self.remove(at, list);
        }
    }

    /// Removes all pairs. Returns their slots.
    pub(super) fn drain(&mut self) -> impl Iterator<Item = [u32; 2]> {
        self.first.clear();
        self.links.drain(..).map(|link| link.slots)
    }

    fn remove(&mut self, at: u32, list: &mut Vec<(Handle, Handle)>) {
        let link = self.links[at as usize];
        for k in 0..2 {
            let (slot, previous, next) = (link.slots[k], link.previous[k], link.next[k]);
            if previous == NONE {
                self.first[slot as usize] = next;
            } else {
                self.next_of(previous, slot, next);
            }
            if next != NONE {
                self.previous_of(next, slot, previous);
            }
        }
        // The last pair takes its place.
        self.links.swap_remove(at as usize);
        list.swap_remove(at as usize);
        let Some(&moved) = self.links.get(at as usize) else { return };
        for k in 0..2 {
            let (slot, previous, next) = (moved.slots[k], moved.previous[k], moved.next[k]);
            if previous == NONE {
                self.first[slot as usize] = at;
            } else {
                self.next_of(previous, slot, at);
            }
            if next != NONE {
                self.previous_of(next, slot, at);
            }
        }
    }

    fn side(&self, at: u32, slot: u32) -> usize {
        usize::from(self.links[at as usize].slots[1] == slot)
    }

    fn next_of(&mut self, at: u32, slot: u32, next: u32) {
        let side = self.side(at, slot);
        self.links[at as usize].next[side] = next;
    }

    fn previous_of(&mut self, at: u32, slot: u32, previous: u32) {
        let side = self.side(at, slot);
        self.links[at as usize].previous[side] = previous;
    }
}
