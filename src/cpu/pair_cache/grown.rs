//! The grown boxes: finds the boxes that have left theirs, and grows new ones.

use super::tree::GrownTree;
use crate::cpu::kernel::contain::{each_doubtful_block, within};
use crate::cpu::{Simd, Workers, ensure};
use crate::{Aabb, Error, Filter, Membership};
use std::ops::Range;

/// Contains no box, not even an infinite one: a box that has no grown box yet counts as having left it.
pub(super) const NOTHING: Aabb = Aabb::new([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);

/// Every box grown by a margin, in the order of the input.
#[derive(Debug, Default)]
pub(super) struct Grown {
    boxes: Vec<Aabb>,
    len: usize,
    /// One bit for each box: it got a new grown box in this frame, or was removed.
    dirty: Vec<u64>,
    /// Those by which the kept pairs were found; empty without a filter.
    memberships: Vec<Membership>,
    simd: Simd,
}

/// The growth of a box on each side, as a share of its mean edge.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Margin {
    pub(super) share: f32,
    /// Mean edges are clamped to this, so that a world-sized box is not grown by the size of the world.
    pub(super) longest_edge: f32,
}

/// The result of one task for its share of the boxes.
#[derive(Debug, Default)]
pub(super) struct Share {
    /// Boxes that left their grown box.
    pub(super) left: Vec<u32>,
    /// Those of them whose new grown box does not overlap the old one, new boxes included.
    pub(super) far: Vec<u32>,
}

/// The differences between a frame and the previous one.
#[derive(Debug)]
pub(super) struct Changes {
    /// Number of boxes that left their grown box, new and removed ones included.
    pub(super) left: usize,
    /// Those of them that jumped, new and removed ones included: no margin would have held them.
    pub(super) jumped: usize,
    /// New boxes.
    pub(super) new: Range<usize>,
    /// Removed boxes.
    pub(super) gone: Range<usize>,
}

impl Grown {
    pub(super) fn new(simd: Simd) -> Self {
        Self { simd, ..Self::default() }
    }

    pub(super) fn as_slice(&self) -> &[Aabb] {
        &self.boxes[..self.len]
    }

    /// Forgets all grown boxes: the next frame grows every box anew.
    pub(super) fn forget(&mut self) {
        self.len = 0;
    }

    /// Reserves memory for `objects` boxes.
    pub(super) fn reserve(&mut self, objects: usize) -> Result<(), Error> {
        ensure(&mut self.boxes, objects, "grown boxes")?;
        ensure(&mut self.dirty, objects.div_ceil(64) + 1, "grown boxes")
    }

    /// Returns the number of boxes of a task: a multiple of 64, so that no two tasks share a word of bits.
    fn share_len(&self, tasks: usize) -> usize {
        self.len.div_ceil(tasks).next_multiple_of(64).max(64)
    }

    /// Runs one phase: grows every box anew that has left its grown box or may be wanted with
    /// others than before, and those in `again`.
    ///
    /// # Errors
    /// [`Error::InvalidBox`]. Then the grown boxes are of no use.
    pub(super) fn check(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        margin: Margin,
        again: Range<usize>,
        filter: Option<&Filter>,
        shares: &mut [Share],
    ) -> Result<Changes, Error> {
        self.reserve(boxes.len().max(self.len))?;
        let (new, gone) = (self.len..boxes.len(), boxes.len()..self.len);
        if !new.is_empty() {
            self.boxes[new.clone()].fill(NOTHING);
        }
        for b in &mut self.boxes[again] {
            let centre = [0, 1, 2].map(|a| b.min[a] * 0.5 + b.max[a] * 0.5);
            *b = Aabb::new(centre, centre);
        }
        self.len = boxes.len();
        self.update_memberships(workers, filter)?;
        let size = self.share_len(shares.len());
        for share in shares.iter_mut() {
            share.left.clear();
            share.far.clear();
        }
        let simd = self.simd;
        let parts = self.boxes[..self.len].chunks_mut(size).zip(self.dirty.chunks_mut(size / 64));
        workers.try_each_of(shares.iter_mut().zip(parts).enumerate(), |(k, (share, (grown, dirty)))| {
            let first = k * size;
            share.check(&boxes[first..first + grown.len()], grown, dirty, first, margin, simd)
        })?;
        // Drops the kept pairs of removed boxes with those of the boxes that left.
        for id in gone.clone() {
            self.dirty[id / 64] |= 1 << (id % 64);
        }
        let left = shares.iter().map(|s| s.left.len()).sum::<usize>() + gone.len();
        let jumped = shares.iter().map(|s| s.far.len()).sum::<usize>() + gone.len();
        Ok(Changes { left, jumped, new, gone })
    }

