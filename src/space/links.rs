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
    /// The pairs that are being removed.
    removed: Vec<u32>,
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
        let link = Link { slots, previous: [NONE; 2], next };
        self.links.push(link);
        list.push(handles);
        self.point(&link, [at; 2], [at; 2]);
    }

    /// Removes all pairs of a body, and calls `removed` with the slots of each. The order of `list` afterwards depends
    /// only on the order before.
    pub(super) fn remove_all(
        &mut self,
        slot: u32,
        list: &mut Vec<(Handle, Handle)>,
        mut removed: impl FnMut(u32, u32),
    ) {
        let mut all = std::mem::take(&mut self.removed);
        let mut at = self.first.get(slot as usize).copied().unwrap_or(NONE);
        while at != NONE {
            all.push(at);
            at = self.links[at as usize].next[self.side(at, slot)];
        }
        all.sort_unstable_by(|a, b| b.cmp(a));
        for at in all.drain(..) {
            let [a, b] = self.links[at as usize].slots;
            removed(a, b);
            self.remove(at, list);
        }
        self.removed = all;
    }

    /// Removes all pairs. Returns their slots.
    pub(super) fn drain(&mut self) -> impl Iterator<Item = [u32; 2]> {
        self.first.clear();
        self.links.drain(..).map(|link| link.slots)
    }

    fn remove(&mut self, at: u32, list: &mut Vec<(Handle, Handle)>) {
        let link = self.links[at as usize];
        self.point(&link, link.next, link.previous);
        // The last pair takes its place.
        self.links.swap_remove(at as usize);
        list.swap_remove(at as usize);
        if let Some(&moved) = self.links.get(at as usize) {
            self.point(&moved, [at; 2], [at; 2]);
        }
    }

    /// Sets, in the lists of both bodies of a pair, the next pair of the one before it to `next`, and the previous
    /// pair of the one behind it to `previous`.
    fn point(&mut self, link: &Link, next: [u32; 2], previous: [u32; 2]) {
        for k in 0..2 {
            let (slot, before, behind) = (link.slots[k], link.previous[k], link.next[k]);
            if before == NONE {
                self.first[slot as usize] = next[k];
            } else {
                let side = self.side(before, slot);
                self.links[before as usize].next[side] = next[k];
            }
            if behind != NONE {
                let side = self.side(behind, slot);
                self.links[behind as usize].previous[side] = previous[k];
            }
        }
    }

    fn side(&self, at: u32, slot: u32) -> usize {
        usize::from(self.links[at as usize].slots[1] == slot)
    }
}
