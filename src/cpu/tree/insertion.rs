//! Boxes that come into a tree and leave it, each by itself.

use super::{NOBODY, Tree, grow};
use crate::cpu::{LANES, Marks, Node};
use crate::{Aabb, Error, Membership, Screen};

impl Tree {
    /// Adds boxes, which have no bounds yet: to empty lanes near their place on the curve, else to new leaves, whose
    /// other lanes are for those that follow. Calls `placed` with the place and the id of each.
    pub(crate) fn insert(
        &mut self,
        boxes: &[Aabb],
        ids: impl Iterator<Item = u32>,
        screen: Option<&Screen>,
        mut placed: impl FnMut(usize, u32),
    ) -> Result<(), Error> {
        self.inserted.clear();
        self.inserted.extend(ids.map(u64::from));
        if self.inserted.is_empty() {
            return Ok(());
        }
        if let Some(curve) = &self.curve {
            curve.recode(&mut self.inserted, boxes);
            self.inserted.sort_unstable();
        }
        let sorted = self.leaves.len();
        // The position in `leaves` near which the last new leaf belongs.
        let mut last = None;
        for at in 0..self.inserted.len() {
            let (code, id) = ((self.inserted[at] >> 32) as u32, self.inserted[at] as u32);
            let near = self.leaves[..sorted].partition_point(|&(start, _)| start <= code).saturating_sub(1);
            let new = last.is_some_and(|last| near <= last + 2).then(|| self.leaves.len() - 1);
            let around = [near, near + 1, near.wrapping_sub(1), near + 2].into_iter().filter(|&leaf| leaf < sorted);
            let place = match around.chain(new).find_map(|leaf| self.free_place(leaf)) {
                Some(place) => place,
                None => {
                    last = Some(near);
                    self.add_leaf(code)?
                }
            };
            self.ids[place] = id;
            placed(place, id);
            self.widen_marks(place, id, screen);
        }
        if last.is_some() {
            // Two runs, which the sort joins.
            self.leaves.sort();
        }
        Ok(())
    }

    /// Returns an empty lane of the leaf at this position of `leaves`.
    fn free_place(&self, leaf: usize) -> Option<usize> {
        let first = self.leaves[leaf].1 as usize * LANES;
        (first..first + LANES).find(|&place| self.ids[place] == NOBODY)
    }

    /// Adds a leaf behind all others, and to the end of `leaves`. Returns its first place.
    fn add_leaf(&mut self, code: u32) -> Result<usize, Error> {
        let first = self.ids.len();
        self.places = first + LANES;
        grow(&mut self.ids, self.places, NOBODY)?;
        let mut nodes = self.places / LANES;
        // The last level grows beyond 16 nodes, so that no level has to be added.
        for level in self.levels.iter_mut().take_while(|level| !level.is_empty()) {
            grow(level, nodes, Node::EMPTY)?;
            nodes = nodes.div_ceil(LANES);
        }
        for (marks, level) in self.marks.iter_mut().zip(&self.levels) {
            grow(marks, level.len(), Marks::EMPTY)?;
        }
        self.leaves.push((code, (first / LANES) as u32));
        Ok(first)
    }

    fn widen_marks(&mut self, place: usize, id: u32, screen: Option<&Screen>) {
        let of = screen.map_or(&Membership::ALL, |screen| screen.filter.of(id));
        let mut at = place;
        for marks in self.marks.iter_mut().take_while(|marks| !marks.is_empty()) {
            marks[at / LANES].widen(at % LANES, of);
            at /= LANES;
        }
    }

    /// Removes the box at a place.
    pub(crate) fn remove(&mut self, place: usize) {
        self.levels[0][place / LANES].empty(place % LANES);
        self.ids[place] = NOBODY;
    }
}