    /// Runs one phase: grows every box anew. The boxes must be valid.
    pub(super) fn grow_all(&mut self, workers: &Workers, boxes: &[Aabb], margin: Margin, shares: &mut [Share]) {
        let size = self.share_len(shares.len());
        shares.iter_mut().for_each(|share| share.left.clear());
        self.dirty.fill(0);
        workers.each_of(self.boxes[..self.len].chunks_mut(size).zip(boxes.chunks(size)), |(grown, boxes)| {
            grown.iter_mut().zip(boxes).for_each(|(grown, b)| *grown = margin.grow(b));
        });
    }

    /// Calls `found` for every wanted box whose grown box overlaps the new one of box `i`. If both have new ones, only
    /// the call for the lower box finds the pair. Returns the number of visited nodes of the tree.
    #[inline]
    pub(super) fn meet(&self, tree: &GrownTree, i: u32, mut found: impl FnMut(u32)) -> u32 {
        let (bounds, of_i) = (&self.boxes[i as usize], self.memberships.get(i as usize));
        tree.tree.overlapping_wanted(
            bounds,
            || of_i.copied().unwrap_or_default(),
            |j| {
                if (j > i || !self.is_new(j)) && of_i.is_none_or(|of_i| of_i.wants(&self.memberships[j as usize])) {
                    found(j);
                }
            },
        )
    }

    /// Takes the memberships of this frame. The pairs of a box that may be wanted with others than before are not all
    /// kept, so it gets a grown box that it has left.
    fn update_memberships(&mut self, workers: &Workers, filter: Option<&Filter>) -> Result<(), Error> {
        let Self { boxes, len, memberships, .. } = self;
        if filter.is_none() && memberships.is_empty() {
            return Ok(());
        }
        ensure(memberships, *len, "memberships")?;
        let size = len.div_ceil(workers.tasks()).max(1);
        let parts = boxes[..*len].chunks_mut(size).zip(memberships.chunks_mut(size)).zip((0..).step_by(size));
        workers.each_of(parts, |((boxes, memberships), first)| {
            for ((grown, before), id) in boxes.iter_mut().zip(memberships).zip(first as u32..) {
                let now = filter.map_or(&Membership::ALL, |filter| filter.of(id));
                if !now.is_within(before) {
                    *grown = NOTHING;
                }
                *before = *now;
            }
        });
        if filter.is_none() {
            memberships.clear();
        }
        Ok(())
    }

    /// Returns whether a box of a kept pair got a new grown box or was removed.
    #[inline(always)]
    pub(super) fn is_dirty(&self, (i, j): (u32, u32)) -> bool {
        // A branch would cost more than the second test.
        self.is_new(i) | self.is_new(j)
    }

    /// Returns whether a box got a new grown box or was removed.
    #[inline(always)]
    fn is_new(&self, id: u32) -> bool {
        self.dirty[id as usize / 64] >> (id % 64) & 1 == 1
    }
}

impl Share {
    fn check(
        &mut self,
        boxes: &[Aabb],
        grown: &mut [Aabb],
        dirty: &mut [u64],
        first: usize,
        margin: Margin,
        simd: Simd,
    ) -> Result<(), Error> {
        dirty.fill(0);
        let mut invalid = None;
        each_doubtful_block(simd, boxes, grown, |at, block| {
            for (k, grown) in block.iter_mut().enumerate() {
                let b = &boxes[at + k];
                if within(b, grown) {
                    continue;
                }
                if let Some(defect) = b.defect() {
                    invalid.get_or_insert(Error::InvalidBox { index: first + at + k, defect });
                    return;
                }
                let before = std::mem::replace(grown, margin.grow(b));
                // A box without bounds on any side overlaps even `NOTHING`.
                if before == NOTHING || !before.overlaps(grown) {
                    self.far.push((first + at + k) as u32);
                }
                dirty[(at + k) / 64] |= 1 << ((at + k) % 64);
                self.left.push((first + at + k) as u32);
            }
        });
        invalid.map_or(Ok(()), Err)
    }
}

impl Margin {
    /// Grows a valid box on every side.
    #[inline]
    fn grow(&self, b: &Aabb) -> Aabb {
        let mean = (0..3).map(|a| b.max[a] - b.min[a]).sum::<f32>() / 3.0;
        // False for NaN too, the edge of an infinite box.
        let edge = if mean < self.longest_edge { mean } else { self.longest_edge };
        b.grown(self.share * edge)
    }
}
